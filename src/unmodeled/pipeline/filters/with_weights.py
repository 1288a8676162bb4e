"""Weights as states: Kalman weights, with all their correlations to position and velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.algebra import times
from unmodeled.pipeline.filters.basis import Basis
from unmodeled.pipeline.filters.interfaces import ProcessNoise, RateModel
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.filters.weights import LinearAcceleration

__all__ = ["WithWeights", "WithWeightsNoise"]


@dataclass(frozen=True)
class WithWeights:
    """A `RateModel` whose further states, at the end, are the weights of a basis.

    The extended filter on it is exact Bayesian learning of the weights, but for linearisation:
    a finite-rank Gaussian process updated by every measurement of the spacecraft, whether
    position, range or angle, in gaps left as it is. The cost of a step grows with (n + p)^3.

    Parameters
    ----------
    model : RateModel
    basis : Basis
    """

    model: RateModel
    basis: Basis

    @property
    def size(self) -> int:
        """Number of states of the model and of weights."""
        return self.model.size + self.basis.size

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, n + p) and its Jacobian; see `RateModel`."""
        n = self.model.size
        inner, weights = x[:, :n], x[:, n:]
        rate = np.zeros_like(x)
        rate[:, :n], slope = self.model.rates(inner, t)
        B = self.basis.evaluate(inner, t)
        rate[:, 3:6] += times(B, weights)
        A = np.zeros((len(x), self.size, self.size))
        A[:, :n, :n] = slope
        A[:, 3:6, :n] += self.basis.slope(inner, t, weights)
        A[:, 3:6, n:] = B
        return rate, A

    def start(self, state: FilterState, sigma: npt.ArrayLike) -> FilterState:
        """Return a start with weights of zero mean and the given prior sigma (p,)."""
        b, n = state.mean.shape
        if n != self.model.size:
            raise ConfigError(f"the start has {n} states", allowed=f"{self.model.size}")
        s = np.broadcast_to(np.asarray(sigma, dtype=np.float64), (self.basis.size,))
        P = np.zeros((len(state.covariance), self.size, self.size))
        P[:, :n, :n], P[:, n:, n:] = state.covariance, np.diag(s**2)
        mean = np.hstack([state.mean, np.zeros((b, self.basis.size))])
        return FilterState(mean, P, state.time, state.memory)

    def learned(self, state: FilterState, run: int = 0) -> LinearAcceleration:
        """Return what one run has learned, with its covariance: to freeze and fly elsewhere."""
        n = self.model.size
        P = state.covariance[run if len(state.covariance) > 1 else 0, n:, n:]
        size = np.sqrt(np.maximum(np.diag(P), np.finfo(float).tiny))
        values, vectors = np.linalg.eigh(P / size / size[:, None])
        root = size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return LinearAcceleration(self.basis, state.mean[run, n:].copy(), root)


@dataclass(frozen=True)
class WithWeightsNoise:
    """Process noise of a model with weights: theirs is a slow random walk, or none.

    Parameters
    ----------
    base : ProcessNoise
        Of the other states.
    weights : int
        Number of weights, the last states.
    density : float or array_like (p,)
        Variance that a weight gains in a second; 0 for a field that does not change.
    """

    base: ProcessNoise
    weights: int
    density: npt.ArrayLike = 0.0

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q."""
        Q = np.array(self.base.covariance(state, dt))
        place = np.arange(Q.shape[-1] - self.weights, Q.shape[-1])
        Q[..., place, place] += np.asarray(self.density, dtype=np.float64) * dt
        return Q
