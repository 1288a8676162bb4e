"""A gravity field whose coefficients are known with a covariance: what it says anywhere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.physics.exterior_harmonics import derivative, exterior_harmonics

__all__ = ["CHUNK", "ROUNDING", "UncertainField"]

#: Samples whose harmonics are in memory at once: 2048 x 3 x (degree + 1)^2 x 8 bytes.
CHUNK = 2048
#: Variance of the rounding of a predicted component, as a share of |a|^2: x / R, three squares and
#: their sum, their root, two quotients, the recursion to degree 1, its factor, that of the
#: derivative, the coefficient, the sum and GM / R^2 are twelve, of eps^2 / 12 each (uniform).
ROUNDING = 12.0 * np.finfo(float).eps ** 2 / 12.0


@dataclass(frozen=True)
class UncertainField:
    """Exterior harmonics with Gaussian coefficients, in one set of units.

    Parameters
    ----------
    degree : int
    gm, radius : float
        Reference values that scale the coefficients.
    mean : ndarray (p,)
        Fully normalised coefficients, in the order of `exterior_harmonics.column`.
    root : ndarray (p, k)
        Their covariance is ``root @ root.T``.
    """

    degree: int
    gm: float
    radius: float
    mean: Array
    root: Array

    def potential(self, X: Array) -> Array:
        """Return the potential (n,) at ``X`` (n, 3); acceleration is its gradient."""
        scale = self.gm / self.radius
        return scale * np.concatenate([self.mean @ t for t in self._tables(X, 0)])

    def acceleration(self, X: Array) -> Array:
        """Return the acceleration (n, 3)."""
        scale = self.gm / self.radius**2
        return scale * np.concatenate(
            [
                np.stack([self.mean @ derivative(t, i) for i in range(3)], axis=1)
                for t in self._tables(X, 1)
            ]
        )

    def gradient(self, X: Array) -> Array:
        """Return the gravity gradient (n, 3, 3)."""
        scale = self.gm / self.radius**3
        blocks = []
        for table in self._tables(X, 2):
            first = [derivative(table, i) for i in range(3)]
            rows = [
                np.stack([self.mean @ derivative(f, j) for j in range(3)], axis=1) for f in first
            ]
            blocks.append(np.stack(rows, axis=1))
        return scale * np.concatenate(blocks)

    def potential_variance(self, X: Array) -> Array:
        """Return the variance (n,) of the potential."""
        scale = self.gm / self.radius
        return np.concatenate(
            [self._sandwich(scale * t[None])[:, 0, 0] for t in self._tables(X, 0)]
        )

    def acceleration_covariance(self, X: Array) -> Array:
        """Return the covariance (n, 3, 3) of the acceleration, its own rounding included."""
        scale = self.gm / self.radius**2
        blocks = []
        for table in self._tables(X, 1):
            design = np.stack([derivative(table, i) for i in range(3)])
            size = ((self.mean @ design) ** 2).sum(axis=0)
            block = self._sandwich(scale * design)
            block += ROUNDING * scale**2 * size[:, None, None] * np.eye(3)
            blocks.append(block)
        return np.concatenate(blocks)

    def gradient_covariance(self, X: Array) -> Array:
        """Return the covariance (n, 9, 9) of the gravity gradient, its elements row by row."""
        scale = self.gm / self.radius**3
        blocks = []
        for table in self._tables(X, 2):
            first = [derivative(table, i) for i in range(3)]
            second = np.stack([derivative(f, j) for f in first for j in range(3)])
            blocks.append(self._sandwich(scale * second))
        return np.concatenate(blocks)

    def _sandwich(self, design: Array) -> Array:
        """Covariances (n, k, k) of linear functions ``design`` (k, p, n) of the coefficients."""
        half = design.transpose(2, 0, 1) @ self.root
        covariance = half @ half.mT
        return np.asarray(0.5 * (covariance + covariance.mT))

    def _tables(self, X: Array, more: int) -> Iterator[Array]:
        """Harmonics of chunks of positions, to ``more`` degrees above the own."""
        for k in range(0, max(len(X), 1), CHUNK):
            yield exterior_harmonics(X[k : k + CHUNK] / self.radius, self.degree + more)
