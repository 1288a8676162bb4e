"""Dynamic model compensation: the unmodelled acceleration as Gauss-Markov states.

``with_gauss_markov`` adds the states to any `RateModel`; `GaussMarkov` is their process noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.interfaces import RateModel
from unmodeled.pipeline.filters.process_noise import axis_values
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.filters.van_loan import van_loan

__all__ = ["GaussMarkov", "WithGaussMarkov"]


@dataclass(frozen=True)
class GaussMarkov:
    r"""Process noise of positions, velocities and Gauss-Markov accelerations.

    First order: dw/dt = -w / tau + noise of density q; stationary variance q tau / 2.
    Second order (critically damped): d2w/dt2 = -2 (dw/dt) / tau - w / tau^2 + noise of density q;
    stationary variance q tau^3 / 4. Integrated with the double integrator by `van_loan`, in units
    in which the step is 1, so that positions at tiny steps keep all digits: the closed form of
    the textbooks cancels for dt / tau below 1e-2 ([Fereoli2024] Eq. 22 is a third form: noise held
    over a step, which `held` gives).

    The gravity gradient is left out of Q: its share is of order (mean motion x dt)^2.

    Parameters
    ----------
    time_constant : float
        tau, seconds; infinity makes a random walk (first order only).
    density : float or array_like (dimensions,)
        q: (m/s2)^2 / s for first order, (m/s2)^2 / s^3 for second.
    order : {1, 2}
    dimensions : int
    held : bool
        The noise is constant over each step instead of white: Gamma q Gamma^T of [Fereoli2024]
        Eq. 21 and 22. First order only; ``density`` is then (m/s3)^2.
    """

    time_constant: float
    density: npt.ArrayLike
    order: Literal[1, 2] = 1
    dimensions: int = 3
    held: bool = False
    _cache: dict[tuple[int, float], Array] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        _check(self.time_constant, self.order)
        if self.held and self.order != 1:
            raise ConfigError("held noise with order 2", allowed="order 1")

    @classmethod
    def of_sigma(
        cls,
        time_constant: float,
        sigma: npt.ArrayLike,
        order: Literal[1, 2] = 1,
        dimensions: int = 3,
    ) -> GaussMarkov:
        """Choose the density by the stationary standard deviation of the acceleration, m/s2."""
        if not math.isfinite(time_constant):
            raise ConfigError(
                "a random walk has no stationary sigma", allowed="a finite time constant"
            )
        variance = axis_values(sigma, "sigma", dimensions) ** 2
        factor = 2.0 / time_constant if order == 1 else 4.0 / time_constant**3
        return cls(time_constant, variance * factor, order, dimensions)

    def stationary_sigma(self) -> Array:
        """Return the standard deviation (dimensions,) of the acceleration after long times, m/s2.

        Of the process with white noise; infinite for a random walk.
        """
        factor = self.time_constant / 2.0 if self.order == 1 else self.time_constant**3 / 4.0
        return np.sqrt(axis_values(self.density, "density", self.dimensions) * factor)

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (n, n) for states position, velocity, acceleration[, its rate]."""
        n = state.mean.shape[1]
        found = self._cache.get((n, dt))
        if found is None:
            one_axis = self._held(dt) if self.held else self._white(dt)
            q = axis_values(self.density, "density", self.dimensions)
            used = len(one_axis) * self.dimensions
            if n < used:
                raise ConfigError(
                    f"the model has {n} states",
                    allowed=f"at least {used}",
                    do="wrap it in WithGaussMarkov",
                )
            found = np.zeros((n, n))
            found[:used, :used] = np.kron(one_axis, np.diag(q))
            if len(self._cache) > 256:
                self._cache.clear()
            self._cache[n, dt] = found
        return found

    def _white(self, dt: float) -> Array:
        size = 2 + self.order
        A = np.diag(np.ones(size - 1), 1)
        beta = dt / self.time_constant
        if self.order == 1:
            A[2, 2] = -beta
        else:
            A[3, 2:] = -(beta**2), -2.0 * beta
        L = np.zeros((size, size))
        L[-1, -1] = 1.0
        # time in steps: the k-th from the last state is dt^k times the scaled one
        _, Q = van_loan(A, L, 1.0)
        scale = dt ** (np.arange(size - 1, -1, -1.0) + 0.5)
        scaled: Array = scale[:, None] * Q * scale
        return scaled

    def _held(self, dt: float) -> Array:
        A = np.diag(np.ones(3), 1)
        A[2, 2] = -dt / self.time_constant
        F, _ = van_loan(A, np.zeros((4, 4)), 1.0)
        gamma = F[:3, 3] * dt ** np.arange(3.0, 0.0, -1.0)
        return np.outer(gamma, gamma)


@dataclass(frozen=True)
class WithGaussMarkov:
    """A `RateModel` with Gauss-Markov accelerations as further states.

    Parameters
    ----------
    model : RateModel
        Positions and velocities first; its own further states stay in between.
    time_constant : float
        Seconds, as in `GaussMarkov`; infinity for a random walk.
    order : {1, 2}
    dimensions : int
        Axes d; d states are added (2 d for second order), at the end.
    """

    model: RateModel
    time_constant: float
    order: Literal[1, 2] = 1
    dimensions: int = 3

    def __post_init__(self) -> None:
        _check(self.time_constant, self.order)

    @property
    def size(self) -> int:
        """Number of states of the model and of the Gauss-Markov process."""
        return self.model.size + self.order * self.dimensions

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, n) and its Jacobian (b or 1, n, n); see `RateModel`."""
        n, d = self.model.size, self.dimensions
        inner, slope = self.model.rates(x[:, :n], t)
        w = x[:, n : n + d]
        rate = np.zeros_like(x)
        rate[:, :n] = inner
        rate[:, d : 2 * d] += w
        A = np.zeros((len(slope), self.size, self.size))
        A[:, :n, :n] = slope
        one = np.eye(d)
        A[:, d : 2 * d, n : n + d] = one
        beta = 1.0 / self.time_constant
        if self.order == 1:
            rate[:, n:] = -beta * w
            A[:, n:, n:] = -beta * one
        else:
            wdot = x[:, n + d :]
            rate[:, n : n + d] = wdot
            rate[:, n + d :] = -2.0 * beta * wdot - beta**2 * w
            A[:, n : n + d, n + d :] = one
            A[:, n + d :, n + d :] = -2.0 * beta * one
            A[:, n + d :, n : n + d] = -(beta**2) * one
        return rate, A


def _check(time_constant: float, order: int) -> None:
    if not time_constant > 0.0:
        raise ConfigError(f"time constant is {time_constant} s", allowed="> 0")
    if order not in (1, 2):
        raise ConfigError(f"order is {order}", allowed="1 or 2")
    if order == 2 and not math.isfinite(time_constant):
        raise ConfigError("a second-order process without end", allowed="a finite time constant")
