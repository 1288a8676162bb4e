"""Bayesian linear regression of harmonics: evidence and posterior from summed data."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.optimize import minimize_scalar

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.learned._harmonic_kernels import coefficient_variances
from unmodeled.models.learned._harmonic_sums import Sums
from unmodeled.models.physics.exterior_harmonics import column_degrees

__all__ = ["Posterior", "fit_prior"]

#: Ratios of prior variance to noise variance that are tried, coarse; refined around the best.
_RATIOS = np.linspace(math.log(1e-12), math.log(1e34), 93)
#: Attenuation of the prior with each degree, coarse; refined around the best. A body whose matter
#: all lay within 0.2 of its radius would be a point mass.
_ATTENUATIONS = np.log(np.geomspace(0.2, 1.0, 8))
#: Prior deviations of degree 2 over which the posterior is averaged, log-uniform: from the zonals
#: of Bennu (3.9e-3; Eros has 3.6e-2) to a field that no body within the reference sphere exceeds.
#: For a body at the lower end most of the range is too rough, and the band wide where noise hides
#: degree 2; a range from 1e-3 on makes the band of clear data too narrow (docs/learners.md).
_AMPLITUDES = np.log(np.geomspace(4e-3, 1.0, 12))
#: Share of the best weight below which a prior is left out of the average.
_LEAST_WEIGHT = 0.01
#: Log evidence by which a higher degree may fall short of the best and still be taken.
_DEGREE_MARGIN = 10.0
#: Degrees without a gain after which a growing search ends: a symmetric body lacks every other.
_PATIENCE = 3


@dataclass(frozen=True)
class Posterior:
    """Coefficients and how well they are known.

    Parameters
    ----------
    degree : int
    attenuation, amplitude, noise : float
        q, s and sigma of the prior variances s^2 q^(2n) (times the law's factor) and of the
        weighted noise.
    log_evidence : float
    mean : ndarray (p,)
    root : ndarray (p, p)
        The covariance is ``root @ root.T``.
    """

    degree: int
    attenuation: float
    amplitude: float
    noise: float
    log_evidence: float
    mean: Array
    root: Array


def fit_prior(
    sums: Sums,
    free: int,
    law: str,
    degrees: range,
    progress: Callable[[float], None],
    *,
    average: bool = True,
    growing: bool = False,
) -> Posterior:
    """Maximise the evidence over degree, attenuation, amplitude and noise.

    The first ``free`` columns have a flat prior and are integrated out (restricted likelihood).
    As columns are ordered by degree, one triangle serves every degree.

    Parameters
    ----------
    sums : Sums
        Up to the highest degree.
    free : int
        Number of columns with a flat prior.
    law : str
        Of `_harmonic_kernels.LAWS`.
    degrees : range
        Degrees to choose from. The highest within a log evidence of 10 of the best is taken:
        a degree too low makes the covariance too small, one too high costs nothing.
    average : bool
        Average mean and covariance over the priors of this degree by their evidence (`_average`);
        else take those of the best one.
    growing : bool
        Whether to go up in degree only until three more have added less than 1 to the evidence.
    """
    found: list[tuple[float, int, float]] = []
    for degree in degrees:
        best = max(
            (_profile(sums, free, law, degree, a) for a in _ATTENUATIONS), key=lambda p: p[0]
        )
        found.append((best[0], degree, best[1]))
        progress(0.7 * (degree - degrees.start + 1) / len(degrees))
        highest = [max(f[0] for f in found[: k + 1]) for k in range(len(found))]
        if growing and len(found) > _PATIENCE and highest[-1] - highest[-1 - _PATIENCE] < 1.0:
            break
    top = max(f[0] for f in found)
    _, degree, start = next(f for f in reversed(found) if f[0] >= top - _DEGREE_MARGIN)
    step = float(_ATTENUATIONS[1] - _ATTENUATIONS[0])
    result = minimize_scalar(
        lambda a: -_profile(sums, free, law, degree, float(a))[0],
        bounds=(max(start - step, float(_ATTENUATIONS[0])), min(start + step, 0.0) + 1e-9),
        method="bounded",
        options={"xatol": 1e-2},
    )
    evidence, log_q, amplitude, noise = _profile(sums, free, law, degree, float(result.x))
    mean, root = _solve(sums, free, law, degree, math.exp(log_q), amplitude, noise)
    if average:
        mean, root = _average(sums, free, law, degree, noise, mean, root)
    return Posterior(degree, math.exp(log_q), amplitude, noise, evidence, mean, root)


def _profile(
    sums: Sums, free: int, law: str, degree: int, log_q: float
) -> tuple[float, float, float, float]:
    """Return evidence, log q, s and sigma, the last two at their best for this q."""
    scores, largest = _scorer(sums, free, law, degree, log_q)
    grid = _RATIOS - (math.log(largest) if largest > 0 else 0.0)
    for _ in range(3):
        values, variances = scores(grid)
        k = int(np.argmin(values))
        best = float(values[k]), float(grid[k]), float(variances[k])
        grid = np.linspace(grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)], 21)
    pivots = np.abs(np.diag(sums.triangle)[:free])
    log_free = float(np.log(np.maximum(pivots, 1e-300)).sum())
    evidence = -0.5 * best[0] - log_free + sums.log_weight
    return evidence, log_q, math.sqrt(math.exp(best[1]) * best[2]), math.sqrt(best[2])


def _scorer(
    sums: Sums, free: int, law: str, degree: int, log_q: float
) -> tuple[Callable[[Array], tuple[Array, Array]], float]:
    """Return -2 log evidence and noise variance as a function of log (s / sigma)^2, and a scale."""
    size = (degree + 1) ** 2
    rows = min(size, len(sums.triangle))
    spread = _deviations(law, degree, math.exp(log_q))[free:]
    rest = sums.rest + float((sums.target[rows:] ** 2).sum())
    target = sums.target[free:rows]
    if len(target):
        u, d, _ = np.linalg.svd(sums.triangle[free:rows, free:size] * spread, full_matrices=False)
        square, along = d**2, (u.T @ target) ** 2
    else:
        square, along = np.zeros(0), np.zeros(0)
    freedom = sums.count - free
    # Accelerations are rounded, and each of the reflections that made the triangle, as many as
    # columns, has rounded every equation once more: eps / sqrt(12) each. No noise is smaller.
    roundings = 1.0 + sums.triangle.shape[1] / 12.0
    floor = roundings * (np.finfo(float).eps * sums.scale) ** 2

    def scores(log_ratio: Array) -> tuple[Array, Array]:
        shrunk = 1.0 + np.exp(log_ratio)[:, None] * square
        energy = rest + (along / shrunk).sum(axis=1)
        variance = np.maximum(energy / freedom, floor)
        value = freedom * np.log(2 * np.pi * variance) + energy / variance
        return value + np.log(shrunk).sum(axis=1), variance

    return scores, float(square.max()) if len(square) else 0.0


def _average(
    sums: Sums,
    free: int,
    law: str,
    degree: int,
    noise: float,
    best_mean: Array,
    best_root: Array,
) -> tuple[Array, Array]:
    """Return mean and root of the covariance averaged over attenuation and amplitude.

    One prior, the most likely, takes an amplitude that the data hardly see for certain: where it
    comes out as nothing, the band would be that of a point mass. Mean and covariance are those
    of the mixture, its weights the evidence times a log-uniform prior.
    """
    found = []
    for log_q in _ATTENUATIONS:
        at_two = math.log(float(_deviations(law, 2, math.exp(log_q))[-1]))
        log_ratios = 2.0 * (_AMPLITUDES - at_two - math.log(noise))
        value, variances = _scorer(sums, free, law, degree, float(log_q))[0](log_ratios)
        found += [
            (-0.5 * float(v), math.exp(log_q), math.exp(0.5 * float(r)) * math.sqrt(var), var)
            for v, r, var in zip(value, log_ratios, variances, strict=True)
        ]
    top = max(f[0] for f in found)
    kept = [f for f in found if f[0] >= top + math.log(_LEAST_WEIGHT)]
    weights = np.exp([f[0] - top for f in kept])
    weights /= weights.sum()
    solved = [_solve(sums, free, law, degree, q, s, math.sqrt(var)) for _, q, s, var in kept]
    if len(solved) == 1:
        return solved[0]
    # About the best one: differences of nearly equal means are exact.
    shifts = np.stack([mean - best_mean for mean, _ in solved], axis=1)
    shift = shifts @ weights
    parts = [math.sqrt(w) * root for w, (_, root) in zip(weights, solved, strict=True)]
    parts.append(np.sqrt(weights) * (shifts - shift[:, None]))
    # The sum of the covariances, without forming it: that would lose half of the digits.
    triangle = scipy.linalg.qr(np.concatenate(parts, axis=1).T, mode="r")[0]
    return best_mean + shift, np.array(np.triu(triangle[: len(best_root)]).T)


def _deviations(law: str, degree: int, q: float) -> Array:
    """Return the prior deviation of each coefficient, but for the amplitude."""
    n = column_degrees(degree).astype(float)
    deviations: Array = q**n * np.sqrt(coefficient_variances(law, n))
    return deviations


def _solve(
    sums: Sums, free: int, law: str, degree: int, q: float, amplitude: float, noise: float
) -> tuple[Array, Array]:
    """Return the posterior mean (p,) and a root of the covariance (p, p)."""
    size = (degree + 1) ** 2
    prior = amplitude * _deviations(law, degree, q)
    # Unit of each unknown: its prior, or what the data alone say of it.
    unit = prior.copy()
    unit[:free] = noise / np.maximum(np.linalg.norm(sums.triangle[:, :free], axis=0), 1e-300)
    penalty = noise * np.eye(size)[free:]
    top = sums.triangle[:size, :size] * unit
    stacked = np.concatenate([top, penalty])
    q_factor, r = scipy.linalg.qr(stacked, mode="economic")
    pivots = np.abs(np.diag(r))
    if not np.isfinite(r).all() or pivots.min() <= 1e-13 * pivots[:free].max(initial=noise):
        raise NumericalError(
            "the samples do not determine mass and centre of mass",
            do="use samples from more than one direction",
        )
    rhs = np.concatenate([sums.target[:size], np.zeros(size - free)])
    mean = unit * scipy.linalg.solve_triangular(r, q_factor.T @ rhs)
    inverse = scipy.linalg.solve_triangular(r, np.eye(size))
    return mean, noise * unit[:, None] * inverse
