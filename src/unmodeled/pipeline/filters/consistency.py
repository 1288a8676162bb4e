"""Does a filter know how wrong it is? NEES and NIS against their chi-square bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from unmodeled.core.arrays import Array
from unmodeled.core.errors import InputError
from unmodeled.pipeline.filters.run import FilterRun

__all__ = ["Consistency", "consistency", "mean_bounds"]


def mean_bounds(freedom: float, count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the bounds of a mean of ``count`` independent chi-square numbers.

    Examples
    --------
    Averages of 50 runs with 2 degrees of freedom ([BarShalom2001] section 5.4.3, rounded there):

    >>> [round(v, 1) for v in mean_bounds(2, 50)]
    [1.5, 2.6]
    """
    tail = 0.5 * (1.0 - level)
    total = freedom * count
    return float(chi2.ppf(tail, total)) / count, float(chi2.isf(tail, total)) / count


@dataclass(frozen=True)
class Consistency:
    """What the normalised errors of many runs say.

    NEES is averaged over runs at each epoch, never along one run: along time it is correlated.

    Parameters
    ----------
    runs, states : int
    nees : ndarray (k,) or None
        Mean over runs at each epoch; None without a truth.
    nees_bounds : (float, float) or None
        Of the mean over runs at one epoch.
    nees_inside : float or None
        Share of epochs inside; about ``level`` for a consistent filter.
    nees_mean : float or None
        Over epochs and runs.
    nis_mean : float
        Over epochs and runs, divided by the number of components: 1 is consistent.
    nis_bounds : (float, float)
        Of ``nis_mean``: innovations of a consistent filter are white.
    autocorrelation : float
        Largest, over components, of the correlation of normalised innovations one epoch apart.
    autocorrelation_bound : float
        Of the above, two-sided, Bonferroni over components.
    verdict : str
        A sentence.
    """

    runs: int
    states: int
    nees: Array | None
    nees_bounds: tuple[float, float] | None
    nees_inside: float | None
    nees_mean: float | None
    nis_mean: float
    nis_bounds: tuple[float, float]
    autocorrelation: float
    autocorrelation_bound: float
    verdict: str

    @property
    def consistent(self) -> bool:
        """True where NEES is inside its bounds at 90 % of the epochs, or NIS where no truth is."""
        if self.nees_inside is not None:
            return self.nees_inside >= 0.9
        return self.nis_bounds[0] <= self.nis_mean <= self.nis_bounds[1]


def consistency(
    run: FilterRun, states: int | None = None, start: int = 0, level: float = 0.95
) -> Consistency:
    """Judge a filter run.

    Parameters
    ----------
    run : FilterRun
    states : int, optional
        Number of states that the truth covered; default: all of the filter's.
    start : int
        First epoch that counts.
    level : float
        Of the bounds.

    Raises
    ------
    InputError
        If nothing was measured after ``start``.
    """
    b = run.nis.shape[1]
    n = run.mean.shape[2] if states is None else states
    used = run.freedom[start:] > 0
    total = int(run.freedom[start:].sum())
    if total == 0:
        raise InputError("nothing was measured in the span to judge", do="lower start")
    nis_mean = float(run.nis[start:][used].sum()) / total
    low, high = mean_bounds(1.0, total, level)
    correlation, pairs, parts = _autocorrelation(run, start)
    bound = math.sqrt(float(chi2.isf((1.0 - level) / max(parts, 1), 1)) / max(pairs, 1))
    nees = inside = mean = bounds = None
    if run.nees is not None:
        nees = run.nees[start:].mean(axis=1)
        bounds = mean_bounds(float(n), b, level)
        inside = float(((nees >= bounds[0]) & (nees <= bounds[1])).mean())
        mean = float(nees.mean())
    verdict = _sentence(b, n, nis_mean, (low, high), inside, mean, bounds)
    return Consistency(
        b, n, nees, bounds, inside, mean, nis_mean, (low, high), correlation, bound, verdict
    )


def _autocorrelation(run: FilterRun, start: int) -> tuple[float, int, int]:
    """Correlation of innovations one epoch apart, the number of pairs, and of components."""
    v, there = run.innovation[start:], run.accepted[start:]
    both = there[1:] & there[:-1]
    products = np.where(both[..., None], v[1:] * v[:-1], 0.0).sum(axis=(0, 1))
    squares = np.where(there[..., None], v**2, 0.0).sum(axis=(0, 1)) / max(1, int(there.sum()))
    pairs = int(both.sum())
    good = squares > 0.0
    if pairs == 0 or not good.any():
        return 0.0, pairs, int(good.sum())
    correlation = products[good] / pairs / squares[good]
    return float(correlation[np.argmax(np.abs(correlation))]), pairs, int(good.sum())


def _sentence(
    runs: int,
    n: int,
    nis: float,
    nis_bounds: tuple[float, float],
    inside: float | None,
    mean: float | None,
    bounds: tuple[float, float] | None,
) -> str:
    word = "as stated"
    if nis > nis_bounds[1]:
        word = "larger than stated"
    elif nis < nis_bounds[0]:
        word = "smaller than stated"
    text = f"innovations {word} (NIS {nis:.3f} of 1)"
    if inside is None or mean is None or bounds is None:
        return text
    if inside >= 0.9:
        judged = "consistent"
    elif mean > n:
        judged = "overconfident"
    else:
        judged = "too cautious"
    return (
        f"{judged}: NEES {mean:.2f} of {n}, inside [{bounds[0]:.2f}, {bounds[1]:.2f}] "
        f"at {100 * inside:.0f} % of the epochs, {runs} runs; {text}"
    )
