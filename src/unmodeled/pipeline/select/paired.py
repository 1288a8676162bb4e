"""Paired comparisons of learners over the same problems."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.core.seeds import Streams

__all__ = ["compare_pairs", "holm", "medians"]

_RESAMPLES = 2000


def compare_pairs(blocks: pd.DataFrame) -> pd.DataFrame:
    """Return one row a pair of learners: how much better, how often, how sure.

    The Wilcoxon signed-rank test [Wilcoxon1945] of log10 errors, two-sided: errors span
    decades, and a factor of two counts the same at 1e-5 and at 1e-1. P values are adjusted for
    all pairs together [Holm1979].

    Parameters
    ----------
    blocks : DataFrame (n, k)
        From `blocks_of`.

    Returns
    -------
    DataFrame
        ``better``, ``worse`` (by median ratio), ``problems``, ``ratio`` (median of
        worse / better; infinite if failures reach it), ``share`` (of the problems on which
        ``better`` is better), ``effect`` (matched-pairs rank-biserial correlation, -1 to 1),
        ``p``, ``p_holm``.
    """
    rows = []
    for a, b in itertools.combinations(blocks.columns, 2):
        difference = _log_ratio(blocks[a].to_numpy(), blocks[b].to_numpy())
        if np.median(difference) < 0:
            a, b, difference = b, a, -difference
        effect, p = _signed_rank(difference)
        with np.errstate(over="ignore"):
            ratio = float(10.0 ** np.median(difference))
        share = float(np.mean(difference > 0))
        rows.append((a, b, len(difference), ratio, share, effect, p))
    names = ["better", "worse", "problems", "ratio", "share", "effect", "p"]
    table = pd.DataFrame(rows, columns=names)
    return table.assign(p_holm=holm(table["p"].to_numpy()))


def holm(p: Array) -> Array:
    """Return P values adjusted for many tests, [Holm1979].

    Examples
    --------
    >>> holm(np.array([0.01, 0.02, 0.03, 0.04, 0.05])).round(3).tolist()
    [0.05, 0.08, 0.09, 0.09, 0.09]
    """
    order = np.argsort(p)
    steps = np.maximum.accumulate(p[order] * (len(p) - np.arange(len(p))))
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(steps, 1.0)
    return adjusted


def medians(blocks: pd.DataFrame, seed: int = 1, level: float = 0.95) -> pd.DataFrame:
    """Return the median error of each learner with a bootstrap interval over problems.

    Percentile intervals; all learners are resampled with the same problems.

    Parameters
    ----------
    blocks : DataFrame (n, k)
        From `blocks_of`.
    seed : int
        Of the resampling.
    level : float
        Coverage of the interval, in (0, 1).
    """
    if not 0 < level < 1:
        raise ConfigError(f"level is {level}", allowed="more than 0, less than 1")
    errors = blocks.to_numpy()
    draws = (
        Streams(seed).generator("bootstrap").integers(len(errors), size=(_RESAMPLES, len(errors)))
    )
    # "lower" takes a value that is there: no inf - inf between a failure and a failure.
    resampled = np.quantile(errors[draws], 0.5, axis=1, method="lower")
    low, high = np.quantile(resampled, [(1 - level) / 2, (1 + level) / 2], axis=0, method="nearest")
    return pd.DataFrame(
        {
            "learner": list(blocks.columns),
            "problems": len(errors),
            "failures": np.sum(~np.isfinite(errors), axis=0),
            "median": np.quantile(errors, 0.5, axis=0, method="lower"),
            "low": low,
            "high": high,
        }
    )


def _log_ratio(a: Array, b: Array) -> Array:
    """log10(b / a): positive where a is better; failures of both are a draw."""
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = np.log10(b) - np.log10(a)
    return np.where(np.isnan(difference), 0.0, difference)


def _signed_rank(difference: Array) -> tuple[float, float]:
    """Return the matched-pairs rank-biserial correlation and the two-sided P value."""
    kept = difference[difference != 0]
    if len(kept) == 0:
        return 0.0, 1.0
    ranks = scipy.stats.rankdata(np.abs(kept))
    # Signed ranks stand for the differences: infinite ones are the largest, no more.
    signed = np.sign(kept) * ranks
    p = float(scipy.stats.wilcoxon(signed).pvalue)
    return float(signed.sum() / ranks.sum()), p
