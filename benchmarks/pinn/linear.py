"""Fields that are linear in their coefficients: spherical harmonics and mascons, least squares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.physics.exterior_harmonics import derivative, exterior_harmonics

__all__ = ["LinearField", "harmonic_design", "mascon_design"]

_CHUNK = 2000
# Directions whose singular value is below this share of the largest are rounding.
_RANK = 1e-12
_RIDGES = np.logspace(-24, 2, 105)


@dataclass
class LinearField:
    """Weighted least squares, in chunks: memory does not grow with the samples.

    Parameters
    ----------
    design : callable
        Positions (n, 3) to the accelerations (3, p, n) of each coefficient alone.
    regularised : bool
        Whether a ridge on the scaled coefficients is found by generalised cross-validation
        [Golub1979].
    """

    design: Callable[[Array], Array]
    regularised: bool = False
    coefficients: Array = field(default_factory=lambda: np.empty(0), init=False)

    def fit(self, X: Array, y: Array, weight: Array) -> LinearField:
        """Fit positions (n, 3) and accelerations (n, 3) with weights (n,) of their errors."""
        triangle: Array | None = None
        for k in range(0, len(X), _CHUNK):
            part = slice(k, k + _CHUNK)
            rows = self.design(X[part]) * weight[part]
            rows = rows.transpose(0, 2, 1).reshape(-1, rows.shape[1])
            target = (y[part] * weight[part, None]).T.reshape(-1, 1)
            block = np.concatenate([rows, target], axis=1)
            block = block if triangle is None else np.concatenate([triangle, block])
            triangle = np.linalg.qr(block, mode="r")
        assert triangle is not None
        matrix, right = triangle[:, :-1], triangle[:, -1]
        size = np.linalg.norm(matrix, axis=0)
        size[size == 0] = 1.0
        u, s, vt = np.linalg.svd((matrix / size)[: len(size)], full_matrices=False)
        along = u.T @ right[: len(size)]
        ridge = 0.0
        if self.regularised:
            ridge = _ridge(s, along, float(right @ right), 3 * len(X))
        gain = np.where(s > _RANK * s[0], s / (s**2 + ridge), 0.0)
        self.coefficients = vt.T @ (gain * along) / size
        return self

    def predict(self, X: Array) -> Array:
        """Return accelerations (n, 3)."""
        parts = [
            np.einsum("ipn,p->ni", self.design(X[k : k + _CHUNK]), self.coefficients)
            for k in range(0, len(X), _CHUNK)
        ]
        return np.concatenate(parts)

    @property
    def parameters(self) -> int:
        """Number of coefficients."""
        return len(self.coefficients)


def _ridge(s: Array, along: Array, total: float, count: int) -> float:
    """Return the ridge with the best generalised cross-validation."""
    outside = max(total - float(along @ along), 0.0)

    def score(ridge: float) -> float:
        shrink = ridge / (s**2 + ridge)
        freedom = count - float(np.sum(1 - shrink))
        return (outside + float(np.sum((shrink * along) ** 2))) / freedom**2

    return min(_RIDGES * s[0] ** 2, key=score)


def harmonic_design(degree: int) -> Callable[[Array], Array]:
    """Return the design of exterior harmonics to a degree, lengths in reference radii."""

    def design(X: Array) -> Array:
        table = exterior_harmonics(X, degree + 1)
        return np.stack([derivative(table, axis) for axis in range(3)])

    return design


def mascon_design(places: Array) -> Callable[[Array], Array]:
    """Return the design of point masses at places (p, 3)."""
    return partial(_masses, places)


def _masses(places: Array, X: Array) -> Array:
    away = X[:, None] - places
    cubed = np.sum(away**2, axis=2) ** 1.5
    found: Array = -(away / cubed[:, :, None]).transpose(2, 1, 0)
    return found
