"""Squared distances of scaled inputs, for the kernels."""

from __future__ import annotations

from unmodeled.core.arrays import Array

__all__ = ["squared_distances"]


def squared_distances(x: Array, z: Array) -> Array:
    """Return squared distances (m, n) of inputs ``x`` (m, d) and ``z`` (n, d).

    By differences, since |x|^2 - 2 x.z + |z|^2 cancels; one axis at a time, since an array
    (m, n, d) would be the largest of a fit.
    """
    square = (x[:, None, 0] - z[None, :, 0]) ** 2
    for axis in range(1, x.shape[1]):
        square += (x[:, None, axis] - z[None, :, axis]) ** 2
    return square
