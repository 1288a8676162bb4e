"""The measurement update: pure functions of arrays, with gaps and a gate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from unmodeled.core.arrays import Array
from unmodeled.pipeline.filters.algebra import inverse_root, joseph, times
from unmodeled.pipeline.filters.state import Booleans

__all__ = [
    "Correction",
    "accept",
    "correct",
    "correct_one_by_one",
    "gate_threshold",
    "mask_rows",
]


@dataclass(frozen=True, slots=True)
class Correction:
    """What one measurement does to mean and covariance; see `Updated` for the shapes."""

    mean: Array
    covariance: Array
    gain: Array
    innovation_covariance: Array
    nis: Array
    freedom: npt.NDArray[np.intp]
    accepted: Booleans


@lru_cache(maxsize=64)
def gate_threshold(probability: float, freedom: int) -> float:
    """Return the NIS that a good measurement exceeds with ``probability``; infinite for 0 rows."""
    return float(chi2.isf(probability, freedom)) if freedom else float("inf")


def mask_rows(H: Array, R: Array, innovation: Array, used: Booleans) -> tuple[Array, Array, Array]:
    """Take components out of a measurement, exactly.

    Parameters
    ----------
    H : ndarray (b or 1, m, n)
    R : ndarray (m, m)
    innovation : ndarray (b, m)
    used : ndarray (b or 1, m) of bool

    Returns
    -------
    H, R, innovation
        With zero rows, a unit variance of its own, and zero innovation where ``used`` is False:
        the gain of such a component is zero and the others are as if it did not exist.
    """
    if used.all():
        return H, R[None], innovation
    rows = used[..., :, None]
    both = rows & used[..., None, :]
    R_used = np.where(both, R, 0.0) + np.where(rows, 0.0, 1.0) * np.eye(R.shape[-1])
    return np.where(rows, H, 0.0), R_used, np.where(used, innovation, 0.0)


def accept(
    nis: Array, used: Booleans, shape: tuple[int, ...], gate: float | None
) -> tuple[npt.NDArray[np.intp], Booleans]:
    """Return how many components each run used (b,), and whether its measurement counts (b,).

    Parameters
    ----------
    nis : ndarray (b,)
    used : ndarray (b or 1, m) of bool
    shape : (b, m)
    gate : float, optional
        As in `correct`.
    """
    if used.all():
        freedom = np.full(shape[0], shape[1], dtype=np.intp)
    else:
        freedom = np.broadcast_to(used, shape).sum(axis=-1)
    accepted: Booleans = freedom > 0
    if gate is not None:
        # accepted where it cannot be rejected: NaN never passes
        limits = np.array([gate_threshold(gate, k) for k in range(shape[1] + 1)])
        accepted = accepted & (nis <= limits[freedom])
    return freedom, accepted


def correct(
    mean: Array,
    P: Array,
    innovation: Array,
    H: Array,
    R: Array,
    used: Booleans,
    gate: float | None = None,
) -> Correction:
    """Correct estimates by measurements, Joseph form.

    Parameters
    ----------
    mean : ndarray (b, n)
    P : ndarray (b or 1, n, n)
    innovation : ndarray (b, m)
        Measured minus expected; its value does not matter where ``used`` is False.
    H : ndarray (b or 1, m, n)
    R : ndarray (m, m)
    used : ndarray (b or 1, m) of bool
        Components that were measured.
    gate : float, optional
        Reject a measurement whose NIS a good one would exceed with less than this probability.
    """
    H, R, innovation = mask_rows(H, R, innovation, used)
    HP = H @ P
    S = HP @ np.ascontiguousarray(H.mT) + R
    # The inverse of the triangular factor, m x m: as stable as a substitution for each column
    # (its errors are those of L, not of S), and a third of the time for many runs.
    inverse = inverse_root(S, "the innovation covariance")
    whitened = inverse @ HP
    half = times(inverse, innovation)
    nis = np.einsum("bi,bi->b", half, half)
    freedom, accepted = accept(nis, used, innovation.shape, gate)
    K = np.ascontiguousarray(whitened.mT) @ inverse
    if not accepted.all() and (accepted.any() or len(K) > 1):
        K = np.where(accepted[:, None, None], K, 0.0)
    elif not accepted.any():
        K = np.zeros_like(K)
    # a zero gain leaves P as it is, to the last bit but for its symmetry
    covariance = joseph(P, K, H, R)
    return Correction(mean + times(K, innovation), covariance, K, S, nis, freedom, accepted)


def correct_one_by_one(
    mean: Array, P: Array, z: Array, H: Array, variances: Array
) -> tuple[Array, Array]:
    """Use the components of a linear measurement one after another: no matrix is factorised.

    Parameters
    ----------
    mean : ndarray (b, n)
    P : ndarray (b or 1, n, n)
    z : ndarray (b, m)
        Measured, of expectation H x.
    H : ndarray (b or 1, m, n)
    variances : ndarray (m,)
        Of independent components.

    Returns
    -------
    mean (b, n), covariance (b or 1, n, n)
        Equal to those of `correct` but for rounding.
    """
    for i, variance in enumerate(variances):
        row = H[:, i : i + 1, :]
        PHt = P @ row.mT
        K = PHt / (row @ PHt + variance)
        mean = mean + K[..., 0] * (z[:, i : i + 1] - times(row, mean))
        P = joseph(P, K, row, np.array([[variance]]))
    return mean, P
