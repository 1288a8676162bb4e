"""Filters whose tuning is wrong by a factor that is drawn for each run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.core.seeds import Streams
from unmodeled.pipeline.filters.adaptive import ForgettingNoise
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.interfaces import ProcessNoise
from unmodeled.pipeline.filters.learning_filter import LearningFilter
from unmodeled.pipeline.filters.observer import FullStateObserver
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.navigation.contestants import Contestant, build
from unmodeled.pipeline.navigation.flight import Flight, draw
from unmodeled.pipeline.navigation.learning_contestants import Recorded
from unmodeled.pipeline.navigation.scenario_config import ScenarioConfig

__all__ = ["ScaledNoise", "draw_factors", "mistune", "off_nominal"]


@dataclass(frozen=True)
class ScaledNoise:
    """Process noise of each run times its own factor.

    Parameters
    ----------
    base : ProcessNoise
        One that does not learn.
    factor : ndarray (b,)
    """

    base: ProcessNoise
    factor: Array

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (b, n, n)."""
        scaled: Array = self.factor[:, None, None] * self.base.covariance(state, dt)
        return scaled


@dataclass(frozen=True)
class _ScaledForgetting(ForgettingNoise):
    """The noise of [Pesce2020] Eq. 27 from a first Q that is wrong in each run."""

    factor: Array | None = None

    def start(self, state: FilterState) -> Mapping[str, Array]:
        assert self.factor is not None
        return {"Q": self.factor[:, None, None] * self.Q}


def draw_factors(runs: int, seed: int, decades: float = 2.0) -> Array:
    """Return factors (runs,), uniform in their logarithm over ``decades`` about 1."""
    rng = Streams(seed).generator("navigate.off_nominal")
    factors: Array = 10.0 ** (decades * (rng.uniform(size=runs) - 0.5))
    return factors


def mistune(contestant: Contestant, factor: Array) -> Contestant:
    """Return a contestant whose Q, or gain for an observer, is ``factor`` (b,) times what it was.

    Raises
    ------
    ConfigError
        For a filter that has neither.
    """
    filter_ = contestant.filter
    if isinstance(filter_, Recorded):
        inner = _wrong(filter_.inner, factor)
        assert isinstance(inner, LearningFilter)
        recorded = Recorded(inner)
        return Contestant(recorded, contestant.start, recorded.read)
    return replace(contestant, filter=_wrong(filter_, factor))


def _wrong(filter_: object, factor: Array) -> ExtendedKalmanFilter:
    if isinstance(filter_, FullStateObserver):
        assert filter_.rate is not None
        wrong = replace(filter_)
        # one gain a run, which the field's own check of its shape does not allow a user
        object.__setattr__(wrong, "rate", factor[:, None, None] * filter_.rate)
        return wrong
    if not isinstance(filter_, ExtendedKalmanFilter):
        raise ConfigError(
            f"a filter of type {type(filter_).__name__} has no Q", allowed="extended Kalman filters"
        )
    if isinstance(filter_.noise, ForgettingNoise):
        return replace(
            filter_, noise=_ScaledForgetting(filter_.noise.Q, filter_.noise.alpha, factor)
        )
    return replace(filter_, noise=ScaledNoise(filter_.noise, factor))


def off_nominal(
    config: ScenarioConfig,
    flight: Flight,
    names: tuple[str, ...],
    decades: float = 2.0,
    tell: Callable[[str, float], None] = lambda text, share: None,
) -> pd.DataFrame:
    """Fly filters with Q (the observer: gain) wrong by a factor drawn for each run.

    [Pesce2020] section IV.D: uniform about the nominal value over two orders of magnitude, which
    is read as uniform in the logarithm. All filters get the same factors and the same draws.

    Parameters
    ----------
    config : ScenarioConfig
        Gives runs, seed and the nominal tuning.
    flight : Flight
    names : tuple of str
    decades : float
        From the smallest factor to the largest.
    tell : callable

    Returns
    -------
    DataFrame
        One row a filter and run: ``filter``, ``run``, ``factor``, ``position_rmse_m``,
        ``velocity_rmse_m_s`` (NaN where the filter diverged).
    """
    starts, z = draw(flight, config.runs, config.seed)
    factor = draw_factors(config.runs, config.seed, decades)
    scale = flight.scale
    parts = []
    for number, name in enumerate(names):
        tell(f"flying {name}", (number + 0.2) / (len(names) + 0.2))
        nominal = build(name, flight, starts, config.tuning.get(name, {}))
        wrong = mistune(nominal, factor)
        position = velocity = np.full(config.runs, np.nan)
        try:
            run = run_filter(wrong.filter, wrong.start, flight.times, z, flight.used)
        except NumericalError:
            pass
        else:
            error = (run.mean[:, :, :6] - flight.truth[:, None])[flight.settled]
            position = scale.length * np.sqrt((error[..., :3] ** 2).sum(axis=2).mean(axis=0))
            velocity = scale.speed * np.sqrt((error[..., 3:] ** 2).sum(axis=2).mean(axis=0))
        parts.append(
            pd.DataFrame(
                {
                    "filter": name,
                    "run": np.arange(config.runs),
                    "factor": factor,
                    "position_rmse_m": position,
                    "velocity_rmse_m_s": velocity,
                }
            )
        )
    return pd.concat(parts, ignore_index=True)
