"""What an instrument would read: values and derivatives of every kind of measurement.

The private engine of :class:`unmodeled.datasets.measurements.Measurements`, which documents what
the numbers mean.  Every function returns *readings*: angles in rad, not yet shortened by the cosine
of the declination, no bias added.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from unmodeled.core.arrays import Array
from unmodeled.core.constants import SPEED_OF_LIGHT
from unmodeled.datasets.antenna_motion import antenna_columns, antenna_jacobian
from unmodeled.datasets.measurement_geometry import (
    Sight,
    cross_matrix,
    polar_angles,
    polar_jacobian,
    wrapped,
)

if TYPE_CHECKING:
    from unmodeled.datasets.measurements import Measurements

__all__ = [
    "ANGLES",
    "COMPONENTS",
    "POSITIONS",
    "SIGHTED",
    "explicit_rate",
    "measured_states",
    "offset_columns",
    "readings",
    "rotation_columns",
    "state_columns",
    "station_columns",
    "turned",
]

#: Kind -> names of its components.
COMPONENTS: dict[str, tuple[str, ...]] = {
    "position": ("x", "y", "z"),
    "position_velocity": ("x", "y", "z", "vx", "vy", "vz"),
    "range": ("range",),
    "range_rate": ("range_rate",),
    "right_ascension_declination": ("ra_cosdec", "dec"),
    "azimuth_elevation": ("azimuth_cosel", "elevation"),
}
#: Kinds by how they are made.
POSITIONS = ("position", "position_velocity")
ANGLES = ("right_ascension_declination", "azimuth_elevation")
SIGHTED = ("range", "range_rate", *ANGLES)

_Columns: TypeAlias = tuple[Array, Array, Array]
_C = SPEED_OF_LIGHT.value


def readings(m: Measurements, states: Array) -> Array:
    """Return what the instrument reads, (n, k)."""
    at = measured_states(m, states)
    out = _seen(m, at)
    for correction, factor in m.corrections:
        out = out + factor * correction.value(m, at)
    return out


def state_columns(m: Measurements, states: Array) -> Array:
    """Return d readings / d state, (n, k, 6)."""
    out = _state_columns(m, measured_states(m, states))
    return out @ antenna_jacobian(m.antenna, states) if np.any(m.antenna) else out


def offset_columns(m: Measurements, states: Array) -> Array:
    """Return d readings / d offset of the antenna, (n, k, 3)."""
    out: Array = _state_columns(m, measured_states(m, states)) @ antenna_columns(states)
    return out


def station_columns(m: Measurements, states: Array) -> Array:
    """Return d readings / d the station's inertial position and velocity, (n, k, 6).

    The local horizon stays as it is.
    """
    at = measured_states(m, states)
    out = _shares(m, at, lambda s: s.station_columns())
    for correction, factor in m.corrections:
        out = out + factor * correction.station_columns(m, at)
    return out


def rotation_columns(m: Measurements, states: Array) -> Array:
    """Return d readings / d the rotation vector, (n, k, 3); zero where axes do not matter."""
    at = measured_states(m, states)
    if m.kind in POSITIONS:
        x = at[:, : len(m.components)]
        rows = [_rotated(m, x[:, b : b + 3]) for b in range(0, x.shape[1], 3)]
        # `turn` holds the rotation already: undo it before what comes after it.
        after = m.scale * m.turn @ turned(m.rotation).T
        return np.concatenate([after @ row for row in rows], axis=1)
    if m.kind != "right_ascension_declination":
        return np.zeros((len(states), len(m.components), 3))
    out = np.zeros((len(states), 2, 3))
    for share, sight in _sights(m, at):
        line = _direction(m, sight)
        out += share * polar_jacobian(line @ turned(m.rotation).T) @ _rotated(m, line)
    return out


def explicit_rate(m: Measurements, states: Array) -> Array:
    """Return d readings / d t at a fixed state, (n, k): the station moves, tagged axes do not."""
    at = measured_states(m, states)
    if m.kind in POSITIONS:
        if not m.earth_fixed:
            return np.zeros((len(states), len(m.components)))
        matrix = turned(m.rotation)
        x = at[:, : len(m.components)].reshape(len(states), -1, 3) @ matrix.T
        slip = -np.cross(m.track.spin[:, None], x).reshape(len(states), -1)
        return m.scale * _blocks(m.turn @ matrix.T, slip)
    moved = np.concatenate([m.track.velocities, m.track.accelerations], axis=1)
    by_station = _shares(m, at, lambda s: s.station_columns())
    out: Array = np.einsum("nkj,nj->nk", by_station, moved)
    if m.kind == "azimuth_elevation":
        for share, sight in _sights(m, at):
            local = _local(m, sight)
            sweep = np.einsum("nij,nj->ni", _north_east_up(m), -np.cross(m.track.spin, sight.line))
            out = out + share * np.einsum("nki,ni->nk", polar_jacobian(local), sweep)
    for correction, factor in m.corrections:
        out = out + factor * correction.explicit_rate(m, at)
    return out


def _state_columns(m: Measurements, at: Array) -> Array:
    """Return d readings / d the state of what is measured, (n, k, 6)."""
    if m.kind in POSITIONS:
        k = len(m.components)
        out = np.zeros((len(at), k, 6))
        for b in range(0, k, 3):
            out[:, b : b + 3, b : b + 3] = m.scale * m.turn
        return out
    out = _shares(m, at, lambda s: s.state_columns())
    for correction, factor in m.corrections:
        out = out + factor * correction.state_columns(m, at)
    return out


def measured_states(m: Measurements, states: Array) -> Array:
    """Return the states (n, 6) of what is measured."""
    if not np.any(m.antenna):
        return states
    moved: Array = states + antenna_columns(states) @ np.asarray(m.antenna)
    return moved


def _seen(m: Measurements, at: Array) -> Array:
    if m.kind in POSITIONS:
        return m.scale * _blocks(m.turn, at[:, : len(m.components)])
    parts = [(share, _reading(m, sight)) for share, sight in _sights(m, at)]
    if len(parts) == 1:
        return parts[0][1]
    # Between no light time and all of it; angles may lie on either side of zero.
    without, (share, with_light) = parts[0][1], parts[1]
    step = with_light - without
    if m.kind in ANGLES:
        step[:, 0] = wrapped(step[:, 0])
    return without + share * step


def turned(rotation: npt.ArrayLike) -> Array:
    """Matrix (3, 3) of components along axes turned by a rotation vector (rad)."""
    matrix: Array = Rotation.from_rotvec(-np.asarray(rotation)).as_matrix()
    return matrix


def _sights(m: Measurements, states: Array) -> list[tuple[float, Sight]]:
    def sight(light: bool) -> Sight:
        return Sight(states, m.track, light, m.ways, m.gm)

    share = float(m.light_time)
    if share in (0.0, 1.0):
        return [(1.0, sight(bool(share)))]
    return [(1.0 - share, sight(False)), (share, sight(True))]


def _reading(m: Measurements, sight: Sight) -> Array:
    if m.kind == "range":
        return m.scale * sight.distance[:, None]
    if m.kind == "range_rate":
        return m.scale * sight.rate[:, None]
    if m.kind == "azimuth_elevation":
        return polar_angles(_local(m, sight))
    return polar_angles(_direction(m, sight) @ turned(m.rotation).T)


def _shares(m: Measurements, states: Array, columns: Callable[[Sight], _Columns]) -> Array:
    parts = [share * _derivative(m, s, columns(s)) for share, s in _sights(m, states)]
    return parts[0] if len(parts) == 1 else parts[0] + parts[1]


def _derivative(m: Measurements, sight: Sight, columns: _Columns) -> Array:
    if m.kind == "range":
        return m.scale * sight.distance_derivative(columns)
    if m.kind == "range_rate":
        return m.scale * sight.rate_derivative(columns)
    line = sight.line_derivative(columns)
    if m.kind == "azimuth_elevation":
        return polar_jacobian(_local(m, sight)) @ (_north_east_up(m) @ line)
    if m.astrometric:
        longer = sight.distance_derivative(columns)
        line = line - m.barycentric_velocity[:, :, None] / _C * longer
    matrix = turned(m.rotation)
    return polar_jacobian(_direction(m, sight) @ matrix.T) @ (matrix @ line)


def _direction(m: Measurements, sight: Sight) -> Array:
    """Return the line, or where it stands among the stars' catalogue places."""
    if not m.astrometric:
        return sight.line
    # The Earth has gone on with its own velocity while the light was under way.
    return sight.line - m.barycentric_velocity * (sight.distance / _C)[:, None]


def _north_east_up(m: Measurements) -> Array:
    return m.track.north_east_up


def _local(m: Measurements, sight: Sight) -> Array:
    local: Array = np.einsum("nij,nj->ni", _north_east_up(m), sight.line)
    return local


def _blocks(matrices: Array, vectors: Array) -> Array:
    split = vectors.reshape(len(vectors), -1, 3)
    out: Array = np.einsum("nij,nbj->nbi", matrices, split).reshape(len(vectors), -1)
    return out


def _rotated(m: Measurements, vectors: Array) -> Array:
    """Return d (turned @ vector) / d rotation, (n, 3, 3), exact at any angle [Sola2018] appendix B.

    With phi = -rotation: d exp([phi]) r / d phi = -exp([phi]) [r] J(phi), J the right Jacobian.
    """
    phi = -np.asarray(m.rotation, dtype=np.float64)
    size = float(np.linalg.norm(phi))
    cross = cross_matrix(phi[None])[0]
    if size < 1e-4:  # series: the closed form loses digits
        one, two = 0.5 - size**2 / 24, 1 / 6 - size**2 / 120
    else:
        one, two = (1 - np.cos(size)) / size**2, (size - np.sin(size)) / size**3
    jacobian = np.eye(3) - one * cross + two * cross @ cross
    out: Array = turned(m.rotation) @ cross_matrix(vectors) @ jacobian
    return out
