"""Scenarios: a body, a known model, an orbit drawn from a seed, and when it is measured.

Within a scenario the structure (effects, times, kinds) is constant and only numbers are drawn, so
that all its cases share their compilations.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.core.seeds import Streams
from unmodeled.datasets.elements import state_from_elements
from unmodeled.pipeline.cases.scenario_designs import DESIGNS, STATIONS, Design

__all__ = ["SCENARIOS", "Flight", "Plan", "Scenario", "scenario"]

_DAY = 86_400.0
#: Names of the scenarios.
SCENARIOS = tuple(DESIGNS)


@dataclass(frozen=True)
class Plan:
    """One set of measurements before it is made.

    Parameters
    ----------
    file : str
        Where it will be written.
    kind : str
        As in `Measurements`.
    sigma : float
        SI.
    station : str, optional
        Name of the station.
    """

    file: str
    kind: str
    sigma: float
    station: str | None = None


@dataclass(frozen=True)
class Flight:
    """One arc: its true initial state, and its place in time.

    Parameters
    ----------
    name : str
        Of the arc.
    start, end : float
        s since the epoch.
    state : ndarray (6,)
        True state at the start, m and m/s.
    guess : ndarray (6,)
        What the user knows of it.
    held_out : bool
        Not to be fitted.
    times : ndarray (n,)
        When it is measured, s; stations leave out what is below their horizon.
    """

    name: str
    start: float
    end: float
    state: Array
    guess: Array
    held_out: bool
    times: Array


@dataclass(frozen=True)
class Scenario:
    """A case without data.

    Parameters
    ----------
    name : str
        Of the scenario.
    mapping : mapping
        The case file, but for measurements and arcs.
    flights : tuple of Flight
        Its arcs.
    plans : tuple of Plan
        What is measured on each.
    """

    name: str
    mapping: Mapping[str, Any]
    flights: tuple[Flight, ...]
    plans: tuple[Plan, ...]


def scenario(name: str, seed: int, *, held_out: bool = False) -> Scenario:
    """Draw a scenario.

    Parameters
    ----------
    name : str
        One of ``SCENARIOS``.
    seed : int
        Everything drawn depends on it and on the name only.
    held_out : bool
        Add an arc of another orbit, a third as long, that is not fitted.

    Raises
    ------
    ConfigError
        If there is no such scenario.
    """
    if name not in DESIGNS:
        raise ConfigError(
            f'there is no scenario "{name}"',
            allowed=", ".join(SCENARIOS),
            do=nearest(name, SCENARIOS),
        )
    design = DESIGNS[name]()
    streams = Streams(seed)
    rng = streams.generator(f"scenario.{name}")
    first = datetime.date(design.years[0], 1, 1)
    last = datetime.date(design.years[1], 1, 1)
    day = first + datetime.timedelta(days=int(rng.integers((last - first).days)))
    length = design.days * _DAY
    flights = [_flight(design, streams, f"{name}.fit", "arc 1", 0.0, length)]
    if held_out:
        start = length + _DAY
        flights.append(
            _flight(design, streams, f"{name}.held_out", "arc 2", start, start + length / 3)
        )
    mapping = {
        "name": f"{name.replace('_', '-')}-{seed}",
        "epoch": f"{day.isoformat()}T00:00:00 TDB",
        **design.content,
        "seed": seed,
    }
    return Scenario(name, mapping, tuple(flights), _plans(design))


def _flight(
    design: Design, streams: Streams, key: str, name: str, start: float, end: float
) -> Flight:
    rng = streams.generator(f"scenario.{key}")
    a, e, inclination = design.elements(rng)
    angles = rng.uniform(0, 2 * np.pi, 3)
    state = state_from_elements([[a, e, inclination, *angles]], design.gm)[0]
    size = np.repeat([np.linalg.norm(state[:3]), np.linalg.norm(state[3:])], 3)
    guess: Array = state + design.guess * size * rng.normal(size=6)
    # The first sample follows the initial state: a tag may be late.
    count = round((end - start) / design.step)
    times = start + design.step * np.arange(1, count + 1, dtype=np.float64)
    return Flight(name, start, end, state, guess, name != "arc 1", times)


def _plans(design: Design) -> tuple[Plan, ...]:
    if not design.tracked:
        return (Plan("positions.csv", "position", design.sigma),)
    return tuple(
        Plan(f"{station}-{kind.replace('_', '-')}.csv", kind, sigma, station)
        for station in STATIONS
        for kind, sigma in (("range", design.sigma), ("range_rate", 1e-3 * design.sigma))
    )
