"""Marginal likelihood of accelerations under a closed harmonic kernel, low degrees flat.

Rows are ordered by component: 3 x 3 blocks of n x n. Mass and centre of mass (degrees 0 and 1, four
columns of the design) have a flat prior and are integrated out: [Rasmussen2006] Eq. 2.45 with B^-1
to zero, the restricted likelihood.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import LinAlgError, cho_solve, cholesky, solve_triangular
from scipy.linalg.lapack import dpotri

from unmodeled.core.arrays import Array
from unmodeled.models.learned._harmonic_kernels import acceleration_covariance
from unmodeled.models.physics.exterior_harmonics import derivative, exterior_harmonics

__all__ = ["HarmonicKernelLikelihood", "low_design"]

#: Derivatives of the harmonics of degrees 0 and 1.
_LOW = 1


def low_design(X: Array, order: int) -> Array:
    """Return potential, acceleration or gradient (3^order rows of (n, 4)) of degrees 0 and 1."""
    tables = [exterior_harmonics(X, _LOW + order)]
    for _ in range(order):
        tables = [derivative(t, i) for t in tables for i in range(3)]
    return np.stack([t.T for t in tables])


class HarmonicKernelLikelihood:
    """Negative log restricted likelihood and its closed-form gradient.

    Parameters
    ----------
    law : str
        Of `_harmonic_kernels.LAWS`.
    x, t : ndarray (n, 3)
        Positions in reference radii, accelerations in their unit.
    own : ndarray (n, 3)
        Known noise variances of the samples beside the estimated one.
    """

    def __init__(self, law: str, x: Array, t: Array, own: Array) -> None:
        self._law, self._x, self._own = law, x, own.T.ravel()
        self._target = t.T.ravel()
        self.low = low_design(x, 1).reshape(-1, 4)

    def matrix(self, theta: Array) -> Array:
        """Return the covariance (3n, 3n) of the data for q^2, s^2 and noise variance."""
        c, signal, noise = theta
        kernel: Array = acceleration_covariance(self._law, self._x, self._x, c)
        matrix: Array = (signal / c) * kernel
        matrix[np.diag_indices_from(matrix)] += noise + self._own
        return matrix

    def condition(self, factor: Array) -> tuple[float, Array, Array]:
        """Return the negative log likelihood, the low coefficients (4,) and the weights (3n,)."""
        white = solve_triangular(factor, np.column_stack([self.low, self._target]), lower=True)
        low, target = white[:, :4], white[:, 4]
        # A triangular root, not the normal equations: half of the digits of clean data.
        q, r = np.linalg.qr(low)
        coefficients = solve_triangular(r, q.T @ target)
        rest = target - low @ coefficients
        value = 0.5 * float(rest @ rest) + float(np.log(np.diag(factor)).sum())
        value += float(np.log(np.abs(np.diag(r))).sum())
        value += 0.5 * (len(target) - 4) * math.log(2.0 * math.pi)
        return value, coefficients, solve_triangular(factor, rest, lower=True, trans=1)

    def __call__(self, log_theta: Array) -> tuple[float, Array]:
        """Return value and gradient by the logs of q^2, s^2 and noise; infinite if singular."""
        theta = np.exp(log_theta)
        c, signal, noise = theta
        kernel, slope = acceleration_covariance(self._law, self._x, self._x, c, slope=True)
        matrix = (signal / c) * kernel
        matrix[np.diag_indices_from(matrix)] += noise + self._own
        try:
            factor = cholesky(matrix, lower=True)
        except (LinAlgError, ValueError):  # ValueError: not finite
            return np.inf, np.zeros(3)
        value, _, weights = self.condition(factor)
        inverse = dpotri(factor, lower=True)[0]
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        solved = cho_solve((factor, True), self.low)
        _, r = np.linalg.qr(solve_triangular(factor, self.low, lower=True))
        half = solve_triangular(r, solved.T, trans=1)
        inverse -= half.T @ half
        inverse -= np.outer(weights, weights)
        by_signal = (signal / c) * float((inverse * kernel).sum())
        by_c = (signal / c) * float((inverse * slope).sum()) - by_signal
        return value, 0.5 * np.array([by_c, by_signal, noise * float(np.trace(inverse))])
