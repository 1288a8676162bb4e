"""Extended Kalman filter, plain and iterated, for any model, measurement and process noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.pipeline.filters.algebra import sandwich, symmetrise, times
from unmodeled.pipeline.filters.interfaces import (
    MeasurementModel,
    ProcessModel,
    ProcessNoise,
    is_angular,
    is_learning,
)
from unmodeled.pipeline.filters.state import (
    Booleans,
    FilterState,
    Predicted,
    Updated,
    remember,
)
from unmodeled.pipeline.filters.update import correct

__all__ = ["ExtendedKalmanFilter"]


@dataclass(frozen=True)
class ExtendedKalmanFilter:
    """First-order filter about its own estimate [TapleySchutzBorn2004].

    On a linear model it is the Kalman filter. States are never changed in place: `predict` and
    `update` return new ones, and the same input gives the same output.

    Parameters
    ----------
    model : ProcessModel
    measurement : MeasurementModel
    noise : ProcessNoise
        Of one step; one that learns (`MatchedNoise`, `ForgettingNoise`) is told of every update.
    gate : float, optional
        Reject measurements that a good one would be worse than with less than this probability,
        e.g. 1e-6. A rejected one is logged and changes nothing.
    iterations : int
        Linearisations of the measurement in each update (iterated filter, Gauss-Newton about
        the prediction); 1 is the plain filter. More do not use a measurement more than once.
    """

    model: ProcessModel
    measurement: MeasurementModel
    noise: ProcessNoise
    gate: float | None = None
    iterations: int = 1

    def __post_init__(self) -> None:
        if self.iterations < 1:
            raise ConfigError(f"iterations is {self.iterations}", allowed="an integer >= 1")
        if self.gate is not None and not 0.0 < self.gate < 1.0:
            raise ConfigError(
                f"gate is {self.gate}", allowed="a probability between 0 and 1, e.g. 1e-6"
            )

    def start(self, state: FilterState) -> FilterState:
        """Check the size of a start and add what this filter remembers."""
        if state.mean.shape[1] != self.model.size:
            raise InputError(
                f"the start has {state.mean.shape[1]} states",
                allowed=f"{self.model.size}, as the model",
            )
        memory = dict(state.memory)
        if is_learning(self.noise):
            memory |= self.noise.start(state)
        return FilterState(state.mean, state.covariance, state.time, memory)

    def predict(self, state: FilterState, dt: float) -> Predicted:
        """Carry a state over ``dt`` > 0 seconds."""
        mean, F, Q, memory = self._step(state, dt)
        P = symmetrise(sandwich(F, state.covariance) + Q)
        after = FilterState(mean, P, state.time + dt, {**state.memory, **memory})
        return Predicted(after, F, Q, state)

    def update(self, predicted: Predicted, z: Array, used: npt.ArrayLike | None = None) -> Updated:
        """Use the measurements of one epoch.

        Parameters
        ----------
        predicted : Predicted
        z : ndarray (b, m)
            NaN where nothing was measured.
        used : array_like (m,), (1, m) or (b, m) of bool, optional
            Components to use; the default is all that are not NaN.
        """
        state = predicted.state
        mask = self._mask(z, used)
        expected, H = self.measurement.h(state.mean, state.time)
        innovation = self._difference(z, expected)
        found = correct(state.mean, state.covariance, innovation, H, self._R, mask, self.gate)
        mean = found.mean
        for _ in range(self.iterations - 1):
            again, H_again = self.measurement.h(mean, state.time)
            step = self._difference(z, again) - times(H_again, state.mean - mean)
            rows = mask & found.accepted[:, None]
            closer = correct(state.mean, state.covariance, step, H_again, self._R, rows)
            mean = closer.mean
            covariance, gain = closer.covariance, closer.gain
        if self.iterations == 1:
            covariance, gain = found.covariance, found.gain
        after = Updated(
            FilterState(mean, covariance, state.time, state.memory),
            innovation if mask.all() else np.where(mask, innovation, 0.0),
            found.innovation_covariance,
            found.nis,
            found.freedom,
            found.accepted,
            gain,
            H,
            mask,
        )
        return self._learned(predicted, after)

    # What variants change ---------------------------------------------------------------------

    def _propagate(
        self, state: FilterState, dt: float
    ) -> tuple[Array, Array, Array | None, Mapping[str, Array]]:
        """Return the new mean, the transition, noise of its own or None, and what to remember."""
        mean, F = self.model.propagate(state.mean, state.time, dt)
        return mean, F, None, {}

    def _learned(self, predicted: Predicted, updated: Updated) -> Updated:
        """Return the update with what was learned from it in its memory."""
        if not is_learning(self.noise):
            return updated
        return remember(updated, self.noise.learn(predicted, updated))

    # Shared -----------------------------------------------------------------------------------

    def _step(
        self, state: FilterState, dt: float
    ) -> tuple[Array, Array, Array, Mapping[str, Array]]:
        """Return the new mean, the transition, all process noise (b or 1, n, n) and the memory."""
        mean, F, extra, memory = self._propagate(state, dt)
        Q = self.noise.covariance(state, dt)
        Q = Q[None] if Q.ndim == 2 else Q
        return mean, F, Q if extra is None else Q + extra, memory

    @property
    def _R(self) -> Array:  # noqa: N802
        return self.measurement.R

    def _difference(self, z: Array, expected: Array) -> Array:
        if is_angular(self.measurement):
            return self.measurement.difference(z, expected)
        return z - expected

    def _mask(self, z: Array, used: npt.ArrayLike | None) -> Booleans:
        if z.shape[-1] != len(self._R):
            raise DataError(
                f"a measurement has {z.shape[-1]} components", allowed=f"{len(self._R)}, as R"
            )
        there: Booleans = np.isfinite(z)
        if used is None and there.all():
            return there[:1]
        if np.isinf(z).any():
            raise DataError("a measurement is infinite", allowed="numbers, or NaN for a gap")
        if used is not None:
            there = there & np.asarray(used, dtype=bool)
        # one row where all runs agree, so that a common covariance stays common
        return there[:1] if (there == there[:1]).all() else there
