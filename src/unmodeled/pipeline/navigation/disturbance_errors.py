"""How wrong filters are about the disturbance, as a length, epoch by epoch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.navigation.contestants import build
from unmodeled.pipeline.navigation.flight import Flight, draw
from unmodeled.pipeline.navigation.scenario_config import ScenarioConfig

__all__ = ["DisturbanceError", "disturbance_errors"]


@dataclass(frozen=True)
class DisturbanceError:
    """Length of the error of the estimated disturbance: [Marchese2023] Table 3.7.

    Parameters
    ----------
    length : ndarray (k, b)
        m/s2.
    mean, largest : float
        Over the epochs that count: mean over epochs and runs; of each run, then the mean.
    """

    length: Array
    mean: float
    largest: float


def disturbance_errors(
    config: ScenarioConfig, flight: Flight, names: tuple[str, ...]
) -> Mapping[str, DisturbanceError]:
    """Fly filters that estimate the disturbance.

    Parameters
    ----------
    config : ScenarioConfig
        Gives runs, seed and tuning.
    flight : Flight
    names : tuple of str

    Raises
    ------
    ConfigError
        For a filter that estimates none.
    """
    starts, z = draw(flight, config.runs, config.seed)
    found = {}
    for name in names:
        contestant = build(name, flight, starts, config.tuning.get(name, {}))
        if contestant.disturbance is None:
            raise ConfigError(f"filter {name} estimates no disturbance", do="leave it out")
        run = run_filter(contestant.filter, contestant.start, flight.times, z, flight.used)
        wrong = contestant.disturbance(run) - flight.disturbance[:, None]
        length = flight.scale.acceleration * np.linalg.norm(wrong, axis=2)
        settled = length[flight.settled]
        found[name] = DisturbanceError(
            length, float(settled.mean()), float(settled.max(axis=0).mean())
        )
    return found
