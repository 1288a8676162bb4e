"""A first orbit through noisy positions, from nothing but their times and the mass."""

from __future__ import annotations

import numpy as np
import scipy.optimize
from scipy.spatial.transform import Rotation

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError

__all__ = ["first_guess"]

#: Harmonics of the mean anomaly that find the mean motion; motions tried, and looked at closely.
_HARMONICS, _MOTIONS, _CLOSELY = 5, 600, 6
#: Largest eccentricity.
_MOST = 0.95


def first_guess(times: Array, positions: Array, gm: float, turning=True) -> Array:
    """Return states (n, 6) on the slowly turning Kepler ellipse nearest to noisy positions.

    Mean motions of a grid are judged by a Fourier series of the mean anomaly, which is linear;
    the best few with eccentricity and mean anomaly by an ellipse, linear in its Thiele-Innes
    constants. From there all elements, and a constant rate at which the ellipse turns about any
    axis, are fitted together.

    Parameters
    ----------
    times : ndarray (n,)
        Increasing; more than one revolution.
    positions : ndarray (n, 3)
        Observed.
    gm : float
        Of the body; ties the size of the ellipse to its mean motion.
    """
    if len(times) < 12:
        raise DataError(
            f"{len(times)} positions for an orbit", allowed="at least 12, over a revolution"
        )
    t = times - times[len(times) // 2]
    radius = float(np.median(np.linalg.norm(positions, axis=1)))
    motions = np.sqrt(gm / radius**3) * np.geomspace(0.4, 2.5, _MOTIONS)
    order = np.argsort([_left(_series(n, t), positions) for n in motions])
    near: list[float] = []
    for n in motions[order]:
        if len(near) < _CLOSELY and all(abs(n / m - 1) > 0.01 for m in near):
            near.append(float(n))
    grid = [
        (_left(_ellipse(n, e, m, t)[0], positions), n, e, m)
        for n in near
        for e in np.linspace(0.0, 0.8, 9)
        for m in np.linspace(-np.pi, np.pi, 24, endpoint=False)
    ]
    _, n, e, m = min(grid)
    p, q = np.linalg.lstsq(_ellipse(n, e, m, t)[0], positions, rcond=None)[0]
    p = p / np.linalg.norm(p)
    w = np.cross(p, q) / np.linalg.norm(np.cross(p, q))
    turn = Rotation.from_matrix(np.column_stack([p, np.cross(w, p), w])).as_rotvec()
    start = np.array([1.0, e, m, *turn, 0.0, 0.0, 0.0])

    def misfit(elements: Array) -> Array:
        return (_turning(elements, n, t, gm)[:, :3] - positions).ravel()

    found = scipy.optimize.least_squares(
        misfit, start, x_scale=np.array([1e-3, 0.1, 0.1, 0.1, 0.1, 0.1, 1e-2, 1e-2, 1e-2])
    )
    if not turning:
        found = scipy.optimize.least_squares(
            lambda el: misfit(np.concatenate([el, np.zeros(3)])), found.x[:6], x_scale=np.array([1e-3, 0.1, 0.1, 0.1, 0.1, 0.1])
        )
        return _turning(np.concatenate([found.x, np.zeros(3)]), n, t, gm)
    return _turning(found.x, n, t, gm)


def _turning(elements: Array, n: float, t: Array, gm: float) -> Array:
    """Return states (n, 6) of: motion over ``n``, eccentricity, anomaly, rotation, its rate."""
    share, e, m = elements[:3]
    e = float(np.clip(e, 0.0, _MOST))
    motion = n * share
    place, rate = _ellipse(motion, e, m, t)
    size = (gm / motion**2) ** (1.0 / 3.0) * np.array([1.0, np.sqrt(1.0 - e * e)])
    zero = np.zeros(len(t))
    fixed = Rotation.from_rotvec(elements[3:6])
    x = fixed.apply(np.column_stack([size * place, zero]))
    v = fixed.apply(np.column_stack([size * rate, zero]))
    turn = Rotation.from_rotvec(t[:, None] * elements[6:9])
    x = turn.apply(x)
    return np.hstack([x, turn.apply(v) + np.cross(elements[6:9], x)])


def _left(base: Array, positions: Array) -> float:
    """Return what a linear combination of columns leaves of the positions, sum of squares."""
    q = np.linalg.qr(base)[0]
    return float(((positions - q @ (q.T @ positions)) ** 2).sum())


def _series(n: float, t: Array) -> Array:
    angle = n * t[:, None] * np.arange(1, _HARMONICS + 1)
    return np.hstack([np.ones((len(t), 1)), np.cos(angle), np.sin(angle)])


def _ellipse(n: float, e: float, m: float, t: Array) -> tuple[Array, Array]:
    """Return the two coordinates (n, 2) in the plane of an ellipse of axis 1, and their rates."""
    mean = m + n * t
    E = mean + e * np.sin(mean)
    for _ in range(12):
        E = E - (E - e * np.sin(E) - mean) / (1.0 - e * np.cos(E))
    turn = n / (1.0 - e * np.cos(E))
    place = np.column_stack([np.cos(E) - e, np.sin(E)])
    return place, turn[:, None] * np.column_stack([-np.sin(E), np.cos(E)])
