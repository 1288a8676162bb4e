"""The observer of [Pesce2020]: a network in a filter whose gain the user has chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.learning_filter import LearningFilter
from unmodeled.pipeline.filters.learning_rules import LyapunovRule
from unmodeled.pipeline.filters.observer import FullStateObserver
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.navigation.contestants import Contestant, Entry, begin, register
from unmodeled.pipeline.navigation.flight import Flight
from unmodeled.pipeline.navigation.learning_contestants import Recorded, features_of

__all__ = ["LearningObserver"]


@dataclass(frozen=True)
class LearningObserver(FullStateObserver, LearningFilter):
    """dx/dt = A x + d(x) + K (z - x), d an RBF network: [Pesce2020] Eq. 33."""


def _observer(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    if len(flight.measurement.R) != 6:
        raise ConfigError(
            f"{flight.title} measures {len(flight.measurement.R)} of six states",
            allowed="position and velocity measured",
            do="leave the observer out of the filters",
        )
    gain = np.diag(np.repeat([n["position_gain"], n["velocity_gain"]], 3))
    inner = LearningObserver(
        RungeKutta(flight.base, flight.longest),
        flight.measurement,
        WhiteAcceleration(n["noise"] ** 2),
        rule=LyapunovRule(features_of(flight, int(n["neurons"]), n["eta"]), n["rate"], raw=True),
        rate=gain,
    )
    recorded = Recorded(inner)
    return Contestant(recorded, begin(flight, starts), recorded.read)


_NAN = float("nan")
register(
    Entry(
        "observer",
        "RBF network, fixed gain",
        {
            "position_gain": _NAN,
            "velocity_gain": _NAN,
            "noise": _NAN,
            "rate": _NAN,
            "neurons": 30.0,
            "eta": 1.0,
        },
        _observer,
        "learned",
    )
)
