"""Where the spacecraft was: everything that residuals may depend on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.constants import RADIUS_OF
from unmodeled.core.frames import body_fixed_from_inertial
from unmodeled.datasets.bodies import Body
from unmodeled.models.physics import Dynamics

__all__ = ["VARIABLES", "Variable", "body_axes", "orbit_geometry", "revolution", "sun_position"]


@dataclass(frozen=True)
class Variable:
    """A variable of the geometry.

    Parameters
    ----------
    title : str
        In words.
    unit : str
        Of the column.
    circle : bool
        True for angles that close after a turn.
    """

    title: str
    unit: str
    circle: bool = False


#: Columns of `orbit_geometry`. SI; angles in rad.
VARIABLES: Mapping[str, Variable] = MappingProxyType(
    {
        "radius": Variable("radius", "m"),
        "altitude": Variable("altitude", "m"),
        "speed": Variable("speed", "m/s"),
        "latitude": Variable("body-fixed latitude", "rad"),
        "longitude": Variable("body-fixed longitude", "rad", circle=True),
        "right_ascension": Variable("inertial longitude", "rad", circle=True),
        "argument_of_latitude": Variable("argument of latitude", "rad", circle=True),
        "true_anomaly": Variable("true anomaly", "rad", circle=True),
        "sun_angle": Variable("angle from the Sun", "rad"),
        "sun_elevation": Variable("height of the Sun over the orbit plane", "rad"),
        "sunlit": Variable("sunlit share", "1"),
        "time": Variable("time", "s"),
    }
)


def orbit_geometry(model: Dynamics, body: Body, states: Array, times: Array) -> pd.DataFrame:
    """Return the geometry of an orbit, one row a time, columns as in `VARIABLES`.

    Parameters
    ----------
    model : Dynamics
        Knows how the body is turned and where the Sun is.
    body : Body
        Its ``reference_radius`` is the zero of the altitude and throws the shadow.
    states : ndarray (n, 6)
        Inertial, m and m/s.
    times : ndarray (n,)
        s since the epoch.

    Returns
    -------
    DataFrame
        Angles in rad: those that close from 0 to 2 pi. Body-fixed longitude is the inertial one
        where the model does not turn the body; what concerns the Sun is NaN where its place is
        unknown or the Sun is the body. True anomaly and argument of latitude are those of
        the osculating orbit, [MontenbruckGill2000] section 2.2.4.
    """
    r, v = states[:, :3], states[:, 3:]
    radius = np.linalg.norm(r, axis=1)
    fixed = np.einsum("nij,nj->ni", body_axes(model, times), r)
    h = np.cross(r, v)
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    node = np.stack([-h[:, 1], h[:, 0], np.zeros(len(h))], axis=1)
    flat = np.linalg.norm(node, axis=1) < 1e-9
    node[flat] = [1.0, 0.0, 0.0]  # no node: from the x axis
    shape = np.cross(v, np.cross(r, v)) / body.gm - r / radius[:, None]
    sun = sun_position(model, body, times)
    if sun is None or not np.any(sun):
        nothing = np.full(len(r), np.nan)
        angle = elevation = lit = nothing
    else:
        away = sun - r
        distance = np.linalg.norm(away, axis=1)
        towards = sun / np.linalg.norm(sun, axis=1, keepdims=True)
        angle = np.arccos(np.clip(np.sum(r * towards, axis=1) / radius, -1, 1))
        elevation = np.arcsin(np.clip(np.sum(h * towards, axis=1), -1, 1))
        cosine = -np.sum(r * away, axis=1) / (radius * distance)
        lit = _lit(
            np.arccos(np.clip(cosine, -1, 1)),
            np.arcsin(np.minimum(body.reference_radius / radius, 1.0)),
            np.arcsin(RADIUS_OF["sun"].value / distance),
        )
    return pd.DataFrame(
        {
            "radius": radius,
            "altitude": radius - body.reference_radius,
            "speed": np.linalg.norm(v, axis=1),
            "latitude": np.arcsin(np.clip(fixed[:, 2] / radius, -1, 1)),
            "longitude": _turn(np.arctan2(fixed[:, 1], fixed[:, 0])),
            "right_ascension": _turn(np.arctan2(r[:, 1], r[:, 0])),
            "argument_of_latitude": _between(node, r, h),
            "true_anomaly": _between(shape, r, h),
            "sun_angle": angle,
            "sun_elevation": elevation,
            "sunlit": lit,
            "time": times,
        }
    )


def body_axes(model: Dynamics, times: Array) -> Array:
    """Return body_fixed_from_inertial (n, 3, 3); the identity where the model turns nothing."""
    if model.orientation is not None:
        return model.orientation.matrices(times)
    if model.system.spinning:
        values = model.values
        return body_fixed_from_inertial(times, values["spin_rate"], values["prime_meridian"])
    return np.broadcast_to(np.eye(3), (len(times), 3, 3))


def sun_position(model: Dynamics, body: Body, times: Array) -> Array | None:
    """Return where the Sun is from the body's centre (n, 3), m; None where nobody knows."""
    if body.name == "sun":
        return np.zeros((len(times), 3))
    if model.tracks is None or "sun" not in model.tracks.coefficients:
        return None
    return model.tracks.position("sun", times)


def revolution(states: Array, times: Array) -> float:
    """Return the mean time of one turn about the body, s.

    Parameters
    ----------
    states : ndarray (n, 6)
        Densely along the orbit.
    times : ndarray (n,)
        s.
    """
    r, v = states[:, :3], states[:, 3:]
    rate = np.linalg.norm(np.cross(r, v), axis=1) / np.sum(r**2, axis=1)
    return float(2 * np.pi * (times[-1] - times[0]) / np.trapezoid(rate, times))


def _turn(angle: Array) -> Array:
    turned: Array = np.mod(angle, 2 * np.pi)
    return turned


def _between(start: Array, r: Array, h: Array) -> Array:
    """Angle from a direction to the position, counted along the motion."""
    return _turn(np.arctan2(np.sum(np.cross(start, r) * h, axis=1), np.sum(start * r, axis=1)))


def _lit(apart: Array, body: Array, sun: Array) -> Array:
    """Share of the Sun's disc that is seen: overlap of two discs, [MontenbruckGill2000] (3.87)."""
    a, b, c = sun, body, apart
    x = (c * c + a * a - b * b) / (2 * np.maximum(c, 1e-300))
    y = np.sqrt(np.maximum(a * a - x * x, 0.0))
    lens = a * a * np.arccos(np.clip(x / a, -1, 1)) - c * y
    lens += b * b * np.arccos(np.clip((c - x) / b, -1, 1))
    hidden = np.where(c >= a + b, 0.0, lens / (np.pi * a * a))
    hidden = np.where(c <= b - a, 1.0, hidden)
    lit: Array = 1.0 - np.where(c <= a - b, (b / a) ** 2, hidden)
    return lit
