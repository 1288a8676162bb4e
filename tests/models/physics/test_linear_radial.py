"""The rival of relativity: a radial acceleration that grows with distance."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from unmodeled.core.constants import ASTRONOMICAL_UNIT, DAY, GM_OF
from unmodeled.models.physics import Dynamics, LinearRadial, PointMass

AU = ASTRONOMICAL_UNIT.value


def test_the_periapsis_turns_at_the_rate_of_the_card():
    e, k = 0.3, 1e-6
    model = Dynamics([PointMass(), LinearRadial()], {"GM": 1.0, "linear_radial_k": k})
    start = [1 - e, 0, 0, 0, math.sqrt((1 + e) / (1 - e)), 0]
    revolutions = 20
    orbit = model.propagate(start, np.linspace(0, 2 * math.pi * revolutions, 2001))
    x, v = orbit[:, :2], orbit[:, 3:5]
    h = x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]
    vector = np.stack([v[:, 1] * h, -v[:, 0] * h], axis=1) - x / np.linalg.norm(x, axis=1)[:, None]
    angle = math.atan2(vector[-1, 1], vector[-1, 0]) / revolutions
    # first order in k; the next term is k itself
    assert angle == pytest.approx(3 * math.pi * k * math.sqrt(1 - e * e), rel=1e-4, abs=0)


def test_a_far_ring_pulls_like_it_in_its_plane():
    mass, b, r = 0.7, 100.0, 1.0

    def towards(angle):
        dx, dy = b * math.cos(angle) - r, b * math.sin(angle)
        return mass / (2 * math.pi) * dx / (dx * dx + dy * dy) ** 1.5

    pull = quad(towards, 0, 2 * math.pi, epsabs=1e-15)[0]
    a = Dynamics([LinearRadial()], {"linear_radial_k": mass / (2 * b**3)}).acceleration([[r, 0, 0]])
    # the next term of the ring is (r / b)^2 of this one
    assert a[0, 0] == pytest.approx(pull, rel=2e-4, abs=0)


def test_size_of_the_card():
    a, e, period = 0.387098 * AU, 0.20563, 87.9691 * DAY.value
    advance = math.radians(42.98 / 3600) / (36525 * DAY.value / period)
    k = advance * GM_OF["sun"].value / (3 * math.pi * a**3 * math.sqrt(1 - e * e))
    assert k == pytest.approx(3.7e-20, rel=0.02, abs=0)
