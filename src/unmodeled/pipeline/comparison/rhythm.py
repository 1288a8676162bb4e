"""Do the residuals repeat? Lomb-Scargle over all series together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.stats
from astropy.timeseries import LombScargle

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.residual_table import directions
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["Rhythm", "rhythm"]

_OVERSAMPLING = 5
#: No period is looked for that is shorter than this many median steps.
_SHORTEST = 2.5
#: Most frequencies; a longer series is searched up to a lower one.
_MOST = 20_000


@dataclass(frozen=True)
class Rhythm:
    """The strongest period in the residuals.

    Parameters
    ----------
    period : float
        s.
    share : float
        Part of the sum of squares that a sine of this period in each component explains.
    p : float
        Probability of as strong a period anywhere by chance, in white noise.
    span : float
        Length of the longest arc, s: what is as slow may be a drift.
    """

    period: float
    share: float
    p: float
    span: float


def rhythm(lin: Linearisation) -> Rhythm:
    """Return the strongest period of the residuals in their components, see `directions`.

    Parameters
    ----------
    lin : Linearisation
        At the fit.

    Notes
    -----
    Each component of each arc is a series of its own; the powers add. In units of half the drop
    of chi-square the sum of m series is Gamma(m) for white noise of unit variance
    ([VanderPlas2018] section 7). Trials are counted as two an independent frequency: the peak
    lies between them.
    """
    rows = lin.rows()
    times: Array = rows["t_s"].to_numpy(dtype=np.float64)
    arcs = rows["arc"].to_numpy()
    scale = np.sqrt(float(lin.residuals @ lin.residuals) / lin.freedom)
    span = max(float(np.ptp(a.partials.times)) for a in lin.arcs)
    series = []
    for d in directions(lin):
        w = d.weights[: len(times)]
        for arc in dict.fromkeys(arcs):
            at = np.flatnonzero((w != 0) & (arcs == arc))
            if len(at):
                t, group = np.unique(times[at], return_inverse=True)
                sums = np.bincount(group, w[at] * lin.residuals[at] / scale)
                values = np.asarray(sums, dtype=np.float64)
                if len(t) > 8:
                    series.append((t, values))
    if not series or span <= 0:
        return Rhythm(np.nan, 0.0, 1.0, span)
    step = float(np.median(np.concatenate([np.diff(t) for t, _ in series])))
    lowest, highest = 1.0 / span, 1.0 / (_SHORTEST * step)
    width = 1.0 / (_OVERSAMPLING * span)
    count = int(np.clip((highest - lowest) / width, 1, _MOST))
    frequency = np.asarray(lowest + width * np.arange(count), dtype=np.float64)
    total = np.zeros(count)
    for t, values in series:
        total += _power(t - t[0], values, frequency)
    best = int(np.argmax(total))
    trials = max(2.0 * span * (frequency[-1] - frequency[0]), 1.0)
    p = float(-np.expm1(trials * scipy.stats.gamma.logcdf(total[best], len(series))))
    square = sum(float(v @ v) for _, v in series)
    return Rhythm(
        float(1.0 / frequency[best]), float(min(2.0 * total[best] / square, 1.0)), p, span
    )


def _power(t: Array, values: Array, frequency: Array) -> Array:
    """Half the drop of chi-square by a sine at each frequency."""
    search = LombScargle(t, values, 1.0, fit_mean=False, center_data=False)
    power: Array = search.power(frequency, normalization="psd", assume_regular_frequency=True)
    return np.maximum(power, 0.0)
