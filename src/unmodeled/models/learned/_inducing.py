"""Where the inducing points of a sparse process go."""

from __future__ import annotations

import numpy as np
from scipy.cluster.vq import kmeans2

from unmodeled.core.arrays import Array
from unmodeled.models.learned._kernels import correlation, scaled_squares

__all__ = ["greedy_points", "kmeans_points"]

#: Share of the signal variance below which no sample is worth a point.
_ENOUGH = 1e-9


def greedy_points(x: Array, count: int, kernel: str, length: Array) -> Array:
    """Return the samples (m, d), each the least known given those before; m <= ``count``.

    Pivoted Cholesky of the kernel matrix ([Burt2020] section 4.3): n m^2 operations, no seed.

    Parameters
    ----------
    x : ndarray (n, d)
        Scaled inputs.
    count : int
        Points wanted; fewer where the rest is known to 1e-9 of the signal variance.
    kernel : str
        Of `_kernels.KERNELS`.
    length : ndarray (1,) or (d,)
        Lengthscales.
    """
    if count >= len(x):
        return x.copy()
    rows = np.empty((count, len(x)))
    variance = np.ones(len(x))
    chosen: list[int] = []
    for k in range(count):
        pivot = int(np.argmax(variance))
        if variance[pivot] < _ENOUGH:
            break
        row = correlation(kernel, scaled_squares(x[pivot : pivot + 1], x, length))[0]
        row -= rows[:k, pivot] @ rows[:k]
        rows[k] = row / np.sqrt(variance[pivot])
        variance = variance - rows[k] ** 2
        variance[pivot] = 0.0
        chosen.append(pivot)
    return x[chosen]


def kmeans_points(x: Array, count: int, seed: int) -> Array:
    """Return the means (m, d) of clusters of scaled inputs ``x``; m <= ``count``."""
    if count >= len(x):
        return x.copy()
    generator = np.random.default_rng(seed)
    means, labels = kmeans2(x, count, iter=15, minit="++", rng=generator)
    return np.ascontiguousarray(means[np.unique(labels)])
