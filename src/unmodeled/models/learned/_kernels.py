"""Radial kernels as functions of s, the squared distance per squared lengthscale.

RBF and Matern of smoothness 1/2, 3/2 and 5/2, [Rasmussen2006] Eqs. 4.9 and 4.17, written for numpy
and torch alike: both have powers, and the exponential is handed over.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.models.learned._distances import squared_distances

__all__ = [
    "KERNELS",
    "bend",
    "check_kernel",
    "correlation",
    "covariances",
    "gradient",
    "scaled_squares",
    "slopes",
    "steepness",
]

KERNELS = ("rbf", "matern12", "matern32", "matern52")

_3, _5 = math.sqrt(3.0), math.sqrt(5.0)

#: Exponential of an array, of numpy or torch.
_Exp = Callable[[Any], Any]


def check_kernel(learner: str, kernel: str) -> None:
    """Raise ``ConfigError`` for a kernel that is not in ``KERNELS``."""
    if kernel not in KERNELS:
        raise ConfigError(f'{learner}: kernel is "{kernel}"', allowed=", ".join(KERNELS))


def correlation(kernel: str, s: Any, exp: _Exp = np.exp) -> Any:
    """Return k(s), 1 at no distance."""
    if kernel == "rbf":
        return exp(-0.5 * s)
    r = s**0.5
    if kernel == "matern12":
        return exp(-r)
    if kernel == "matern32":
        return (1.0 + _3 * r) * exp(-_3 * r)
    return (1.0 + _5 * r + (5.0 / 3.0) * s) * exp(-_5 * r)


def steepness(kernel: str, s: Any, exp: _Exp = np.exp) -> Any:
    """Return h = -2 dk/ds: dk/dx_j is -h (x - z)_j / l_j^2, dk/d log l_j is h (x - z)_j^2 / l_j^2.

    That of ``matern12`` has a pole at no distance, where both derivatives are taken as zero.
    """
    if kernel == "rbf":
        return exp(-0.5 * s)
    r = s**0.5
    if kernel == "matern12":
        return exp(-r) / (r + 1e-300)
    if kernel == "matern32":
        return 3.0 * exp(-_3 * r)
    return (5.0 / 3.0) * (1.0 + _5 * r) * exp(-_5 * r)


def bend(kernel: str, s: Any) -> Any:
    """Return b with d(h s)/d log l = (h s) (b - 2), for one lengthscale on all axes."""
    if kernel == "rbf":
        return s
    r = s**0.5
    if kernel == "matern12":
        return 1.0 + r
    if kernel == "matern32":
        return _3 * r
    return 5.0 * s / (1.0 + _5 * r)


def scaled_squares(x: Array, z: Array, length: Array) -> Array:
    """Return s (m, n) of scaled inputs ``x`` (m, d), ``z`` (n, d); ``length`` (1,) or (d,)."""
    if len(length) == 1:
        scaled: Array = (1.0 / length[0] ** 2) * squared_distances(x, z)
        return scaled
    return squared_distances(x / length, z / length)


def covariances(kernel: str, x: Array, z: Array, length: Array, signal: float) -> Array:
    """Return signal variances times k (m, n); arguments as in `slopes`."""
    covariance: Array = signal * correlation(kernel, scaled_squares(x, z, length))
    return covariance


def slopes(kernel: str, x: Array, z: Array, length: Array, weights: Array) -> Array:
    """Return the gradient (m, d) by ``x`` of the sum over z of ``weights`` k(x, z).

    Parameters
    ----------
    kernel : str
        Of ``KERNELS``.
    x, z : ndarray (m, d), (n, d)
        Scaled inputs.
    length : ndarray (1,) or (d,)
        One lengthscale, or one for each input.
    weights : ndarray (n,)
        Signal variance included.
    """
    return gradient(steepness(kernel, scaled_squares(x, z, length)) * weights, x, z, length)


def gradient(steep: Array, x: Array, z: Array, length: Array) -> Array:
    """Return `slopes` (m, d) from `steepness` times weights (m, n), where it is at hand."""
    # Sums along the last axis, not BLAS, so that a row does not depend on its batch.
    columns = [(steep * (x[:, None, j] - z[None, :, j])).sum(axis=-1) for j in range(x.shape[1])]
    by_input: Array = -np.stack(columns, axis=-1) / length**2
    return by_input
