"""The network of [Fereoli2024]: trained on what DMC estimated, and fed back into the filter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.gauss_markov import GaussMarkov, WithGaussMarkov
from unmodeled.pipeline.filters.residual_network import (
    ResidualNetwork,
    relative_percent,
    train_residual_network,
)
from unmodeled.pipeline.filters.run import FilterRun, run_filter
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.with_residual import WithResidual
from unmodeled.pipeline.navigation.contestants import Contestant, begin, build, more_states
from unmodeled.pipeline.navigation.flight import Flight, draw

__all__ = ["TrainedNetwork", "fed_back", "train_on_dmc"]


@dataclass(frozen=True)
class TrainedNetwork:
    """A network and how wrong it is.

    Parameters
    ----------
    network : ResidualNetwork
    label_percent : float
        Against all estimates of DMC of that run, a fifth of them held out: [Fereoli2024] Eq. 31.
    truth_percent : float
        Against the true disturbance along the true states, which the paper does not state.
    """

    network: ResidualNetwork
    label_percent: float
    truth_percent: float

    @property
    def sentence(self) -> str:
        """What it learned."""
        label, truth = self.label_percent, self.truth_percent
        return (
            f"The network was trained on the DMC estimates of one run: {label:.1f} % off "
            f"these estimates, {truth:.1f} % off the truth."
        )


def train_on_dmc(
    flight: Flight, seed: int, sigma: float, time_constant: float, epochs: int = 3000
) -> TrainedNetwork:
    """Fly DMC once and train on its estimates after settling.

    The draws are those of the first run of another seed: the network has not seen the
    measurements that it is flown with.
    """
    starts, z = draw(flight, 1, seed + 1)
    dmc = build("dmc", flight, starts, {"sigma": sigma, "time_constant": time_constant})
    run = run_filter(dmc.filter, dmc.start, flight.times, z, flight.used)
    counted = flight.settled
    labels = run.mean[counted, 0, 6:9]
    network = train_residual_network(
        run.mean[counted, 0, :6], labels, epochs=epochs, learning_rate=3e-3, seed=seed
    )
    # An axis on which nothing was estimated gets nothing: training leaves a small output there.
    varies = np.ptp(labels, axis=0) > 0.0
    network = replace(network, y_scale=np.where(varies, network.y_scale, 0.0))
    said, _, _ = network.evaluate(flight.truth[counted], 0.0)
    fitted, _, _ = network.evaluate(run.mean[counted, 0, :6], 0.0)
    return TrainedNetwork(
        network,
        relative_percent(labels, fitted),
        relative_percent(flight.disturbance[counted], said),
    )


def fed_back(
    flight: Flight, starts: Array, network: ResidualNetwork, sigma: float, time_constant: float
) -> Contestant:
    """Return DMC about the network: its states need only hold what the network got wrong."""
    if not sigma > 0.0:
        raise ConfigError(f"sigma is {sigma}", allowed="> 0")
    model = WithGaussMarkov(WithResidual(flight.base, network), time_constant)
    noise = GaussMarkov.of_sigma(time_constant, sigma)
    steps = flight.flown(RungeKutta(model, flight.longest))

    def believed(run: FilterRun) -> Array:
        net = np.stack([network.evaluate(x[:, :6], 0.0)[0] for x in run.mean])
        both: Array = net + run.mean[:, :, 6:9]
        return both

    return Contestant(
        ExtendedKalmanFilter(steps, more_states(flight.measurement, 9), noise),
        begin(flight, starts, 3, sigma),
        believed,
    )
