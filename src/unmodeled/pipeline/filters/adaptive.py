"""Process noise that follows the innovations: the published rule, and a consistent one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.algebra import cholesky, cholesky_solve, symmetrise, times
from unmodeled.pipeline.filters.interfaces import ProcessNoise
from unmodeled.pipeline.filters.state import FilterState, Predicted, Updated

__all__ = ["ForgettingNoise", "MatchedNoise"]

#: Largest change of a log variance in one update: a single outlier must not blow up Q.
_LARGEST_STEP = 0.5
#: Log variances stay within this of where they started: 1e10 in sigma.
_RANGE = 2.0 * np.log(1e10)
#: Memory at the start, updates, and how much of each further update is added to it.
_FIRST_WINDOW, _GROWTH = 20.0, 0.25


@dataclass(frozen=True)
class ForgettingNoise:
    r"""Q_k = alpha Q_(k-1) + (1 - alpha) K d d^T K^T: [Pesce2020] Eq. 27, the paper's mode.

    The correction K d is what the measurements still taught, so a filter with a small gain
    finds a small Q, and makes the gain smaller: its covariance is not consistent (measured in
    docs/filters.md). Kept to reproduce the paper; `MatchedNoise` is the one to use. In a gap Q
    stays as it is.

    Parameters
    ----------
    Q : ndarray (n, n)
        Start.
    alpha : float
        Forgetting factor, 0 to 1.
    """

    Q: Array
    alpha: float

    def __post_init__(self) -> None:
        size = len(np.atleast_1d(self.Q))
        object.__setattr__(self, "Q", as_array(self.Q, (size, size), "Q"))
        if not 0.0 <= self.alpha <= 1.0:
            raise ConfigError(f"alpha is {self.alpha}", allowed="0 to 1")

    def start(self, state: FilterState) -> Mapping[str, Array]:
        """Return the first Q, one for each run."""
        return {"Q": np.broadcast_to(self.Q, (len(state.mean), *self.Q.shape))}

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (b, n, n) of each run."""
        return state.memory["Q"]

    def learn(self, predicted: Predicted, updated: Updated) -> Mapping[str, Array]:
        """Return the next Q."""
        Q = predicted.state.memory["Q"]
        step = times(updated.gain, updated.innovation)
        new = self.alpha * Q + (1.0 - self.alpha) * step[:, :, None] * step[:, None, :]
        return {"Q": np.where(updated.accepted[:, None, None], new, Q)}


@dataclass(frozen=True)
class MatchedNoise:
    r"""Structured noise whose strength on each axis makes the innovations as large as stated.

    Q = sum_j exp(theta_j) Q_j, Q_j the part of ``base`` on axis j. With
    :math:`\dot P_j = \partial P / \partial \theta_j` carried through prediction and Joseph update
    and :math:`\dot S_j = H \dot P_j H^T`, each innovation d gives the score
    :math:`\frac12 (d^T S^{-1} \dot S_j S^{-1} d - tr\,S^{-1} \dot S_j)`, of zero mean exactly
    where E d d^T = S along :math:`\dot S_j`, and the information
    :math:`\frac12 tr\,S^{-1} \dot S_j S^{-1} \dot S_k`. theta follows by scoring with forgetting.
    It is covariance matching [Mehra1972] in recursive form; each run adapts for itself.

    Parameters
    ----------
    base : ProcessNoise
        Shape and first guess; states are positions, velocities and whatever follows, axis by axis.
    window : float
        Updates over which the past is forgotten; the first ones are forgotten sooner.
    spread : float
        Standard deviation of the first guess, as the natural logarithm of the variance; 4.6 is a
        factor of ten in sigma.
    dimensions : int
    """

    base: ProcessNoise
    window: float = 500.0
    spread: float = 4.6
    dimensions: int = 3

    def __post_init__(self) -> None:
        for key in ("window", "spread", "dimensions"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"{key} is {getattr(self, key)}", allowed="> 0")
        if self.window < _FIRST_WINDOW:
            raise ConfigError(f"window is {self.window}", allowed=f"at least {_FIRST_WINDOW:g}")

    def start(self, state: FilterState) -> Mapping[str, Array]:
        """Return scales of one, sensitivities of zero and no information."""
        (b, n), d = state.mean.shape, self.dimensions
        if n % d:
            raise ConfigError(f"{n} states on {d} axes", allowed="a multiple of the axes")
        return {
            "log_scale": np.zeros((b, d)),
            "sensitivity": np.zeros((b, d, n, n)),
            "information": np.zeros((b, d, d)),
            "age": np.zeros(b),
        }

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (b, n, n) of each run."""
        whole: Array = self._parts(state, dt).sum(axis=1)
        return whole

    def scale(self, state: FilterState) -> Array:
        """Return the factor (b, dimensions) by which sigma differs from the first guess."""
        factor: Array = np.exp(0.5 * state.memory["log_scale"])
        return factor

    def learn(self, predicted: Predicted, updated: Updated) -> Mapping[str, Array]:
        """Return scales, sensitivities and information after an update."""
        before = predicted.previous
        slope = before.memory["sensitivity"]
        dt = predicted.state.time - before.time
        if dt > 0.0:
            F = predicted.transition[:, None]
            slope = F @ slope @ F.mT + self._parts(before, dt)
        good = updated.used & updated.accepted[:, None]
        H = np.where(good[:, :, None], updated.design, 0.0)[:, None]
        slope_S = H @ slope @ H.mT
        L = cholesky(updated.innovation_covariance, "the innovation covariance")[:, None]
        ratio = cholesky_solve(L, slope_S)
        whitened = cholesky_solve(L, updated.innovation[:, None, :, None])
        fit = (whitened.mT @ slope_S @ whitened)[..., 0, 0]
        score = 0.5 * (fit - np.trace(ratio, axis1=-2, axis2=-1))
        information = 0.5 * np.einsum("bjmn,bknm->bjk", ratio, ratio)
        # A short memory at first: what is learned about a wrong Q says little of the right one.
        age = before.memory["age"]
        window = np.minimum(self.window, _FIRST_WINDOW + _GROWTH * age)[:, None, None]
        kept = before.memory["information"] * (1.0 - 1.0 / window) + information
        guess = np.eye(self.dimensions) / self.spread**2
        step = np.linalg.solve(kept + guess, score[..., None])[..., 0]
        theta = before.memory["log_scale"] + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        left = np.eye(slope.shape[-1]) - updated.gain @ updated.design
        left = left[:, None]
        return {
            "log_scale": np.clip(theta, -_RANGE, _RANGE),
            "sensitivity": symmetrise(left @ slope @ left.mT),
            "information": np.where(
                updated.accepted[:, None, None], kept, before.memory["information"]
            ),
            "age": age + updated.accepted,
        }

    def _parts(self, state: FilterState, dt: float) -> Array:
        """Return exp(theta_j) Q_j, (b, d, n, n)."""
        n, d = state.mean.shape[1], self.dimensions
        base = self.base.covariance(state, dt)
        base = base[None] if base.ndim == 2 else base
        axis = np.arange(n) % d
        mine = (axis == np.arange(d)[:, None]).astype(np.float64)
        pick = mine[:, :, None] * mine[:, None, :]
        factor = np.exp(state.memory["log_scale"])[:, :, None, None]
        parts: Array = factor * pick * base[:, None]
        return parts
