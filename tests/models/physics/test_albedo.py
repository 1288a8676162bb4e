"""Light sent back by the body, against the integral over a Lambert sphere."""

import math

import numpy as np
import pytest

from unmodeled.core.constants import ASTRONOMICAL_UNIT, RADIUS_OF
from unmodeled.models.physics import Albedo, Dynamics
from unmodeled.models.physics.tracks import Tracks

AU, EARTH = ASTRONOMICAL_UNIT.value, RADIUS_OF["earth"].value
STILL = Tracks(-1.0, 1.0, {"sun": np.array([[0.0, 0.0, AU]])})
#: 4.56e-6 N/m2 times this is 1 m/s2 of sunlight.
ONE = 1 / 4.56e-6


def model(**values):
    given = {"shadow_radius": EARTH, "srp_CrA_m": ONE} | values
    return Dynamics([Albedo()], given, tracks=STILL)


def places(r, cosines):
    return r * np.stack([np.sqrt(1 - cosines**2), 0 * cosines, cosines], axis=1)


def lambert(r, c, n=300):
    """Radial flux times r^2 over a white unit sphere, the Sun at angle acos(c) from the viewer."""
    m, weight = np.polynomial.legendre.leggauss(n)
    low = 1 / r
    m, weight = low + (1 - low) * (m + 1) / 2, weight * (1 - low) / 2
    phi = (np.arange(n) + 0.5) * 2 * math.pi / n
    m, phi = m[:, None], phi[None]
    lit = np.maximum(c * m + math.sqrt(1 - c * c) * np.sqrt(1 - m * m) * np.cos(phi), 0)
    d2 = r * r + 1 - 2 * r * m
    flux = lit / math.pi * (r * m - 1) * (r - m) / d2**2
    return r * r * np.sum(flux * weight[:, None]) * 2 * math.pi / n


@pytest.mark.parametrize(("r", "largest"), [(100.0, 0.006), (1.93, 0.027), (1.08, 0.07)])
def test_reflected_light_is_that_of_a_lambert_sphere(r, largest):
    c = np.linspace(-1, 1, 21)
    white = model(body_albedo=1.0, body_emissivity=0.0)
    a = white.acceleration(places(r * EARTH, c))
    radial = np.linalg.norm(a, axis=1) * np.sign(np.sum(a * places(1.0, c), axis=1)) * r * r
    exact = np.array([lambert(r, k) for k in c])
    assert np.abs(radial - exact).max() < largest
    # what the body takes in it sends out: a quarter, over all directions
    nodes, weights = np.polynomial.legendre.leggauss(8)
    a = white.acceleration(places(r * EARTH, nodes))
    mean = np.sum(a * places(1.0, nodes), axis=1) @ weights / 2
    assert mean * r * r == pytest.approx(0.25, rel=1e-12)


def test_heat_is_the_same_all_around():
    black = model(body_albedo=0.0, body_emissivity=0.68)
    a = black.acceleration(places(2 * EARTH, np.linspace(-1, 1, 9)))
    np.testing.assert_allclose(np.linalg.norm(a, axis=1), 0.68 / 4 / 4, rtol=1e-12)
    nearer = Tracks(-1.0, 1.0, {"sun": np.array([[0.0, 0.0, AU / 2]])})
    twice = Dynamics([Albedo()], black.values, tracks=nearer)
    np.testing.assert_allclose(twice.acceleration(places(2 * EARTH, np.zeros(1))), 4 * a[4:5])


def test_sizes_of_the_card():
    lageos = model(srp_CrA_m=7.85e-4)
    noon, night = lageos.acceleration(places(1.227e7, np.array([1.0, -1.0])))[:, 2]
    assert noon == pytest.approx(4.7e-10, rel=0.03)
    assert night == pytest.approx(-1.7e-10, rel=0.03)
    low = model().acceleration(places(6.878e6, np.array([1.0, -1.0])))[:, 2]
    assert 0.3 < low[0] < 0.5
    assert 0.1 < -low[1] < 0.2
