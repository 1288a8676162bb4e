"""Squared distances of scaled positions, for the kernels."""

from __future__ import annotations

from unmodeled.core.arrays import Array

__all__ = ["squared_distances"]


def squared_distances(x: Array, z: Array) -> Array:
    """Return squared distances (m, n) of positions ``x`` (m, 3) and ``z`` (n, 3).

    By differences, since |x|^2 - 2 x.z + |z|^2 cancels; one axis at a time, since an array
    (m, n, 3) would be the largest of a fit.
    """
    square = (x[:, None, 0] - z[None, :, 0]) ** 2
    for axis in (1, 2):
        square += (x[:, None, axis] - z[None, :, axis]) ** 2
    return square
