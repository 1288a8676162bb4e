r"""From a spacecraft's and a station's state to range, range rate and directions.

Light time.  The signal that arrives at t left the spacecraft at :math:`t - \tau`,

.. math::
    c \tau = |\mathbf p|, \quad
    \mathbf p = \mathbf r - \mathbf r_s - \mathbf V \tau + \tfrac12 \mathbf A \tau^2

with V = v and A = a for one way.  For two ways the mean of both legs is the distance of both ends
at the moment of the turn-round, V = v - v_s and A = a - a_s; what that leaves out,
:math:`v_s \tau \dot\rho / c` and :math:`(v_s \tau)^2 / 2\rho`, is 5e-5 m for LAGEOS and 2 mm at
the Moon.  The acceleration is
:math:`-GM\,\mathbf r/r^3` with the stated GM, zero if none is stated: then positions err by
:math:`a\tau^2/2` (0.1 mm in low orbits, 2 mm for GPS) and range rates by :math:`a\tau` (5 cm/s
for GPS).  The range rate is d range / d t of reception,
:math:`\mathbf u \cdot (\mathbf L - \mathbf S) / (1 + \mathbf u \cdot \mathbf L / c)`, with L the
velocity of what lags and S that of what does not.  Relativity (Shapiro delay: 2 cm for GPS),
troposphere and refraction are effects (:mod:`unmodeled.datasets.path_correction`), the ionosphere
is left out.  [MontenbruckGill2000] section 6.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.constants import SPEED_OF_LIGHT
from unmodeled.datasets.station import StationTrack

__all__ = ["Sight", "cross_matrix", "polar_angles", "polar_jacobian", "wrapped"]

_C = SPEED_OF_LIGHT.value
# Each turn gains a factor v/c < 1e-4; six leave rounding only.
_TURNS = 6


def wrapped(angle: Array) -> Array:
    """Angles (rad) brought to (-pi, pi].

    Examples
    --------
    >>> wrapped(np.array([3.5 * np.pi, -np.pi])) / np.pi
    array([-0.5,  1. ])
    """
    turned: Array = np.pi - np.mod(np.pi - angle, 2 * np.pi)
    return turned


def polar_angles(vectors: Array) -> Array:
    """Angle from x to y in [0, 2 pi), and above the xy plane, of vectors (n, 3); (n, 2) rad."""
    x, y, z = vectors.T
    around = np.mod(np.arctan2(y, x), 2 * np.pi)
    return np.stack([around, np.arctan2(z, np.hypot(x, y))], axis=1)


def polar_jacobian(vectors: Array) -> Array:
    """Return d `polar_angles` / d vector, (n, 2, 3)."""
    x, y, z = vectors.T
    flat = np.hypot(x, y)
    square = flat**2 + z**2
    zero = np.zeros_like(x)
    around = np.stack([-y / flat**2, x / flat**2, zero], axis=1)
    above = np.stack([-x * z / flat / square, -y * z / flat / square, flat / square], axis=1)
    return np.stack([around, above], axis=1)


def cross_matrix(v: Array) -> Array:
    """Return matrices (n, 3, 3) that multiply by v (n, 3) from the left: v x."""
    x, y, z = v.T
    o = np.zeros_like(x)
    rows = [[o, -z, y], [z, o, -x], [-y, x, o]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True)
class Sight:
    """The line from a station to a spacecraft, and how it changes.

    Parameters
    ----------
    states : ndarray (n, 6)
        m, m/s, inertial, at the time of reception.
    track : StationTrack
        The station at the same times.
    light : bool
        With light time or without (both ends at one time).
    ways : int
        1, or 2 for the mean of both legs.
    gm : float
        For the orbit's curvature during the light time, m3/s2; 0 for a straight line.
    """

    states: Array
    track: StationTrack
    light: bool
    ways: int
    gm: float

    @cached_property
    def _delay(self) -> Array:
        tau = np.zeros(len(self.states))
        if self.light:
            for _ in range(_TURNS):
                tau = np.linalg.norm(self._line(tau), axis=1) / _C
        return tau

    def _line(self, tau: Array) -> Array:
        apart = self.states[:, :3] - self.track.positions
        line: Array = apart - self._drift * tau[:, None] + 0.5 * self._bend * tau[:, None] ** 2
        return line

    @cached_property
    def _drift(self) -> Array:
        drift: Array = self.states[:, 3:]
        return drift - self.track.velocities if self.ways == 2 else drift

    @cached_property
    def _bend(self) -> Array:
        r = self.states[:, :3]
        bend: Array = -self.gm * r / np.linalg.norm(r, axis=1, keepdims=True) ** 3
        return bend - self.track.accelerations if self.ways == 2 else bend

    @cached_property
    def _gradient(self) -> Array:
        r = self.states[:, :3]
        size = np.linalg.norm(r, axis=1)[:, None, None]
        outer = 3 * r[:, :, None] * r[:, None, :] / size**2 - np.eye(3)
        gradient: Array = self.gm * outer / size**3
        return gradient

    @cached_property
    def line(self) -> Array:
        """From the station to the spacecraft, m, (n, 3)."""
        return self._line(self._delay)

    @cached_property
    def distance(self) -> Array:
        """Length of the line, m, (n,)."""
        distance: Array = np.linalg.norm(self.line, axis=1)
        return distance

    @cached_property
    def _unit(self) -> Array:
        return self.line / self.distance[:, None]

    @cached_property
    def _lagging(self) -> Array:
        return self._drift - self._bend * self._delay[:, None]

    @cached_property
    def _relative(self) -> Array:
        return self._lagging if self.ways == 2 else self._lagging - self.track.velocities

    @cached_property
    def _stretch(self) -> Array:
        along = _dot(self._unit, self._lagging) / _C
        return 1.0 + (along if self.light else np.zeros_like(along))

    @cached_property
    def rate(self) -> Array:
        """Return d distance / d time of reception, m/s, (n,)."""
        return _dot(self._unit, self._relative) / self._stretch

    def state_columns(self) -> tuple[Array, Array, Array]:
        """Explicit derivatives of line, lagging and relative velocity by the state, (n, 3, 6)."""
        n = len(self.states)
        tau, unit = self._delay[:, None, None], np.broadcast_to(np.eye(3), (n, 3, 3))
        line = np.concatenate([unit + 0.5 * tau**2 * self._gradient, -tau * unit], axis=2)
        lagging = np.concatenate([-tau * self._gradient, unit], axis=2)
        return line, lagging, lagging

    def station_columns(self) -> tuple[Array, Array, Array]:
        """Return the same by the station's inertial position and velocity, (n, 3, 6)."""
        n = len(self.states)
        unit = np.broadcast_to(np.eye(3), (n, 3, 3))
        zero, tau = np.zeros((n, 3, 3)), self._delay[:, None, None]
        still, moving = np.concatenate([-unit, zero], axis=2), np.concatenate([zero, -unit], axis=2)
        if self.ways == 2:
            return still - tau * moving, moving, moving
        return still, np.zeros((n, 3, 6)), moving

    def line_derivative(self, columns: tuple[Array, Array, Array]) -> Array:
        """Return d line / d q (n, 3, m), the change of light time included."""
        return self._closed(columns)[0]

    def distance_derivative(self, columns: tuple[Array, Array, Array]) -> Array:
        """Return d distance / d q, (n, 1, m)."""
        return _columns(self._unit, self._closed(columns)[0])[:, None]

    def rate_derivative(self, columns: tuple[Array, Array, Array]) -> Array:
        """Return d rate / d q, (n, 1, m)."""
        line, lagging, relative = self._closed(columns)
        u = self._unit
        along = np.einsum("ni,nim->nm", u, line)
        turn = (line - u[:, :, None] * along[:, None]) / self.distance[:, None, None]
        top = _columns(self._relative, turn) + _columns(u, relative)
        if not self.light:
            return top[:, None]
        bottom = (_columns(self._lagging, turn) + _columns(u, lagging)) / _C
        return ((top - self.rate[:, None] * bottom) / self._stretch[:, None])[:, None]

    def _closed(self, columns: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        line, lagging, relative = columns
        if not self.light:
            return columns
        delay = _columns(self._unit, line) / (_C + _dot(self._unit, self._lagging))[:, None]
        later = self._bend[:, :, None] * delay[:, None]
        moved = line - self._lagging[:, :, None] * delay[:, None]
        return moved, lagging - later, relative - later


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("ni,ni->n", a, b)
    return product


def _columns(a: Array, b: Array) -> Array:
    product: Array = np.einsum("ni,nim->nm", a, b)
    return product
