"""Scenarios: a body, a known model, an orbit drawn from a seed, and when it is measured.

Within a scenario the structure (effects, times, kinds) is constant and only numbers are drawn, so
that all its cases share their compilations.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, RADIUS_OF
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.core.seeds import Streams
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import state_from_elements

__all__ = ["SCENARIOS", "Flight", "Plan", "Scenario", "scenario"]

_DAY = 86_400.0
_MINUTE = 60.0
#: Stations of the leo_tracking scenario: three sites of the Deep Space Network, rounded.
_STATIONS = {
    "goldstone": {"latitude": "35.34 deg", "longitude": "-116.89 deg", "height": "970 m"},
    "canberra": {"latitude": "-35.40 deg", "longitude": "148.98 deg", "height": "690 m"},
    "madrid": {"latitude": "40.43 deg", "longitude": "-4.25 deg", "height": "830 m"},
}


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


@dataclass(frozen=True)
class _Design:
    """What is constant in a scenario.

    ``elements`` draws (a in m, e, i in rad) of an orbit; ``guess`` is the standard deviation of
    the initial state's error as a share of position and velocity.
    """

    content: Mapping[str, Any]
    years: tuple[int, int]
    elements: Callable[[np.random.Generator], tuple[float, float, float]]
    gm: float
    days: float
    step: float
    sigma: float
    guess: float = 1e-5
    tracked: bool = False


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
    if name not in _DESIGNS:
        raise ConfigError(
            f'there is no scenario "{name}"',
            allowed=", ".join(SCENARIOS),
            do=nearest(name, SCENARIOS),
        )
    design = _DESIGNS[name]()
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
    design: _Design, streams: Streams, key: str, name: str, start: float, end: float
) -> Flight:
    rng = streams.generator(f"scenario.{key}")
    a, e, inclination = design.elements(rng)
    angles = rng.uniform(0, 2 * np.pi, 3)
    state = state_from_elements([[a, e, inclination, *angles]], design.gm)[0]
    size = np.repeat([np.linalg.norm(state[:3]), np.linalg.norm(state[3:])], 3)
    guess = state + design.guess * size * rng.normal(size=6)
    # The first sample follows the initial state: a tag may be late.
    count = round((end - start) / design.step)
    times = start + design.step * np.arange(1, count + 1)
    return Flight(name, start, end, state, guess, name != "arc 1", times)


def _plans(design: _Design) -> tuple[Plan, ...]:
    if not design.tracked:
        return (Plan("positions.csv", "position", design.sigma),)
    return tuple(
        Plan(f"{station}-{kind.replace('_', '-')}.csv", kind, sigma, station)
        for station in _STATIONS
        for kind, sigma in (("range", design.sigma), ("range_rate", 1e-3 * design.sigma))
    )


def _craft(mass: float, area: float) -> dict[str, Any]:
    return {"mass": f"{mass} kg", "area": f"{area} m2"}


def _bodies(*names: str) -> list[dict[str, Any]]:
    return [{"effect": "third_body", "body": name} for name in names]


def _inclined(low: float, high: float) -> Callable[[np.random.Generator], float]:
    """Uniform over the sphere of orbit normals between two inclinations in degrees."""
    a, b = np.cos(np.radians([high, low]))
    return lambda rng: float(np.arccos(rng.uniform(a, b)))


def _bennu() -> _Design:
    return _Design(
        {
            "body": "bennu",
            "frame": "body_equator",
            "spacecraft": _craft(1500, 12),
            "known": [
                {"effect": "point_mass"},
                {"effect": "zonal", "degrees": [2, 3, 4]},
                *_bodies("sun"),
            ],
        },
        (2019, 2020),
        lambda rng: (rng.uniform(600, 1000), rng.uniform(0.02, 0.25), _inclined(30, 150)(rng)),
        load_body("bennu").gm,
        days=3.0,
        step=10 * _MINUTE,
        sigma=0.5,
    )


def _eros() -> _Design:
    return _Design(
        {
            "body": "eros",
            "frame": "body_equator",
            "spacecraft": _craft(800, 10),
            "known": [
                {"effect": "point_mass", "free": {"GM": "100 m3/s2"}},
                {"effect": "zonal", "degrees": [2, 3, 4]},
                *_bodies("sun"),
                {"effect": "srp"},
            ],
        },
        (2019, 2021),
        lambda rng: (rng.uniform(40e3, 60e3), rng.uniform(0.02, 0.2), _inclined(90, 165)(rng)),
        load_body("eros").gm,
        days=3.0,
        step=10 * _MINUTE,
        sigma=0.5,
    )


def _earth(degree: int, *more: dict[str, Any]) -> list[dict[str, Any]]:
    field = {"effect": "spherical_harmonics", "degree": degree, "order": degree}
    return [{"effect": "point_mass"}, field, *_bodies("moon", "sun"), *more]


def _leo() -> _Design:
    radius = RADIUS_OF["earth"].value

    def elements(rng: np.random.Generator) -> tuple[float, float, float]:
        low, e = rng.uniform(500e3, 900e3), rng.uniform(0.001, 0.02)
        return (radius + low) / (1 - e), e, _inclined(20, 110)(rng)

    return _Design(
        {
            "body": "earth",
            "spacecraft": _craft(500, 3),
            "known": _earth(8, {"effect": "srp"}),
        },
        (2010, 2020),
        elements,
        load_body("earth").gm,
        days=1.0,
        step=2 * _MINUTE,
        sigma=1.0,
    )


def _leo_tracking() -> _Design:
    plain = _leo()
    return _Design(
        {**plain.content, "stations": _STATIONS},
        plain.years,
        plain.elements,
        plain.gm,
        days=2.0,
        step=0.5 * _MINUTE,
        sigma=1.0,
        tracked=True,
    )


def _meo() -> _Design:
    return _Design(
        {"body": "earth", "spacecraft": _craft(1000, 10), "known": _earth(4)},
        (2010, 2020),
        lambda rng: (rng.uniform(18e6, 30e6), rng.uniform(0.001, 0.2), _inclined(20, 110)(rng)),
        load_body("earth").gm,
        days=3.0,
        step=10 * _MINUTE,
        sigma=0.3,
    )


def _geo() -> _Design:
    return _Design(
        {
            "body": "earth",
            "spacecraft": _craft(2500, 40),
            "known": _earth(4, {"effect": "srp"}),
        },
        (2010, 2020),
        lambda rng: (rng.uniform(42.1e6, 42.3e6), rng.uniform(1e-4, 0.02), _inclined(1, 15)(rng)),
        load_body("earth").gm,
        days=7.0,
        step=20 * _MINUTE,
        sigma=1.0,
    )


def _lunar() -> _Design:
    radius = RADIUS_OF["moon"].value

    def elements(rng: np.random.Generator) -> tuple[float, float, float]:
        low, e = rng.uniform(100e3, 300e3), rng.uniform(0.001, 0.03)
        return (radius + low) / (1 - e), e, _inclined(20, 160)(rng)

    return _Design(
        {
            "body": "moon",
            "frame": "body_equator",
            "spacecraft": _craft(1000, 8),
            "known": [
                {"effect": "point_mass"},
                {"effect": "zonal", "degrees": [2, 3, 4]},
                *_bodies("earth", "sun"),
            ],
        },
        (2010, 2020),
        elements,
        load_body("moon").gm,
        days=2.0,
        step=5 * _MINUTE,
        sigma=1.0,
    )


def _cislunar() -> _Design:
    return _Design(
        {
            "body": "earth",
            "ephemeris": "circular",
            "spacecraft": _craft(1000, 10),
            "known": [{"effect": "point_mass"}, *_bodies("moon")],
        },
        (2010, 2020),
        lambda rng: (rng.uniform(120e6, 200e6), rng.uniform(0.05, 0.3), _inclined(0, 60)(rng)),
        load_body("earth").gm,
        days=20.0,
        step=60 * _MINUTE,
        sigma=10.0,
    )


def _heliocentric() -> _Design:
    au = ASTRONOMICAL_UNIT.value
    gm = GM_OF["sun"].value
    return _Design(
        {
            "body": {
                "name": "sun",
                "gm": f"{gm!r} m3/s2",
                "brillouin_radius": f"{RADIUS_OF['sun'].value!r} m",
            },
            "known": [
                {"effect": "point_mass"},
                *_bodies("venus", "earth_moon", "mars", "jupiter", "saturn"),
            ],
        },
        (2010, 2020),
        lambda rng: (rng.uniform(1.2, 2.2) * au, rng.uniform(0.05, 0.25), _inclined(5, 40)(rng)),
        gm,
        days=548.0,
        step=1.5 * _DAY,
        sigma=1e3,
        guess=1e-6,
    )


_DESIGNS: dict[str, Callable[[], _Design]] = {
    "bennu": _bennu,
    "eros": _eros,
    "leo": _leo,
    "leo_tracking": _leo_tracking,
    "meo": _meo,
    "geo": _geo,
    "lunar": _lunar,
    "cislunar": _cislunar,
    "heliocentric": _heliocentric,
}
#: Names of the scenarios.
SCENARIOS = tuple(_DESIGNS)
