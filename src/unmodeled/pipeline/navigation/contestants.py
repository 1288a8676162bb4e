"""The filters that a flight can be flown with, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.pipeline.filters.adaptive import MatchedNoise
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.gauss_markov import GaussMarkov, WithGaussMarkov
from unmodeled.pipeline.filters.interfaces import MeasurementModel, ProcessModel
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration
from unmodeled.pipeline.filters.run import Filter, FilterRun
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.navigation.flight import Flight

__all__ = ["Contestant", "Entry", "build", "contestant_names", "entry", "register"]

#: Accelerations (k, b, 3) that a filter believes in beyond its base model.
Disturbance: TypeAlias = Callable[[FilterRun], Array]


@dataclass(frozen=True)
class Contestant:
    """A filter that is ready to fly.

    Parameters
    ----------
    filter : Filter
    start : FilterState
    disturbance : callable, optional
        Reads the estimated disturbance from a run; None for a filter that estimates none.
    """

    filter: Filter
    start: FilterState
    disturbance: Disturbance | None = None


@dataclass(frozen=True)
class Entry:
    """A filter as the catalogue knows it.

    Parameters
    ----------
    name, title : str
    tuning : mapping of str to float
        Numbers that may be set, with their defaults; NaN means that one must be given.
    make : callable
        Takes flight, first guesses (b, 6) and the numbers.
    role : {"simple", "learned", "reference"}
    """

    name: str
    title: str
    tuning: Mapping[str, float]
    make: Callable[[Flight, Array, Mapping[str, float]], Contestant]
    role: str = "simple"


_ENTRIES: dict[str, Entry] = {}


def register(made: Entry) -> Entry:
    """Add a filter to the catalogue."""
    _ENTRIES[made.name] = made
    return made


def contestant_names() -> tuple[str, ...]:
    """Names for ``filters:`` and ``--filters``."""
    _load()
    return tuple(_ENTRIES)


def entry(name: str) -> Entry:
    """Return a filter of the catalogue.

    Raises
    ------
    ConfigError
        With the nearest name.
    """
    _load()
    if name not in _ENTRIES:
        raise ConfigError(f'no filter "{name}"', do=nearest(name, _ENTRIES))
    return _ENTRIES[name]


def build(name: str, flight: Flight, starts: Array, tuning: Mapping[str, float]) -> Contestant:
    """Return a filter for a flight.

    Parameters
    ----------
    name : str
    flight : Flight
    starts : ndarray (b, 6)
        First guesses.
    tuning : mapping of str to float
        Numbers that replace the defaults.

    Raises
    ------
    ConfigError
        Unknown name or number, or a number that must be given.
    """
    found = entry(name)
    for key in tuning:
        if key not in found.tuning:
            raise ConfigError(
                f'tuning of filter "{name}" has "{key}"', do=nearest(key, found.tuning)
            )
    numbers = dict(found.tuning) | dict(tuning)
    missing = [key for key, value in numbers.items() if np.isnan(value)]
    if missing:
        raise ConfigError(
            f'filter "{name}" has no {", ".join(missing)}',
            do=f"give it in the scenario: tuning: {{{name}: {{{missing[0]}: ...}}}}",
        )
    return found.make(flight, starts, numbers)


def begin(flight: Flight, starts: Array, more: int = 0, sigma: npt.ArrayLike = 0.0) -> FilterState:
    """Return a start with ``more`` states of zero mean and standard deviations ``sigma``."""
    mean = np.hstack([starts, np.zeros((len(starts), more))])
    P = np.diag(np.concatenate([flight.believed_sigma, np.full(more, sigma)]) ** 2)
    return FilterState.of(mean, P, float(flight.times[0]))


def base_model(flight: Flight) -> ProcessModel:
    """Return the base of a flight as steps: exact where it knows how, integrated otherwise."""
    steps = getattr(flight.base, "propagate", None)
    model: ProcessModel = flight.base if steps else RungeKutta(flight.base, flight.longest)  # type: ignore[assignment]
    return flight.flown(model)


def more_states(measurement: MeasurementModel, size: int) -> MeasurementModel:
    """Return the measurement of a state that has further components behind its first six."""
    return _Wider(measurement, size)


@dataclass(frozen=True)
class _Wider:
    inner: MeasurementModel
    size: int

    @property
    def R(self) -> Array:  # noqa: N802
        return self.inner.R

    def h(self, x: Array, t: float) -> tuple[Array, Array]:
        z, H = self.inner.h(x[:, :6], t)
        wide = np.zeros((len(H), H.shape[1], self.size))
        wide[:, :, :6] = H
        return z, wide


def white_noise_filter(
    flight: Flight,
    starts: Array,
    model: ProcessModel,
    noise: float,
    disturbance: Disturbance | None = None,
) -> Contestant:
    """Return the extended filter of a model with white acceleration of density ``noise``^2."""
    filter_ = ExtendedKalmanFilter(model, flight.measurement, WhiteAcceleration(noise**2))
    return Contestant(filter_, begin(flight, starts), disturbance)


def _kf(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    return white_noise_filter(flight, starts, base_model(flight), n["noise"])


def _matched(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    noise = MatchedNoise(WhiteAcceleration(n["noise"] ** 2), window=n["window"])
    return Contestant(
        ExtendedKalmanFilter(base_model(flight), flight.measurement, noise), begin(flight, starts)
    )


def _dmc(order: Literal[1, 2]) -> Callable[[Flight, Array, Mapping[str, float]], Contestant]:
    def make(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
        tau, sigma = n["time_constant"], n["sigma"]
        model = WithGaussMarkov(flight.base, tau, order)
        noise = GaussMarkov.of_sigma(tau, sigma, order)
        steps = flight.flown(RungeKutta(model, flight.longest))
        start = begin(flight, starts, 3 * order, sigma)
        if order == 2:
            P = start.covariance.copy()
            P[:, 9:, 9:] = np.eye(3) * (sigma / tau) ** 2
            start = FilterState.of(start.mean, P, start.time)
        return Contestant(
            ExtendedKalmanFilter(steps, more_states(flight.measurement, 6 + 3 * order), noise),
            start,
            lambda run: run.mean[:, :, 6:9],
        )

    return make


def _exact(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    model = flight.flown(RungeKutta(flight.exact, flight.longest))
    return white_noise_filter(flight, starts, model, n["noise"])


def _nonlinear(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    if flight.nonlinear is None:
        raise ConfigError(
            f"{flight.title} has no nonlinear model of the papers", do="leave it out of the filters"
        )
    model = flight.flown(RungeKutta(flight.nonlinear, flight.longest))
    return white_noise_filter(flight, starts, model, n["noise"])


_NAN = float("nan")
register(Entry("kf", "base model, white noise", {"noise": _NAN}, _kf))
register(
    Entry(
        "matched",
        "base model, noise matched to innovations",
        {"noise": _NAN, "window": 500.0},
        _matched,
    )
)
register(
    Entry("dmc", "base model, DMC of first order", {"sigma": _NAN, "time_constant": _NAN}, _dmc(1))
)
register(
    Entry(
        "dmc2", "base model, DMC of second order", {"sigma": _NAN, "time_constant": _NAN}, _dmc(2)
    )
)
register(Entry("nonlinear", "nonlinear model of the papers", {"noise": _NAN}, _nonlinear))
register(Entry("exact", "true model", {"noise": _NAN}, _exact, "reference"))


def _load() -> None:
    """Import the modules that register further filters."""
    import unmodeled.pipeline.navigation.learning_contestants
    import unmodeled.pipeline.navigation.observer_contestant
    import unmodeled.pipeline.navigation.periodic_contestant  # noqa: F401
