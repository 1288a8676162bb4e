"""What a filter asks of dynamics, of a measurement and of process noise.

Everything is batched over Monte-Carlo runs: the first axis ``b`` counts runs, never times.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol, TypeGuard

from unmodeled.core.arrays import Array

if TYPE_CHECKING:
    from unmodeled.pipeline.filters.state import FilterState, Predicted, Updated

__all__ = [
    "AngularMeasurement",
    "LearnedAcceleration",
    "LearningNoise",
    "MeasurementModel",
    "ProcessModel",
    "ProcessNoise",
    "RateModel",
    "is_angular",
    "is_learning",
]


class ProcessModel(Protocol):
    """Dynamics as a filter sees them: from one epoch to the next."""

    @property
    def size(self) -> int:
        """Number of states n."""
        ...

    def propagate(self, x: Array, t: float, dt: float) -> tuple[Array, Array]:
        """Return the states (b, n) at ``t + dt`` and the transition matrices (b, n, n).

        Parameters
        ----------
        x : ndarray (b, n)
            States at ``t``; position first, then velocity, then what the model adds, SI.
        t, dt : float
            Seconds; ``dt`` > 0.

        Returns
        -------
        x_next : ndarray (b, n)
        F : ndarray (b, n, n), or (1, n, n) where it is the same for all runs
            d x_next / d x at ``x``. One matrix for all runs lets the covariance, too, be common.
        """
        ...


class RateModel(Protocol):
    """Dynamics as a differential equation; `RungeKutta` makes a `ProcessModel` of it."""

    @property
    def size(self) -> int:
        """Number of states n."""
        ...

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, n) and its Jacobian d(dx/dt)/dx, (b, n, n) or (1, n, n), at ``t``."""
        ...


class MeasurementModel(Protocol):
    """What is measured, and how well."""

    @property
    def R(self) -> Array:  # noqa: N802  (the field's own symbol)
        """Covariance (m, m) of the measurement noise, positive definite."""
        ...

    def h(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return the expected measurements (b, m) and H = dz/dx, (b, m, n) or (1, m, n).

        It must be a function of its arguments alone: no noise is drawn here.
        """
        ...


class AngularMeasurement(Protocol):
    """A measurement whose difference is not plain subtraction (angles that wrap)."""

    def difference(self, z: Array, expected: Array) -> Array:
        """Return ``z - expected`` (b, m), angles in (-pi, pi]."""
        ...


class ProcessNoise(Protocol):
    """What the dynamics do not say, as a covariance over one step."""

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q, (n, n), (1, n, n) or (b, n, n), of a step of ``dt`` seconds from ``state``."""
        ...


class LearningNoise(Protocol):
    """Process noise that adapts to what was measured; what it knows is in the state's memory."""

    def start(self, state: FilterState) -> Mapping[str, Array]:
        """Return what to remember at the start."""
        ...

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q of a step, from the memory of ``state``."""
        ...

    def learn(self, predicted: Predicted, updated: Updated) -> Mapping[str, Array]:
        """Return what changes in the memory after an update."""
        ...


class LearnedAcceleration(Protocol):
    """An acceleration that the equations lack, with what a filter needs of it."""

    def evaluate(self, x: Array, t: float) -> tuple[Array, Array, Array | None]:
        """Return acceleration, Jacobian and covariance at states ``x`` (b, n).

        Returns
        -------
        a : ndarray (b, 3)
            m/s2, in the axes of the states.
        J : ndarray (b, 3, n)
            da/dx.
        C : ndarray (b, 3, 3) or None
            Covariance of ``a``; None where nothing is known of its error.
        """
        ...


def is_angular(measurement: MeasurementModel) -> TypeGuard[AngularMeasurement]:
    """Return whether a measurement compares in its own way."""
    # not isinstance: a protocol's check takes 40 us, as long as the algebra of a step
    return hasattr(measurement, "difference")


def is_learning(noise: ProcessNoise) -> TypeGuard[LearningNoise]:
    """Return whether process noise adapts."""
    return hasattr(noise, "learn")
