"""A learned acceleration in the dynamics: along the step, or held over it as the papers do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.interfaces import LearnedAcceleration, ProcessNoise, RateModel
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.state import FilterState

__all__ = ["HeldResidual", "LearnedNoise", "WithResidual", "held_push"]


@dataclass(frozen=True)
class WithResidual:
    """A `RateModel` plus a learned acceleration, evaluated wherever the integrator asks.

    Parameters
    ----------
    model : RateModel
        Positions and velocities first.
    residual : LearnedAcceleration
    """

    model: RateModel
    residual: LearnedAcceleration

    @property
    def size(self) -> int:
        """Number of states."""
        return self.model.size

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, n) and its Jacobian (b, n, n); see `RateModel`."""
        rate, slope = self.model.rates(x, t)
        a, J, _ = self.residual.evaluate(x, t)
        rate = rate.copy()
        rate[:, 3:6] += a
        A = np.repeat(slope, len(x), axis=0) if len(slope) == 1 else slope.copy()
        A[:, 3:6, :] += J
        return rate, A


@dataclass(frozen=True)
class HeldResidual:
    """A `ProcessModel`: the learned acceleration of the start of a step, held over the step.

    The form of [Pesce2020] Eq. 21 and [Marchese2023] Eq. 3.97: one evaluation a step, an error
    of first order in the step. The transition holds the acceleration's own derivative, too:
    F + Gamma J, Gamma the response of the state to a constant acceleration.

    Parameters
    ----------
    model : RateModel
    residual : LearnedAcceleration
    longest : float
        Longest integration step, seconds.
    """

    model: RateModel
    residual: LearnedAcceleration
    longest: float = float("inf")

    @property
    def size(self) -> int:
        """Number of states."""
        return self.model.size

    def propagate(self, x: Array, t: float, dt: float) -> tuple[Array, Array]:
        """Return states and transition after ``dt``; see `ProcessModel`."""
        a, J, _ = self.residual.evaluate(x, t)
        after, F, push = held_push(self.model, x, a, t, dt, self.longest)
        return after, F + push @ J


@dataclass(frozen=True)
class _Pushed:
    """A model with a constant acceleration as three more states."""

    model: RateModel

    @property
    def size(self) -> int:
        return self.model.size + 3

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        n = self.model.size
        inner, slope = self.model.rates(x[:, :n], t)
        rate = np.zeros_like(x)
        rate[:, :n] = inner
        rate[:, 3:6] += x[:, n:]
        A = np.zeros((len(slope), n + 3, n + 3))
        A[:, :n, :n] = slope
        A[:, 3:6, n:] = np.eye(3)
        return rate, A


def held_push(
    model: RateModel, x: Array, a: Array, t: float, dt: float, longest: float = float("inf")
) -> tuple[Array, Array, Array]:
    """Carry states over a step under a constant acceleration.

    Parameters
    ----------
    model : RateModel
    x : ndarray (b, n)
    a : ndarray (b, 3)
        m/s2.
    t, dt, longest : float
        Seconds.

    Returns
    -------
    x_next : ndarray (b, n)
    F : ndarray (b or 1, n, n)
        d x_next / d x at constant ``a``.
    push : ndarray (b or 1, n, 3)
        d x_next / d a.
    """
    n = model.size
    whole, slope = RungeKutta(_Pushed(model), longest).propagate(np.hstack([x, a]), t, dt)
    return whole[:, :n], slope[:, :n, :n], slope[:, :n, n:]


@dataclass(frozen=True)
class LearnedNoise:
    """Process noise from the learner's own covariance, added to that of the rest.

    A learned field is wrong in the same way for as long as the spacecraft is in the same place:
    ``correlation_time`` says for how long. Its effect over many steps is that of white noise of
    density 2 tau C. Without it the error is taken as new in every step, which is too little by
    a factor 2 tau / dt.

    Parameters
    ----------
    base : ProcessNoise
    residual : LearnedAcceleration
        One with a covariance.
    correlation_time : float, optional
        tau, seconds; of the order of lengthscale over speed.
    """

    base: ProcessNoise
    residual: LearnedAcceleration
    correlation_time: float | None = None

    def __post_init__(self) -> None:
        if self.correlation_time is not None and not self.correlation_time > 0.0:
            raise ConfigError(f"correlation time is {self.correlation_time} s", allowed="> 0")

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (b, n, n)."""
        Q = self.base.covariance(state, dt)
        Q = Q[None] if Q.ndim == 2 else Q
        _, _, C = self.residual.evaluate(state.mean, state.time)
        if C is None:
            raise ConfigError(
                "the learned acceleration has no covariance",
                allowed="a learner that knows its uncertainty, e.g. exact_gp or harmonic_gp",
                do="use the base noise alone, with room for the error of the learner",
            )
        tau = self.correlation_time
        if tau is None:
            pp, pv, vv = dt**4 / 4.0, dt**3 / 2.0, dt**2
        else:
            pp, pv, vv = (2.0 * tau * w for w in (dt**3 / 3.0, dt**2 / 2.0, dt))
        more = np.zeros((len(C), *Q.shape[1:]))
        more[:, :3, :3], more[:, 3:6, 3:6] = pp * C, vv * C
        more[:, :3, 3:6] = more[:, 3:6, :3] = pv * C
        total: Array = Q + more
        return total
