"""Linear relative motion about a circular orbit: exact for any step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError

__all__ = ["ClohessyWiltshire", "clohessy_wiltshire_matrix", "clohessy_wiltshire_transition"]


@dataclass(frozen=True)
class ClohessyWiltshire:
    r"""Clohessy-Wiltshire (Hill) equations in the target's RTN axes.

    .. math::
        \ddot x = 3n^2 x + 2n\dot y, \quad \ddot y = -2n\dot x, \quad \ddot z = -n^2 z

    Source: [Pesce2020] Eq. 30, [Marchese2023] Eq. 3.51-3.52 (solution). Left out: eccentricity of
    the target, differences of gravity beyond the linear, everything but a point mass.

    Parameters
    ----------
    mean_motion : float
        n, rad/s.

    Raises
    ------
    ConfigError
        If n is not positive.
    """

    mean_motion: float

    def __post_init__(self) -> None:
        if not 0.0 < self.mean_motion < math.inf:
            raise ConfigError(f"mean motion {self.mean_motion}", allowed="a number > 0, rad/s")

    @property
    def size(self) -> int:
        """Six: relative position and velocity."""
        return 6

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, 6) and its Jacobian (1, 6, 6)."""
        A = clohessy_wiltshire_matrix(self.mean_motion)
        return x @ A.T, A[None]

    def propagate(self, x: Array, t: float, dt: float) -> tuple[Array, Array]:
        """Return the states (b, 6) after ``dt`` and the transition matrix (1, 6, 6): exact."""
        F = clohessy_wiltshire_transition(self.mean_motion, dt)
        return x @ F.T, F[None]


def clohessy_wiltshire_matrix(mean_motion: float) -> Array:
    """Return A (6, 6) of dx/dt = A x."""
    n = mean_motion
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[3, 0], A[3, 4], A[4, 3], A[5, 2] = 3 * n * n, 2 * n, -2 * n, -n * n
    return A


@lru_cache(maxsize=256)
def clohessy_wiltshire_transition(mean_motion: float, dt: float) -> Array:
    """Return exp(A dt) (6, 6) in closed form, [Marchese2023] Eq. 3.52; not to be written to.

    Examples
    --------
    >>> clohessy_wiltshire_transition(1e-3, 2 * math.pi * 1e3)[0, 0].round(12)
    np.float64(1.0)
    """
    n, angle = mean_motion, mean_motion * dt
    s, c = math.sin(angle), math.cos(angle)
    versine = 2.0 * math.sin(0.5 * angle) ** 2  # 1 - c without cancellation
    F = np.zeros((6, 6))
    F[0, 0], F[0, 3], F[0, 4] = 1.0 + 3.0 * versine, s / n, 2.0 * versine / n
    F[1, 0], F[1, 1] = 6.0 * _sine_excess(angle), 1.0
    F[1, 3], F[1, 4] = -2.0 * versine / n, (4.0 * s - 3.0 * angle) / n
    F[2, 2], F[2, 5] = c, s / n
    F[3, 0], F[3, 3], F[3, 4] = 3.0 * n * s, c, 2.0 * s
    F[4, 0], F[4, 3], F[4, 4] = -6.0 * n * versine, -2.0 * s, 1.0 - 4.0 * versine
    F[5, 2], F[5, 5] = -n * s, c
    F.setflags(write=False)
    return F


def _sine_excess(angle: float) -> float:
    """Return sin a - a; by its series where the difference would cancel."""
    if abs(angle) > 0.5:
        return math.sin(angle) - angle
    square, term, total = angle * angle, angle, 0.0
    # seven terms: the next is below 0.5^17 / 17!, far below rounding of the first
    for k in range(1, 8):
        term *= -square / ((2 * k) * (2 * k + 1))
        total += term
    return total
