"""Weights of a basis learned by least squares: at once, one by one, with their covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import LinAlgError, cho_solve, cholesky, solve_triangular

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.pipeline.filters.basis import Basis

__all__ = ["LinearAcceleration", "RecursiveWeights", "pseudo_inverse_weights"]


@dataclass(frozen=True)
class LinearAcceleration:
    """A basis with weights that are known: a `LearnedAcceleration`.

    Parameters
    ----------
    basis : Basis
    mean : ndarray (p,)
    root : ndarray (p, p), optional
        The covariance of the weights is root @ root.T.
    """

    basis: Basis
    mean: Array
    root: Array | None = None

    def evaluate(self, x: Array, t: float) -> tuple[Array, Array, Array | None]:
        """Return acceleration (b, 3), Jacobian (b, 3, n) and covariance (b, 3, 3) or None."""
        B = self.basis.evaluate(x, t)
        J = self.basis.slope(x, t, np.broadcast_to(self.mean, (len(x), len(self.mean))))
        if self.root is None:
            return B @ self.mean, J, None
        half = B @ self.root
        return B @ self.mean, J, half @ half.mT


def pseudo_inverse_weights(
    basis: Basis, x: Array, a: Array, rcond: float = 1e-10
) -> LinearAcceleration:
    """Fit weights to sampled accelerations by the pseudo-inverse [Marchese2023] Eq. 2.38.

    Parameters
    ----------
    basis : Basis
    x : ndarray (k, n)
        States.
    a : ndarray (k, 3)
        Accelerations there, m/s2.
    rcond : float
        Singular values below this share of the largest are cut.
    """
    if len(x) != len(a):
        raise DataError(f"{len(x)} states and {len(a)} accelerations", allowed="one for each")
    B = basis.evaluate(x, 0.0)
    weights = np.linalg.lstsq(B.reshape(-1, basis.size), a.ravel(), rcond=rcond)[0]
    return LinearAcceleration(basis, np.asarray(weights))


@dataclass(frozen=True)
class RecursiveWeights:
    """Recursive least squares in information form: adding samples is adding matrices.

    The posterior after any order of samples is that of a finite-rank Gaussian process with the
    same prior (`HarmonicGP` under one of its priors, with the harmonic basis). Immutable: `add`
    returns a new one.

    Parameters
    ----------
    basis : Basis
    information : ndarray (p, p)
        Inverse covariance of the weights.
    vector : ndarray (p,)
        Information times mean.
    """

    basis: Basis
    information: Array
    vector: Array

    @classmethod
    def of_prior(cls, basis: Basis, sigma: npt.ArrayLike) -> RecursiveWeights:
        """Start from independent weights of zero mean; infinite ``sigma`` for a flat prior."""
        s = np.broadcast_to(np.asarray(sigma, dtype=np.float64), (basis.size,))
        if not (s > 0.0).all():
            raise ConfigError(f"sigma of a weight is {s.min()}", allowed="> 0")
        return cls(basis, np.diag(s**-2.0), np.zeros(basis.size))

    def add(self, x: Array, a: Array, covariance: Array, thinning: float = 1.0) -> RecursiveWeights:
        """Return the weights after more samples.

        Parameters
        ----------
        x : ndarray (k, n)
            States.
        a : ndarray (k, 3)
            Accelerations there, e.g. of a filter's Gauss-Markov states, m/s2.
        covariance : ndarray (k, 3, 3) or (3, 3)
            Of their errors.
        thinning : float
            Samples per independent one: labels of a filter are correlated over about twice the
            time constant, and counting each as new would make the weights too sure.
        """
        a = as_array(a, ("k", 3), "a")
        if thinning < 1.0:
            raise ConfigError(f"thinning is {thinning}", allowed=">= 1")
        B = self.basis.evaluate(x, 0.0)
        C = np.broadcast_to(covariance, (len(a), 3, 3)) * thinning
        try:
            L = np.linalg.cholesky(C)
        except np.linalg.LinAlgError as exc:
            raise DataError(
                "the covariance of a sample is not positive definite", allowed="variances > 0"
            ) from exc
        rows = np.linalg.solve(L, np.concatenate([B, a[:, :, None]], axis=2))
        rows = rows.reshape(-1, self.basis.size + 1)
        design, target = rows[:, :-1], rows[:, -1]
        return RecursiveWeights(
            self.basis, self.information + design.T @ design, self.vector + design.T @ target
        )

    def forget(self, factor: float) -> RecursiveWeights:
        """Return the weights with all that was learned, and the prior, counting ``factor``."""
        if not 0.0 < factor <= 1.0:
            raise ConfigError(f"factor is {factor}", allowed="0 < factor <= 1")
        return RecursiveWeights(self.basis, factor * self.information, factor * self.vector)

    def solve(self) -> LinearAcceleration:
        """Return the acceleration with the posterior mean and covariance of its weights.

        Raises
        ------
        NumericalError
            If samples and prior leave a weight undetermined.
        """
        # equilibrated: coefficients of high degree are known to much less than the mass
        diagonal = np.diag(self.information)
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        unit = self.information * scale * scale[:, None]
        try:
            L = cholesky(unit, lower=True)
        except LinAlgError as exc:
            raise NumericalError(
                f"{self.basis.size} weights are not determined by the samples",
                do="add samples, or give the weights a prior",
            ) from exc
        mean = scale * np.asarray(cho_solve((L, True), scale * self.vector))
        root = solve_triangular(L, np.eye(len(L)), lower=True).T
        return LinearAcceleration(self.basis, mean, scale[:, None] * root)
