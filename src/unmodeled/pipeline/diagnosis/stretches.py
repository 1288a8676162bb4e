"""How sure a finding is if only whole stretches of the residuals are independent."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore

__all__ = ["DOUBTFUL", "strength_by_stretches", "stretches"]

#: Findings of fewer sigmas than this, counted by stretches, are doubtful.
DOUBTFUL = 4.0
_STRETCHES = 24


def strength_by_stretches(pool: Pool, chosen: SetScore, member: int) -> float:
    """Return the significance of a member in sigmas when residuals are coloured.

    The scatter of the stretches' contributions takes the place of the noise (the sandwich of
    [LiangZeger1986] with stretches as clusters): coloured residuals are counted for what they are.
    The stated noise is a floor: where residuals are smaller and not white, whoever stated it has
    allowed for slow errors of that size, which no statistics of the residuals can exclude.

    Parameters
    ----------
    pool : Pool
        About the final fit.
    chosen : SetScore
        The answer.
    member : int
        One of its members.
    """
    residual = pool.left(chosen)
    rest = [k for k in chosen.members if k != member]
    G, _ = pool.beside(rest)
    own = pool.members[member].columns
    B = pool.columns[:, own]
    if rest:
        A = pool.columns[:, np.concatenate([pool.members[k].columns for k in rest])]
        B = B - A @ (np.linalg.pinv(A.T @ A, rcond=1e-10, hermitian=True) @ (A.T @ B))
    first = [int(i) for k in chosen.members for i in pool.members[k].columns].index(int(own[0]))
    signal = G[np.ix_(own, own)] @ chosen.estimate[first : first + len(own)]
    parts = np.array([B[rows].T @ residual[rows] for rows in stretches(pool, _STRETCHES)])
    scatter = parts.T @ parts * len(parts) / max(len(parts) - 1, 1)
    square = signal @ np.linalg.pinv(scatter, hermitian=True) @ signal
    return float(np.sqrt(square / len(own))) * min(chosen.noise, 1.0)


def stretches(pool: Pool, count: int) -> list[Array]:
    """Return the rows of equal parts of the measurements, in their order."""
    return list(np.array_split(np.arange(pool.lin.measured), count))
