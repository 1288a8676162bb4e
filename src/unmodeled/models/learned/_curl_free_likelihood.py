"""Covariances of the gradient of an RBF potential, and their marginal likelihood.

With d = (x - y) / l, the covariance of a_i(x) and a_j(y) is v (delta_ij - d_i d_j) exp(-d.d / 2): v
l^2 times the RBF kernel, differentiated by x_i and y_j ([Alvarez2012] section 4.2, curl-free
kernel).  Matrices are ordered by component: 3 x 3 blocks of n x n.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import LinAlgError, cho_solve, cholesky
from scipy.linalg.lapack import dpotri

from unmodeled.core.arrays import Array
from unmodeled.models.learned._distances import squared_distances

__all__ = ["CurlFreeLikelihood", "covariance"]


def covariance(x: Array, z: Array, length: float, signal: float) -> Array:
    """Return covariances (3m, 3n) of accelerations at scaled ``x`` (m, 3) and ``z`` (n, 3)."""
    steps = _steps(x, z, length)
    smooth = signal * np.exp(-0.5 * squared_distances(x / length, z / length))
    blocks = [
        [((1.0 if i == j else 0.0) - steps[i] * steps[j]) * smooth for j in range(3)]
        for i in range(3)
    ]
    return np.block(blocks)


def _steps(x: Array, z: Array, length: float) -> list[Array]:
    return [(x[:, None, i] - z[None, :, i]) / length for i in range(3)]


class CurlFreeLikelihood:
    """Negative log marginal likelihood of scaled accelerations, the mean at its most likely value.

    Parameters
    ----------
    x, t : ndarray (n, 3)
        Scaled positions and targets.
    own : ndarray (n, 3)
        Known noise variances of the samples beside the estimated one, scaled.
    """

    def __init__(self, x: Array, t: Array, own: Array) -> None:
        self._x, self._own = x, own.T.ravel()
        self._target = t.T.ravel()
        self._ones = np.kron(np.eye(3), np.ones((len(x), 1)))

    def matrix(self, theta: Array) -> Array:
        """Return the covariance (3n, 3n) of the targets; ``theta``: lengthscale, signal, noise."""
        length, signal, noise = theta
        kernel = covariance(self._x, self._x, length, signal)
        kernel[np.diag_indices_from(kernel)] += noise + self._own
        return kernel

    def condition(self, factor: Array) -> tuple[float, Array, Array]:
        """Return value, mean (3,) and weights (3n,) of a lower factor of the covariance."""
        solved = cho_solve((factor, True), np.column_stack([self._ones, self._target]))
        normal = self._ones.T @ solved[:, :3]
        mean = np.asarray(np.linalg.solve(normal, self._ones.T @ solved[:, 3]), dtype=np.float64)
        weights = solved[:, 3] - solved[:, :3] @ mean
        residual = self._target - self._ones @ mean
        value = 0.5 * float(residual @ weights) + float(np.log(np.diag(factor)).sum())
        return value + 0.5 * len(residual) * math.log(2 * math.pi), mean, weights

    def __call__(self, log_theta: Array) -> tuple[float, Array]:
        """Return the value and its gradient (3,) by logarithms; infinite where it is singular."""
        theta = np.exp(log_theta)
        length, signal, noise = theta
        try:
            factor = cholesky(self.matrix(theta), lower=True)
        except (LinAlgError, ValueError):
            return math.inf, np.zeros(3)
        value, _, weights = self.condition(factor)
        lower, info = dpotri(factor, lower=1)
        if info or not math.isfinite(value):
            return math.inf, np.zeros(3)
        inverse = np.tril(lower) + np.tril(lower, -1).T
        moved = inverse - weights[:, None] * weights  # inverse less weights weights^T
        n = len(self._x)
        steps = _steps(self._x, self._x, length)
        square = steps[0] ** 2 + steps[1] ** 2 + steps[2] ** 2
        smooth = signal * np.exp(-0.5 * square)
        block = moved.reshape(3, n, 3, n)
        plain = block[0, :, 0] + block[1, :, 1] + block[2, :, 2]
        along = sum(block[i, :, j] * (steps[i] * steps[j]) for i in range(3) for j in range(3))
        # d kernel / d log l = (2 d d^T + (I - d d^T) d.d) exp(-d.d / 2)
        by_length = float((smooth * (2 * along + square * (plain - along))).sum())
        by_signal = float((smooth * (plain - along)).sum())
        by_noise = noise * float(np.trace(moved))
        return value, 0.5 * np.array([by_length, by_signal, by_noise])
