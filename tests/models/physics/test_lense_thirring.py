"""Frame dragging: node of LAGEOS, no work done."""

import math

import numpy as np

from unmodeled.core.constants import SPEED_OF_LIGHT
from unmodeled.models.physics import Dynamics, LenseThirring, PointMass

C = SPEED_OF_LIGHT.value
EARTH = {"GM": 3.986004418e14, "lense_thirring_J": 9.8e8}  # [IERS2010] section 10.3


def node_and_inclination(orbit):
    h = np.cross(orbit[:, :3], orbit[:, 3:])
    return np.unwrap(np.arctan2(h[:, 0], -h[:, 1])), np.arccos(h[:, 2] / np.linalg.norm(h, axis=1))


def test_node_of_lageos():
    a, inclination = 12_270e3, math.radians(109.84)
    n = math.sqrt(EARTH["GM"] / a**3)
    revolutions, boost = 50, 1e4
    times = np.linspace(0, revolutions * 2 * math.pi / n, 100 * revolutions, endpoint=False)
    v = n * a
    start = [a, 0, 0, 0, v * math.cos(inclination), v * math.sin(inclination)]
    expected = 2 * EARTH["GM"] * EARTH["lense_thirring_J"] / (C**2 * a**3)
    year = 365.25 * 86400
    mas = expected * year * math.degrees(1) * 3600e3
    assert abs(mas - 30.7) < 0.1  # LAGEOS-1, e = 0.0045; J is known to 1 part in 100
    # The scale makes 1e4 of it, so that the drift stands above the rounding of the node.
    model = Dynamics([PointMass(), LenseThirring()], EARTH | {"lense_thirring_scale": boost})
    orbit = model.propagate(start, times)
    node, tilt = node_and_inclination(orbit)
    rate = np.polyfit(times, node, 1)[0]
    # The node swings within a revolution by less than it drifts in one. A straight line through N
    # whole periods of a sine of amplitude A is wrong in its slope by 6 A / (pi N^2) a period.
    assert abs(rate / (boost * expected) - 1) < 6 / (math.pi * revolutions**2)
    assert np.ptp(tilt) < 5 * boost * expected * 2 * math.pi / n
    energy = 0.5 * np.sum(orbit[:, 3:] ** 2, axis=1) - EARTH["GM"] / np.linalg.norm(
        orbit[:, :3], axis=1
    )
    assert np.ptp(energy) < 1e-13 * v * v  # it does no work


def test_no_work_and_by_hand():
    generator = np.random.default_rng(6)
    states = generator.normal(size=(20, 6))
    values = {"GM": 2.0, "c": 5.0, "lense_thirring_J": 0.7}
    a = Dynamics([LenseThirring()], values).acceleration(states)
    r, v = states[:, :3], states[:, 3:]
    d = np.linalg.norm(r, axis=1, keepdims=True)
    spin = np.array([0, 0, 0.7])
    by_hand = (
        2
        * 2.0
        / (25 * d**3)
        * (3 / d**2 * np.cross(r, v) * (r @ spin)[:, None] + np.cross(v, spin))
    )
    np.testing.assert_allclose(a, by_hand, rtol=0, atol=1e-14 * np.abs(by_hand).max())
    assert np.abs(np.sum(a * v, axis=1)).max() < 1e-14 * np.abs(by_hand).max() * 10


def test_size_in_low_earth_orbit():
    r = 6.878e6  # DIAGNOSIS: 2e-10 m/s2; polar orbit, over the equator
    v = math.sqrt(EARTH["GM"] / r)
    a = Dynamics([LenseThirring()], EARTH).acceleration([[r, 0, 0, 0, v, 0]])[0]
    assert abs(np.linalg.norm(a) - 2e-10) < 0.1e-10
    assert a[0] > 0  # a prograde equatorial orbit is pushed out
