"""What is constant in each scenario: body, known model, family of orbits, sampling, noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, RADIUS_OF
from unmodeled.datasets.bodies import load_body

__all__ = ["DESIGNS", "STATIONS", "Design"]

_DAY = 86_400.0
_MINUTE = 60.0
#: Stations of the leo_tracking scenario: three sites of the Deep Space Network, rounded.
STATIONS = {
    "goldstone": {"latitude": "35.34 deg", "longitude": "-116.89 deg", "height": "970 m"},
    "canberra": {"latitude": "-35.40 deg", "longitude": "148.98 deg", "height": "690 m"},
    "madrid": {"latitude": "40.43 deg", "longitude": "-4.25 deg", "height": "830 m"},
}


@dataclass(frozen=True)
class Design:
    """What is constant in a scenario.

    Parameters
    ----------
    content : mapping
        Keys of the case file: body, frame, spacecraft, known ...
    years : (int, int)
        Its epoch lies from the first day of the first year to that of the second.
    elements : callable
        Draws semi-major axis (m), eccentricity and inclination (rad) of an orbit.
    gm : float
        Of the central body, m3/s2.
    days : float
        Length of the arc.
    step : float
        Between samples, s.
    sigma : float
        Of positions or ranges, m; range rates have a thousandth a second.
    guess : float
        Error of the stated initial state as a share of position and velocity.
    tracked : bool
        Ranges and range rates from the stations, not positions.
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


def _craft(mass: float, area: float) -> dict[str, Any]:
    return {"mass": f"{mass} kg", "area": f"{area} m2"}


def _bodies(*names: str) -> list[dict[str, Any]]:
    return [{"effect": "third_body", "body": name} for name in names]


def _inclined(low: float, high: float) -> Callable[[np.random.Generator], float]:
    """Uniform over the sphere of orbit normals between two inclinations in degrees."""
    a, b = np.cos(np.radians([high, low]))
    return lambda rng: float(np.arccos(rng.uniform(a, b)))


def _bennu() -> Design:
    return Design(
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


def _eros() -> Design:
    return Design(
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


def _leo() -> Design:
    radius = RADIUS_OF["earth"].value

    def elements(rng: np.random.Generator) -> tuple[float, float, float]:
        low, e = rng.uniform(500e3, 900e3), rng.uniform(0.001, 0.02)
        return (radius + low) / (1 - e), e, _inclined(20, 110)(rng)

    return Design(
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


def _leo_tracking() -> Design:
    plain = _leo()
    return Design(
        {**plain.content, "stations": STATIONS},
        plain.years,
        plain.elements,
        plain.gm,
        days=1.0,
        step=0.5 * _MINUTE,
        sigma=1.0,
        tracked=True,
    )


def _meo() -> Design:
    return Design(
        {"body": "earth", "spacecraft": _craft(1000, 10), "known": _earth(4)},
        (2010, 2020),
        lambda rng: (rng.uniform(18e6, 30e6), rng.uniform(0.001, 0.2), _inclined(20, 110)(rng)),
        load_body("earth").gm,
        days=3.0,
        step=10 * _MINUTE,
        sigma=0.3,
    )


def _geo() -> Design:
    return Design(
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


def _lunar() -> Design:
    radius = RADIUS_OF["moon"].value

    def elements(rng: np.random.Generator) -> tuple[float, float, float]:
        low, e = rng.uniform(100e3, 300e3), rng.uniform(0.001, 0.03)
        return (radius + low) / (1 - e), e, _inclined(20, 160)(rng)

    return Design(
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


def _cislunar() -> Design:
    return Design(
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


def _heliocentric() -> Design:
    au = ASTRONOMICAL_UNIT.value
    gm = GM_OF["sun"].value
    return Design(
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


#: By the name of the scenario; a function, so that cards are read when they are needed.
DESIGNS: dict[str, Callable[[], Design]] = {
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
