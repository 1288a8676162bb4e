"""Ephemerides against DE421, eclipses, and the distances that a mission reported."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, SPEED_OF_LIGHT
from unmodeled.core.ephemeris import AnalyticEphemeris
from unmodeled.core.ephemeris_pairs import PLANETS
from unmodeled.core.kepler_orbit import HeliocentricOrbit
from unmodeled.core.time import seconds_between
from unmodeled.datasets.bodies import heliocentric_orbits

AU = ASTRONOMICAL_UNIT.value
DAY = 86_400.0
ANALYTIC = AnalyticEphemeris(heliocentric_orbits())

#: Largest difference to DE421 from 1990 to 2040, relative to the distance from the Sun (the Moon:
#: from the Earth), as the docstring of AnalyticEphemeris states it; 1.2 for other random instants.
STATED = {
    "earth": 7.2e-8,
    "moon": 8.6e-5,
    "mercury": 2.3e-5,
    "venus": 2.6e-5,
    "mars": 1.3e-4,
    "jupiter": 2.3e-4,
    "saturn": 4.0e-4,
    "uranus": 2.6e-4,
    "neptune": 3.2e-5,
}


@pytest.fixture(scope="module")
def de421():
    pytest.importorskip("jplephem", reason="jplephem is not installed")
    module = pytest.importorskip("de421", reason="the package de421 (27 MB) is not installed")
    from jplephem.ephem import Ephemeris

    return Ephemeris(module)


def jpl_position(de421, body, jd):
    """Heliocentric (the Moon: geocentric) position in metres."""
    if body == "moon":
        return de421.position("moon", jd).T * 1e3
    sun = de421.position("sun", jd)
    if body == "earth":
        earth = de421.position("earthmoon", jd) - de421.earth_share * de421.position("moon", jd)
        return (earth - sun).T * 1e3
    return (de421.position(body, jd) - sun).T * 1e3


@pytest.mark.parametrize("body", list(STATED))
def test_series_are_as_near_to_de421_as_stated(de421, body):
    # TDB as the epoch's scale: the difference to TT is far below the tolerance.
    days = np.sort(np.random.default_rng(1).uniform(0.0, 18_262.0, 3000))
    jpl = jpl_position(de421, body, 2_447_892.5 + days)
    centre = "earth" if body == "moon" else "sun"
    ours = ANALYTIC.position(body, centre, "1990-01-01T00:00:00 TDB", days * DAY)
    error = np.linalg.norm(ours - jpl, axis=1) / np.linalg.norm(jpl, axis=1)
    assert error.max() < 1.2 * STATED[body]
    assert error.max() > 0.3 * STATED[body]  # the statement is not idle either


@pytest.mark.parametrize(
    ("greatest", "gamma"),
    [
        # Time (TT) and gamma (equatorial radii) of NASA's catalogue of solar eclipses.
        ("2017-08-21T18:26:40 TT", 0.4367),
        ("2024-04-08T18:18:29 TT", 0.3431),
    ],
)
def test_eclipses_happen_when_and_where_they_did(greatest, gamma):
    """The axis of the Moon's shadow passes the Earth's centre at gamma radii."""
    times = np.arange(-900.0, 900.0, 10.0)
    earth = ANALYTIC.position("earth", "sun", greatest, times)
    distance = np.linalg.norm(ANALYTIC.position("moon", "earth", greatest, times), axis=1)
    # The shadow that reaches the Earth left the Moon 1.2 s before.
    moon = ANALYTIC.position("moon", "sun", greatest, times - distance / SPEED_OF_LIGHT.value)
    axis = moon / np.linalg.norm(moon, axis=1, keepdims=True)
    miss = np.linalg.norm(np.cross(earth, axis), axis=1) / 6_378_137.0
    # 15 km of error of the Moon are 0.0024 radii; it moves 0.55 km/s along the shadow's path.
    assert miss.min() == pytest.approx(gamma, abs=0.004)
    assert times[miss.argmin()] == pytest.approx(0.0, abs=60.0)


@pytest.mark.parametrize(
    ("when", "million_km"),
    [
        # OSIRIS-REx at Bennu: arrival (NASA: 122 million km), touch-and-go (207 million miles).
        ("2018-12-03T17:00:00 UTC", 122.0),
        ("2020-10-20T22:00:00 UTC", 333.1),
    ],
)
def test_bennu_is_where_osiris_rex_found_it(when, million_km):
    seen = ANALYTIC.position("bennu", "earth", when, [0.0])[0]
    assert np.linalg.norm(seen) / 1e9 == pytest.approx(million_km, rel=3e-3)


def carried(orbit, end):
    """State of an independent integration with all planets, tracks from daily splines."""
    span = seconds_between(orbit.epoch, end)
    grid = np.arange(-DAY, span + 2 * DAY, DAY / 2)
    others = [p for p in PLANETS if p != "sun"]
    track = CubicSpline(
        grid, np.stack([ANALYTIC.position(p, "sun", orbit.epoch, grid) for p in others], axis=1)
    )
    gms = np.array([GM_OF[p].value for p in others])[:, None]
    gm, c2 = GM_OF["sun"].value, SPEED_OF_LIGHT.value**2

    def rates(t, y):
        r, v = y[:3], y[3:]
        size = np.linalg.norm(r)
        sun = -gm * r / size**3
        sun = sun + gm / (c2 * size**3) * ((4 * gm / size - v @ v) * r + 4 * (r @ v) * v)
        p = track(t)
        d = p - r
        pull = d / np.linalg.norm(d, axis=1, keepdims=True) ** 3
        pull -= p / np.linalg.norm(p, axis=1, keepdims=True) ** 3
        return np.concatenate([v, sun + np.sum(gms * pull, axis=0)])

    h = 60.0
    p = orbit.position(orbit.epoch, h * np.arange(-2, 3))
    v = (8 * (p[3] - p[1]) - (p[4] - p[0])) / (12 * h)
    run = solve_ivp(
        rates, (0.0, span), np.concatenate([p[2], v]), method="DOP853", rtol=1e-10, atol=1e-2
    )
    return run.y[:, -1]


def test_bennus_card_is_jpls_solution_carried_to_2019():
    # As printed by JPL Horizons, solution 118 of 2021-01-07.
    printed = HeliocentricOrbit.from_degrees(
        "2011-01-01T00:00:00 TDB",
        1.1263910258948120,
        0.2037450762416414,
        6.0349437702479403,
        2.060866195696420,
        66.22306084084298,
        101.7039520024729,
    )
    card = heliocentric_orbits()["bennu"]
    state = carried(printed, card.epoch)
    h = 60.0
    p = card.position(card.epoch, h * np.arange(-2, 3))
    v = (8 * (p[3] - p[1]) - (p[4] - p[0])) / (12 * h)
    # The series of the planets in place of DE421 make the difference.
    assert np.linalg.norm(state[:3] - p[2]) < 1e-5 * AU
    assert np.linalg.norm(state[3:] - v) < 1e-5 * np.linalg.norm(v)
    # Without the planets the same elements are off by far more: the test can fail.
    assert np.linalg.norm(printed.position(card.epoch, [0.0])[0] - p[2]) > 0.02 * AU
