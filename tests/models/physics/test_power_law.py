"""Hall's power law."""

import math

import numpy as np

from unmodeled.core.constants import ASTRONOMICAL_UNIT
from unmodeled.models.physics import Dynamics, PointMass, PowerLawGravity

SUN, AU = 1.32712440018e20, ASTRONOMICAL_UNIT.value


def test_with_the_point_mass_it_is_a_power():
    x = np.random.default_rng(1).normal(size=(50, 3)) * 2
    r = np.linalg.norm(x, axis=1, keepdims=True)
    for delta in (0.0, 1e-7, 0.3, -0.4):
        values = {"GM": 1.7, "power_law_delta": delta, "power_law_r0": 1.2}
        model = Dynamics([PointMass(), PowerLawGravity()], values)
        by_hand = -1.7 * x / r**3 * (r / 1.2) ** -delta
        np.testing.assert_allclose(model.acceleration(x), by_hand, rtol=1e-13)


def test_a_tiny_exponent_keeps_its_digits():
    delta = 1.57e-7
    x = np.array([[2.0, 0, 0], [0.5, 0, 0]])
    a = Dynamics([PowerLawGravity()], {"power_law_delta": delta}).acceleration(x)
    by_hand = -np.expm1(-delta * np.log(x[:, 0])) / x[:, 0] ** 2
    np.testing.assert_allclose(a[:, 0], by_hand, rtol=1e-13)


def test_the_perihelion_of_mercury_needs_halls_number():
    # Nearly circular: the apsidal angle of r^-(2 + delta) is pi / sqrt(1 - delta) ([Hall1894]),
    # which is pi delta a revolution. DIAGNOSIS 5.1: 1.57e-7 fits Mercury.
    a, e, delta = 0.38709893 * AU, 0.20563069, 1.57e-7
    period = 2 * math.pi * math.sqrt(a**3 / SUN)
    boost = 1e3
    values = {"GM": SUN, "power_law_delta": boost * delta, "power_law_r0": a}
    times = np.linspace(0, 20 * period, 4000, endpoint=False)
    start = [a * (1 - e), 0, 0, 0, math.sqrt(SUN / a * (1 + e) / (1 - e)), 0]
    orbit = Dynamics([PointMass(), PowerLawGravity()], values).propagate(start, times)
    x, v = orbit[:, :3], orbit[:, 3:]
    ecc = np.cross(v, np.cross(x, v)) / SUN - x / np.linalg.norm(x, axis=1, keepdims=True)
    rate = np.polyfit(times, np.arctan2(ecc[:, 1], ecc[:, 0]), 1)[0] * period
    # to e^2 / 4 = 0.01 for the eccentricity and delta / e for the swing within a revolution
    assert abs(rate / (math.pi * boost * delta) - 1) < 0.05
    century = 36525 * 86400 / period
    assert abs(rate / boost * century * math.degrees(1) * 3600 - 42.98) < 2.0
