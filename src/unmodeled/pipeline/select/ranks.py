"""Mean ranks of several learners and which of them the data tell apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy.stats

__all__ = ["Ranks", "critical_difference", "groups_of", "rank"]


@dataclass(frozen=True)
class Ranks:
    """What a critical-difference diagram shows, [Demsar2006].

    Parameters
    ----------
    mean : Series
        Mean rank of each learner, best (lowest) first.
    critical_difference : float
        Learners whose mean ranks differ by less are not told apart.
    p : float
        Of the Friedman test that all are equal; NaN for two learners.
    groups : tuple of tuple of str
        Largest sets of neighbours that are not told apart.
    """

    mean: pd.Series[float]
    critical_difference: float
    p: float
    groups: tuple[tuple[str, ...], ...]


def rank(blocks: pd.DataFrame, alpha: float = 0.05) -> Ranks:
    """Rank learners on each problem (ties share) and compare mean ranks, Nemenyi's test.

    Parameters
    ----------
    blocks : DataFrame (n, k)
        From `blocks_of`.
    alpha : float
        Level of the test.
    """
    ranks = scipy.stats.rankdata(blocks.to_numpy(), axis=1)
    n, k = ranks.shape
    mean = pd.Series(ranks.mean(axis=0), index=blocks.columns).sort_values(kind="stable")
    p = float("nan")
    if k > 2 and not np.all(ranks == ranks[:, :1]):
        p = float(scipy.stats.friedmanchisquare(*ranks.T).pvalue)
    width = critical_difference(k, n, alpha)
    return Ranks(mean, width, p, groups_of(mean, width))


def critical_difference(k: int, n: int, alpha: float = 0.05) -> float:
    """Return q sqrt(k (k + 1) / 6 n) of [Demsar2006] Eq. 6, k learners on n problems.

    Examples
    --------
    >>> round(critical_difference(4, 14, 0.05), 2)  # the paper's section 3.2.3 prints 1.25
    1.25
    """
    q = scipy.stats.studentized_range.ppf(1 - alpha, k, np.inf) / math.sqrt(2)
    return float(q * math.sqrt(k * (k + 1) / (6 * n)))


def groups_of(mean: pd.Series[float], width: float) -> tuple[tuple[str, ...], ...]:
    """Return the largest sets of neighbours in sorted ranks that span ``width`` at most."""
    values, names = mean.to_numpy(), [str(name) for name in mean.index]
    groups: list[tuple[str, ...]] = []
    last = 0
    for k in range(len(names)):
        end = int(np.searchsorted(values, values[k] + width, side="right"))
        if end - k > 1 and end > last:
            groups.append(tuple(names[k:end]))
            last = end
    return tuple(groups)
