"""Extended filter with an RBF network that learns from every innovation, as in the papers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.algebra import times
from unmodeled.pipeline.filters.basis import RBFFeatures
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.state import FilterState, Predicted, Updated, remember
from unmodeled.pipeline.filters.with_residual import held_push

__all__ = ["LearningFilter", "LearningRule", "network_acceleration"]


class LearningRule(Protocol):
    """How weights (b, M, 3) follow from an update."""

    @property
    def features(self) -> RBFFeatures:
        """The hidden layer."""
        ...

    def weights(self, predicted: Predicted, updated: Updated) -> Array:
        """Return the next weights (b, M, 3), m/s2."""
        ...


def network_acceleration(
    features: RBFFeatures, x: Array, weights: Array
) -> tuple[Array, Array, Array]:
    """Return W^T phi (b, 3), its slope (b, 3, n) and phi (b, M): [Pesce2020] Eq. 6 and 28."""
    phi, slope = features.evaluate(x)
    return times(weights.mT, phi), weights.mT @ slope, phi


@dataclass(frozen=True)
class LearningFilter(ExtendedKalmanFilter):
    """RBFNN-EKF; with `ForgettingNoise` the RBFNN-AEKF of [Pesce2020].

    The network's acceleration is held over each step (Eq. 21), its slope enters the transition
    (Eq. 26), and its weights, one set a run, are in the state's memory as ``weights``. Process
    noise must have room for what the network does not know: it gives no covariance of its own
    (`WithWeights` does).

    Parameters
    ----------
    rule : LearningRule
        `LyapunovRule`, `GradientRule` or `PhysicsRule`.
    spread : float
        Standard deviation of the first weights, m/s2; 0 starts from nothing. The papers start
        at random.
    seed : int
        Of the first weights.
    """

    rule: LearningRule | None = None
    spread: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rule is None:
            raise ConfigError("the filter has no learning rule", do="give rule")
        if not isinstance(self.model, RungeKutta):
            raise ConfigError(
                "the model of a learning filter cannot be pushed",
                allowed="RungeKutta of a RateModel",
                do="wrap the rates in RungeKutta",
            )

    def start(self, state: FilterState) -> FilterState:
        """Check the size of a start and add the first weights."""
        state = super().start(state)
        assert self.rule is not None
        shape = (len(state.mean), self.rule.features.size, 3)
        weights = self.spread * np.random.default_rng(self.seed).normal(size=shape)
        response = np.zeros((*state.mean.shape, 3))
        memory = {"weights": weights, "response": response, **state.memory}
        return FilterState(state.mean, state.covariance, state.time, memory)

    def acceleration(self, state: FilterState) -> Array:
        """Return what the network says at the estimate, (b, 3), m/s2."""
        assert self.rule is not None
        weights = state.memory["weights"]
        return network_acceleration(self.rule.features, state.mean, weights)[0]

    def _propagate(
        self, state: FilterState, dt: float
    ) -> tuple[Array, Array, Array | None, Mapping[str, Array]]:
        assert self.rule is not None
        assert isinstance(self.model, RungeKutta)
        a, J, _ = network_acceleration(self.rule.features, state.mean, state.memory["weights"])
        model, longest = self.model.model, self.model.longest
        mean, F, push = held_push(model, state.mean, a, state.time, dt, longest)
        return mean, F + push @ J, None, {"push": push}

    def _learned(self, predicted: Predicted, updated: Updated) -> Updated:
        updated = super()._learned(predicted, updated)
        assert self.rule is not None
        if "push" not in predicted.state.memory:  # the first epoch: nothing was predicted
            return updated
        # what an acceleration held ever since the start would have done to the estimate
        before = predicted.previous.memory["response"]
        left = np.eye(before.shape[1]) - updated.gain @ updated.design
        response = left @ (predicted.transition @ before + predicted.state.memory["push"])
        updated = remember(updated, {"response": response})
        return remember(updated, {"weights": self.rule.weights(predicted, updated)})
