"""Fitted learners as bare arrays: mean, Jacobian and covariance in one pass, numpy only.

Each gives what the learner's own ``predict``, ``jacobian`` and ``predict_covariance`` give,
computing kernels, activations or harmonics once for the three. Normalised units.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.linalg import solve_triangular

from unmodeled.core.arrays import Array
from unmodeled.models.learned import (
    ExactGP,
    HarmonicGP,
    Learner,
    PointMassOnly,
    PotentialMLP,
    RBFNetwork,
    Residual,
    SpectralMLP,
)
from unmodeled.models.learned._harmonic_field import ROUNDING
from unmodeled.models.learned._kernels import correlation, gradient, scaled_squares, steepness
from unmodeled.models.learned._potential_field import PotentialField
from unmodeled.models.learned.scaling import Standardiser
from unmodeled.models.physics.exterior_harmonics import derivative, exterior_harmonics

__all__ = ["FrozenField", "freeze"]

#: Acceleration (b, 3), Jacobian (b, 3, 3) and covariance (b, 3, 3) or None at positions (b, 3).
FrozenField: TypeAlias = Callable[[Array], tuple[Array, Array, Array | None]]


def freeze(learner: Learner) -> FrozenField:
    """Return a fitted learner as a function that later fits of the learner do not change.

    Learners without a form of their own here are copied and called: their contract is numpy,
    too, only with each of the three computed by itself.
    """
    learner._require_fitted()
    for kind, make in _FORMS.items():
        if type(learner) is kind:
            return make(learner)
    return _Copied(copy.deepcopy(learner))


@dataclass(frozen=True)
class _Copied:
    learner: Learner

    def __call__(self, X: Array) -> tuple[Array, Array, Array | None]:
        covariance = self.learner._predict_covariance(X) if self.learner.has_covariance else None
        return self.learner._predict(X), self.learner._jacobian(X), covariance


@dataclass(frozen=True)
class _Sum:
    """Known point mass and learned rest, [Residual]."""

    mass: FrozenField
    rest: FrozenField

    @classmethod
    def of(cls, learner: Learner) -> _Sum:
        assert isinstance(learner, Residual)
        return cls(_Copied(learner._baseline()), freeze(learner.learner_))

    def __call__(self, X: Array) -> tuple[Array, Array, Array | None]:
        (a, J, _), (rest, slope, covariance) = self.mass(X), self.rest(X)
        return a + rest, J + slope, covariance


@dataclass(frozen=True)
class _Process:
    """Exact Gaussian process of any kernel, [Rasmussen2006] Algorithm 2.1."""

    kernel: str
    scaling: Standardiser
    x: Array
    theta: Array
    weights: Array
    factors: Array

    @classmethod
    def of(cls, learner: Learner) -> _Process:
        assert isinstance(learner, ExactGP)
        arrays = {key: value.copy() for key, value in learner._arrays().items()}
        factors = learner._factorise().copy()
        scaling = Standardiser.restore(arrays)
        return cls(
            learner.kernel, scaling, arrays["x"], arrays["theta"], arrays["weights"], factors
        )

    def __call__(self, X: Array) -> tuple[Array, Array, Array]:
        x = self.scaling.positions(X)
        J = np.empty((len(X), 3, 3))
        scaled, covariance = np.empty((len(X), 3)), np.zeros((len(X), 3, 3))
        for i, (*lengths, signal, _, mean) in enumerate(self.theta.T):
            length = np.array(lengths)
            square = scaled_squares(x, self.x, length)
            kernel = signal * correlation(self.kernel, square)
            steep = signal * steepness(self.kernel, square)
            scaled[:, i] = mean + (kernel * self.weights[i]).sum(axis=-1)
            J[:, i] = gradient(steep * self.weights[i], x, self.x, length)
            half = solve_triangular(self.factors[i], kernel.T, lower=True, check_finite=False)
            variance = signal - (half**2).sum(axis=0)
            floor = np.finfo(float).eps * signal
            covariance[:, i, i] = np.maximum(variance, floor) * self.scaling.y_scale**2
        return self.scaling.accelerations(scaled), self.scaling.slopes * J, covariance


@dataclass(frozen=True)
class _Network:
    """ReLU network."""

    scaling: Standardiser
    weights: tuple[Array, ...]
    biases: tuple[Array, ...]

    @classmethod
    def of(cls, learner: Learner) -> _Network:
        assert isinstance(learner, SpectralMLP)
        weights = tuple(w.copy() for w in learner._weights)
        return cls(learner._scaling, weights, tuple(b.copy() for b in learner._biases))

    def __call__(self, X: Array) -> tuple[Array, Array, None]:
        h = self.scaling.positions(X)
        slopes = np.broadcast_to(np.eye(3), (len(X), 3, 3))
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            h = h @ weight.T + bias
            active = h > 0.0
            h = np.where(active, h, 0.0)
            slopes = active[:, :, None] * (weight @ slopes)
        mean = self.scaling.accelerations(h @ self.weights[-1].T + self.biases[-1])
        return mean, self.scaling.slope * (self.weights[-1] @ slopes), None


@dataclass(frozen=True)
class _Gaussians:
    """Normalised Gaussians [Moody1989], as a softmax."""

    scaling: Standardiser
    centres: Array
    weights: Array
    width: float

    @classmethod
    def of(cls, learner: Learner) -> _Gaussians:
        assert isinstance(learner, RBFNetwork)
        centres, weights = learner._centres.copy(), learner._weights.copy()
        return cls(learner._scaling, centres, weights, learner._width)

    def __call__(self, X: Array) -> tuple[Array, Array, None]:
        x = self.scaling.positions(X)
        logits = (x @ self.centres.T - 0.5 * (self.centres**2).sum(axis=1)) / self.width**2
        logits -= logits.max(axis=1, keepdims=True)
        shares = np.exp(logits)
        shares /= shares.sum(axis=1, keepdims=True)
        scaled = shares @ self.weights.T
        # d share_j / dx = share_j (c_j - mean c) / w^2
        offset = self.centres[None] - (shares @ self.centres)[:, None, :]
        slope = self.weights @ (shares[:, :, None] * offset)
        J = self.scaling.slope / self.width**2 * slope
        return self.scaling.accelerations(scaled), J, None


@dataclass(frozen=True)
class _Harmonics:
    """Exterior harmonics with the covariance of their coefficients."""

    degree: int
    gm: float
    radius: float
    mean: Array
    root: Array

    @classmethod
    def of(cls, learner: Learner) -> _Harmonics:
        assert isinstance(learner, HarmonicGP)
        mean, root = learner.coefficients_.copy(), learner.covariance_root_.copy()
        return cls(learner.degree_, learner.gm, learner.radius, mean, root)

    def __call__(self, X: Array) -> tuple[Array, Array, Array]:
        table = exterior_harmonics(X / self.radius, self.degree + 2)
        first = [derivative(table, i) for i in range(3)]
        size = len(self.mean)
        design = np.stack([f[:size] for f in first])
        scale = self.gm / self.radius**2
        a = scale * np.stack([self.mean @ d for d in design], axis=1)
        J = np.empty((len(X), 3, 3))
        for i in range(3):
            for j in range(i, 3):
                J[:, i, j] = J[:, j, i] = self.mean @ derivative(first[i], j)
        half = scale * design.transpose(2, 0, 1) @ self.root
        covariance = half @ half.mT
        covariance += ROUNDING * (a**2).sum(axis=1)[:, None, None] * np.eye(3)
        return a, J * (scale / self.radius), 0.5 * (covariance + covariance.mT)


@dataclass(frozen=True)
class _Potential:
    """Gradient of a network of the potential, with the covariance of its weights."""

    field: PotentialField
    gm: float
    radius: float
    unknowns: Array
    root: Array

    @classmethod
    def of(cls, learner: Learner) -> _Potential:
        assert isinstance(learner, PotentialMLP)
        unknowns, root = learner._unknowns.copy(), learner._root.copy()
        return cls(learner._make_field(), learner.gm, learner.radius, unknowns, root)

    def __call__(self, X: Array) -> tuple[Array, Array, Array]:
        x, scale = X / self.radius, self.gm / self.radius**2
        a, J = self.field.acceleration_and_gradient(x, self.unknowns)
        _, slopes = self.field.slopes(x, self.unknowns)
        half = scale * slopes @ self.root
        covariance = half @ half.mT
        return scale * a, J * (scale / self.radius), 0.5 * (covariance + covariance.mT)


_FORMS: dict[type[Learner], Callable[[Learner], FrozenField]] = {
    Residual: _Sum.of,
    ExactGP: _Process.of,
    SpectralMLP: _Network.of,
    RBFNetwork: _Gaussians.of,
    HarmonicGP: _Harmonics.of,
    PotentialMLP: _Potential.of,
    PointMassOnly: lambda learner: _Copied(copy.deepcopy(learner)),
}
