"""A first orbit through noisy positions, from nothing but their times and the mass."""

from __future__ import annotations

import numpy as np
import scipy.optimize
from scipy.spatial.transform import Rotation

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError
from unmodeled.core.kepler_orbit import solve_kepler

__all__ = ["ellipse_through", "first_guess", "revolution"]

#: Harmonics of the mean anomaly that find the mean motion.
_HARMONICS = 5
#: Mean motions tried: from and to, over that of the size of the orbit, and steps over 1 / span.
_SLOWEST, _FASTEST, _STEP = 0.4, 2.5, 0.4
#: Mean motions looked at closely, and those of them whose ellipse is fitted.
_CLOSELY, _FITTED = 6, 3
_EVALUATIONS = 50
#: Mean motions that drift apart by less than this over the span, rad, are the same.
_SAME = 2.0
#: Squared residuals, in the noise, by which the best ellipse must beat any other: in pure noise
#: the best of the mean motions tried leads the next by a few.
_LEAD = 20.0
#: Fewest positions, largest eccentricity.
_FEWEST, _MOST = 12, 0.95
#: Least share of the mean square that the size of the orbit is, where noise is most of it.
_LEAST = 0.05


def revolution(positions: Array, gm: float, spread: Array | float = 0.0) -> float:
    """Return about how long a revolution takes, from the size of an orbit.

    Parameters
    ----------
    positions : ndarray (n, 3)
        Noisy.
    gm : float
        Of the body.
    spread : ndarray (n,) or float
        Their standard deviations on each axis, whose part of the size is taken off.
    """
    square = float(np.mean((positions**2).sum(axis=1)))
    own = max(square - 3.0 * float(np.mean(np.square(spread))), _LEAST * square)
    return float(2 * np.pi * np.sqrt(own**1.5 / gm))


def first_guess(times: Array, positions: Array, gm: float, spread: Array | float = 0.0) -> Array:
    """Return states (n, 6) on the Kepler ellipse nearest to noisy positions.

    Mean motions of a grid are judged by a Fourier series of the mean anomaly, which is linear;
    the best few with eccentricity and mean anomaly by an ellipse, linear in its Thiele-Innes
    constants. From the best of those all six elements are fitted, with the axis that the mass and
    the mean motion give.

    Parameters
    ----------
    times : ndarray (n,)
        Increasing; one revolution or more, and so few that the ellipse hardly turns.
    positions : ndarray (n, 3)
        Observed.
    gm : float
        Of the body.
    spread : ndarray (n,) or float
        Standard deviations of the positions on each axis; 0: not known, and no ellipse is refused.

    Raises
    ------
    DataError
        For fewer than 12 positions.
    NumericalError
        If two ellipses fit alike.
    """
    if len(times) < _FEWEST:
        raise DataError(
            f"{len(times)} positions for an orbit", allowed="at least 12, over a revolution"
        )
    t = times - times[len(times) // 2]
    mean = 2 * np.pi / revolution(positions, gm, spread)
    count = int(np.ceil((_FASTEST - _SLOWEST) * mean * (t[-1] - t[0]) / _STEP)) + 2
    motions = mean * np.linspace(_SLOWEST, _FASTEST, count)
    fits = []
    for n in _apart(motions, [_left(_series(n, t), positions) for n in motions], t, _CLOSELY):
        grid = [
            (_left(_ellipse(n, e, m, t)[0], positions), e, m)
            for e in np.linspace(0.0, 0.8, 9)
            for m in np.linspace(-np.pi, np.pi, 24, endpoint=False)
        ]
        fits.append((*min(grid), n))
    found = [_fitted(t, positions, gm, *fit[1:]) for fit in sorted(fits)[:_FITTED]]
    best = min(found, key=lambda fit: fit[0])
    square = float(np.mean(np.square(spread)))
    for cost, n, _ in found:
        other = abs(n - best[1]) * (t[-1] - t[0]) > _SAME
        if other and cost - best[0] < _LEAD * square:
            raise NumericalError(
                f"{len(t)} positions with noise of {np.sqrt(square):.3g} fit orbits of "
                f"{2 * np.pi / best[1]:.4g} and of {2 * np.pi / n:.4g} a revolution alike: squared "
                f"residuals {(cost - best[0]) / square:.2g} apart (allowed: {_LEAD:g}); "
                f"{count} mean motions tried, {2 * np.pi / motions[-1]:.3g} to "
                f"{2 * np.pi / motions[0]:.3g} a revolution",
                do="give a longer or less noisy trajectory",
            )
    return best[2]


def ellipse_through(state: Array, ahead: Array, gm: float) -> Array | None:
    """Return states (n, 6) on a Kepler ellipse at times ``ahead`` of one of them, (6,).

    None if the state is not bound.
    """
    x, v = state[:3], state[3:]
    r = float(np.linalg.norm(x))
    axis = 1.0 / (2.0 / r - float(v @ v) / gm)
    to_pericentre = np.cross(v, np.cross(x, v)) / gm - x / r
    e = float(np.linalg.norm(to_pericentre))
    if not 0 < axis < np.inf or not e < 1.0:
        return None
    p = to_pericentre / e if e > 1e-12 else x / r
    w = np.cross(x, v) / np.linalg.norm(np.cross(x, v))
    turn = Rotation.from_matrix(np.column_stack([p, np.cross(w, p), w]))
    n = np.sqrt(gm / axis**3)
    E = float(np.arctan2(x @ v / np.sqrt(gm * axis), 1.0 - r / axis)) if e > 1e-12 else 0.0
    return _states(n, e, E - e * np.sin(E), turn, ahead, gm)


def _apart(motions: Array, left: list[float], t: Array, most: int) -> list[float]:
    """Return the best few mean motions that are not the same."""
    out: list[float] = []
    for k in np.argsort(left):
        n = float(motions[k])
        if len(out) < most and all(abs(n - m) * (t[-1] - t[0]) > _SAME for m in out):
            out.append(n)
    return out


def _fitted(
    t: Array, positions: Array, gm: float, e: float, m: float, n: float
) -> tuple[float, float, Array]:
    """Return what an ellipse leaves, its mean motion and states, all elements fitted."""
    p, q = np.linalg.lstsq(_ellipse(n, e, m, t)[0], positions, rcond=None)[0]
    p = p / np.linalg.norm(p)
    w = np.cross(p, q) / np.linalg.norm(np.cross(p, q))
    turn = Rotation.from_matrix(np.column_stack([p, np.cross(w, p), w])).as_rotvec()

    def states(elements: Array) -> Array:
        share, e, m = elements[:3]
        e = float(np.clip(e, 0.0, _MOST))
        return _states(n * share, e, m, Rotation.from_rotvec(elements[3:]), t, gm)

    def misfit(elements: Array) -> Array:
        return (states(elements)[:, :3] - positions).ravel()

    found = scipy.optimize.least_squares(
        misfit,
        np.array([1.0, e, m, *turn]),
        x_scale=np.array([1e-3, 0.1, 0.1, 0.1, 0.1, 0.1]),
        max_nfev=_EVALUATIONS,  # orbits take ten; noise wanders
    )
    return 2.0 * float(found.cost), float(n * found.x[0]), states(found.x)


def _states(n: float, e: float, m: float, turn: Rotation, t: Array, gm: float) -> Array:
    place, rate = _ellipse(n, e, m, t)
    size = np.cbrt(gm / n**2) * np.array([1.0, np.sqrt(1.0 - e * e)])
    zero = np.zeros((len(t), 1))
    return np.hstack([turn.apply(np.hstack([size * part, zero])) for part in (place, rate)])


def _left(base: Array, positions: Array) -> float:
    """Return what a linear combination of columns leaves of the positions, sum of squares."""
    q = np.linalg.qr(base)[0]
    return float(((positions - q @ (q.T @ positions)) ** 2).sum())


def _series(n: float, t: Array) -> Array:
    angle = n * t[:, None] * np.arange(1, _HARMONICS + 1)
    return np.hstack([np.ones((len(t), 1)), np.cos(angle), np.sin(angle)])


def _ellipse(n: float, e: float, m: float, t: Array) -> tuple[Array, Array]:
    """Return cos E - e and sin E, (n, 2), places in the plane over the axes, and their rates."""
    E = solve_kepler(m + n * t, e)
    turn = n / (1.0 - e * np.cos(E))
    place = np.column_stack([np.cos(E) - e, np.sin(E)])
    return place, turn[:, None] * np.column_stack([-np.sin(E), np.cos(E)])
