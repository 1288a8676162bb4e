"""The classical fourth-order Runge-Kutta integrator of [Neamati2022], for many orbits at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from unmodeled.core.arrays import Array

__all__ = ["propagate_rk4"]


def propagate_rk4(
    acceleration: Callable[[Array], Array], states: Array, duration: Array, samples: int, steps: int
) -> Array:
    """Propagate orbits with a fixed step.

    Parameters
    ----------
    acceleration : callable
        Maps positions (b, 3) to accelerations (b, 3).
    states : ndarray (b, 6)
        Initial states.
    duration : ndarray (b,)
        Time between two samples of each orbit.
    samples : int
        Samples of each orbit; the first is the initial state.
    steps : int
        Steps between two samples.

    Returns
    -------
    ndarray (b, samples, 6)
    """
    h = (duration / steps)[:, None]
    y = states.copy()
    out = np.empty((len(states), samples, 6))
    out[:, 0] = y

    def rate(s: Array) -> Array:
        return np.hstack([s[:, 3:], acceleration(np.ascontiguousarray(s[:, :3]))])

    for k in range(1, samples):
        for _ in range(steps):
            k1 = rate(y)
            k2 = rate(y + 0.5 * h * k1)
            k3 = rate(y + 0.5 * h * k2)
            k4 = rate(y + h * k3)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        out[:, k] = y
    return out
