"""How small a p-value must be: by simulating noise through all candidates at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.optimize
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.pipeline.diagnosis.pool import Pool, log_p

__all__ = ["chi_square_threshold", "needed_noncentrality", "smallest_p_threshold"]

_DRAWS = 20_000
_CHUNK = 2_000


def smallest_p_threshold(
    pool: Pool, chosen: Sequence[int], false_alarm: float, generator: np.random.Generator
) -> float:
    """Return ln p such that noise alone makes the smallest p fall below it with ``false_alarm``.

    Candidates overlap, so their number overstates how many chances noise has; candidates that are
    searched over places have many chances. Both are accounted for by drawing noise, projecting it
    on all of them together and taking the smallest p-value of each draw (max-T; [Westfall1993]).

    Parameters
    ----------
    pool : Pool
        All candidates at all places.
    chosen : sequence of int
        Members that are in the model: projected out.
    false_alarm : float
        Family-wise probability.
    generator : Generator
        For the draws.
    """
    G, _ = pool.beside(chosen)
    scale = np.sqrt(np.maximum(np.diag(pool.gram), 1e-300))
    normal = G / scale[:, None] / scale
    size, axes = np.linalg.eigh(normal)
    kept = size > 1e-10 * max(size.max(initial=0.0), 1e-300)
    if not kept.any():
        return -np.inf
    root = axes[:, kept] * np.sqrt(size[kept])
    rank = int(kept.sum())
    spans = [_span(root[m.columns]) for m in pool.members]
    sizes = np.array([max(s.shape[1], 1) for s in spans])
    used = [k for k, s in enumerate(spans) if s.shape[1]]
    freedom = pool.freedom - sum(pool.members[k].size for k in chosen)
    smallest = []
    for _ in range(0, _DRAWS, _CHUNK):
        z = generator.standard_normal((_CHUNK, rank))
        rest = generator.chisquare(max(freedom - rank, 1), _CHUNK)
        square = np.sum(z * z, axis=1) + rest
        best = np.zeros(_CHUNK)
        for count in np.unique(sizes[used]):
            group = [k for k in used if sizes[k] == count]
            basis = np.concatenate([spans[k] for k in group], axis=1)
            drops = np.sum((z @ basis).reshape(_CHUNK, len(group), count) ** 2, axis=2).max(axis=1)
            share = _log_p_of_share(drops / square, int(count), freedom)
            best = np.minimum(best, share)
        smallest.append(best)
    return float(np.quantile(np.concatenate(smallest), false_alarm))


def chi_square_threshold(log_p_limit: float, size: int) -> float:
    """Return the fall of chi-square that k parameters need at this p-value (known noise)."""
    return float(scipy.stats.chi2.isf(np.exp(log_p_limit), size))


def needed_noncentrality(log_p_limit: float, size: int, power: float = 0.9) -> float:
    """Return the non-centrality with which an effect of k parameters passes with ``power``."""
    limit = chi_square_threshold(log_p_limit, size)
    return float(
        scipy.optimize.brentq(lambda x: scipy.stats.ncx2.sf(limit, size, x) - power, 1e-6, 1e4)
    )


def _span(rows: Array) -> Array:
    """Orthonormal basis (rank, k) of the span of a member's columns; (rank, 0) if they are null."""
    u, s, _ = np.linalg.svd(rows.T, full_matrices=False)
    return u[:, s > 1e-4]


def _log_p_of_share(share: Array, size: int, freedom: int) -> Array:
    value: Array = log_p(share, np.full(share.shape, size), 1.0, freedom)
    return value
