"""Which initial conditions collide, and the line between in semi-major axis and eccentricity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy.optimize
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.seeds import Streams
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.elements import kepler_period
from unmodeled.datasets.initial_conditions import SCREENING_PERIODS, sample_elements, states_of
from unmodeled.datasets.simulation import gravity_of

__all__ = ["Boundary", "collision_boundary", "screen"]

# So weak that it moves no boundary between classes that overlap; classes that do not overlap
# would send the slope of the logistic function to infinity without it.
_RIDGE = 1e-6


def screen(
    body: Body,
    count: int,
    seed: int = 1,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    periods: float = SCREENING_PERIODS,
) -> pd.DataFrame:
    """Draw initial conditions from [Neamati2022] Table 3 and follow each until it collides.

    The rows for a smaller ``count`` are the beginning of those for a larger one.

    Parameters
    ----------
    body : Body
        Its field moves the orbits, its Brillouin sphere is what they hit.
    count : int
        How many.
    seed : int
        Of the draw.
    ranges : mapping, optional
        Replaces ranges of Table 3.
    periods : float
        Kepler periods that each orbit is followed.

    Returns
    -------
    DataFrame
        The elements (semi-major axis in Brillouin radii, angles in degrees) and
        ``entry_periods``: Kepler periods until the orbit enters the sphere, NaN if it never does.
    """
    if count < 1:
        raise ConfigError(f"{count} initial conditions are asked for", allowed="1 or more")
    elements = sample_elements(count, Streams(seed).generator("initial_conditions"), ranges)
    radius = body.brillouin_radius
    states = states_of(elements, body.gm, radius)
    period = kepler_period(elements["semi_major_axis"].to_numpy() * radius, body.gm)
    entry = gravity_of(body).first_collision(states, periods * period, radius)
    return elements.assign(entry_periods=entry / period)


@dataclass(frozen=True, slots=True)
class Boundary:
    """The straight line e = slope a + intercept that parts colliding from collision-free.

    Parameters
    ----------
    slope, intercept : float
        a in Brillouin radii; above the line a collision is the more likely.
    wrong, wrong_kepler : float
        Share of the initial conditions on the wrong side of the line, and of Kepler's boundary
        e = 1 - 1/a, where the periapsis of the point-mass orbit touches the sphere.
    wrong_curved : float
        Share on the wrong side of a fitted boundary that bends with a e, as Kepler's does.
    wrong_other : float
        The same when the other elements may move that boundary.
    p_other : float
        Of the likelihood-ratio test that the other elements add nothing to a, e and a e.
    hit_outside, free_inside : float
        Share of the initial conditions whose point-mass orbit stays outside the sphere and that
        collide all the same; share of those whose point-mass orbit enters it that never do.
    """

    slope: float
    intercept: float
    wrong: float
    wrong_kepler: float
    wrong_curved: float
    wrong_other: float
    p_other: float
    hit_outside: float
    free_inside: float


def collision_boundary(screened: pd.DataFrame) -> Boundary:
    """Fit the boundary by logistic regression on a and e, with a e, and with all elements.

    Angles enter as sines and cosines of themselves, inclination as its squared sine too (the
    second zonal does not know prograde from retrograde).

    Parameters
    ----------
    screened : DataFrame
        From `screen`.

    Raises
    ------
    DataError
        If all initial conditions collide, or none.
    """
    hit = screened["entry_periods"].notna().to_numpy()
    if hit.all() or not hit.any():
        raise DataError(
            f"{int(hit.sum())} of {len(hit)} initial conditions collide",
            allowed="some of both kinds",
            do="draw more",
        )
    a, e = (screened[k].to_numpy(dtype=np.float64) for k in ("semi_major_axis", "eccentricity"))
    plain = np.column_stack([a, e])
    angles = np.deg2rad(
        screened[["inclination", "node", "periapsis", "true_anomaly"]].to_numpy(dtype=np.float64)
    )
    curved = np.column_stack([plain, a * e])
    more = np.column_stack([curved, np.sin(angles), np.cos(angles), np.sin(angles[:, 0]) ** 2])
    weights, _ = _logistic(plain, hit)
    weights_curved, loss = _logistic(curved, hit)
    weights_more, loss_more = _logistic(more, hit)
    added = more.shape[1] - curved.shape[1]
    outside = a * (1 - e) > 1
    return Boundary(
        slope=float(-weights[1] / weights[2]),
        intercept=float(-weights[0] / weights[2]),
        wrong=_wrong(plain, weights, hit),
        wrong_kepler=float(np.mean(outside == hit)),
        wrong_curved=_wrong(curved, weights_curved, hit),
        wrong_other=_wrong(more, weights_more, hit),
        p_other=float(scipy.stats.chi2.sf(2 * (loss - loss_more), added)),
        hit_outside=_share(hit[outside]),
        free_inside=_share(~hit[~outside]),
    )


def _logistic(features: Array, hit: np.ndarray) -> tuple[Array, float]:
    """Return weights (1 + k,), the constant first, and the negative log likelihood."""
    mean, scale = features.mean(axis=0), features.std(axis=0)
    x = np.column_stack([np.ones(len(features)), (features - mean) / scale])
    sign = np.where(hit, 1.0, -1.0)

    def loss(w: Array) -> tuple[float, Array]:
        margin = sign * (x @ w)
        value = float(np.sum(np.logaddexp(0.0, -margin)) + 0.5 * _RIDGE * w @ w)
        slope = -sign * np.exp(-np.logaddexp(0.0, margin))
        return value, x.T @ slope + _RIDGE * w

    found = scipy.optimize.minimize(loss, np.zeros(x.shape[1]), jac=True, method="BFGS")
    w = np.asarray(found.x, dtype=np.float64)
    slopes = w[1:] / scale
    return np.concatenate([[w[0] - slopes @ mean], slopes]), float(found.fun)


def _share(of: np.ndarray) -> float:
    return float(np.mean(of)) if len(of) else float("nan")


def _wrong(features: Array, weights: Array, hit: np.ndarray) -> float:
    return float(np.mean((weights[0] + features @ weights[1:] > 0) != hit))
