"""The network of [Fereoli2024]: trained on what DMC estimated, and fed back into the filter."""

from __future__ import annotations

from dataclasses import dataclass

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
from unmodeled.pipeline.filters.state import Booleans
from unmodeled.pipeline.filters.with_residual import WithResidual
from unmodeled.pipeline.navigation.contestants import Contestant, begin, build, more_states
from unmodeled.pipeline.navigation.flight import Flight, draw

__all__ = ["TrainedNetwork", "dmc_labels", "fed_back", "train_on_dmc"]


@dataclass(frozen=True)
class TrainedNetwork:
    """A network and how wrong it is.

    Parameters
    ----------
    network : ResidualNetwork
    label_percent : float
        Against the fifth of the estimates that was held out: [Fereoli2024] Eq. 31.
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
            f"estimates held out, {truth:.1f} % off the truth."
        )


def dmc_labels(
    flight: Flight, seed: int, sigma: float, time_constant: float
) -> tuple[Array, Array, Booleans]:
    """Fly DMC once; return estimated states (n, 6), disturbances (n, 3), and which epochs (k,).

    All estimates but the first guess, as [Fereoli2024]: the filter settles within a tenth of the
    flight. The draws are those of the first run of another seed: what is trained on them has not
    seen the measurements that it is flown with.
    """
    starts, z = draw(flight, 1, seed + 1)
    dmc = build("dmc", flight, starts, {"sigma": sigma, "time_constant": time_constant})
    run = run_filter(dmc.filter, dmc.start, flight.times, z, flight.used)
    counted = flight.used
    return run.mean[counted, 0, :6], run.mean[counted, 0, 6:9], counted


def train_on_dmc(
    flight: Flight, seed: int, sigma: float, time_constant: float, epochs: int = 3000
) -> TrainedNetwork:
    """Fly DMC once and train on its estimates after settling (`dmc_labels`).

    The paper trains on all of them: fed back, that was worse than DMC alone on its own orbit, and
    somewhat better on one above the surface (docs/navigate.md).

    Thirty times the rate of [Fereoli2024] and a seventieth of its epochs: as near to held out
    estimates, in ten seconds (docs/reproduce.md).
    """
    states, labels, counted = dmc_labels(flight, seed, sigma, time_constant)
    late = flight.settled[counted]
    states, labels, counted = states[late], labels[late], counted & flight.settled
    network = train_residual_network(states, labels, epochs=epochs, learning_rate=3e-3, seed=seed)
    said, _, _ = network.evaluate(flight.truth[counted], 0.0)
    return TrainedNetwork(
        network,
        network.validation_percent,
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
