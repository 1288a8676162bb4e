"""A mascon is a point mass elsewhere, and turns with the body."""

import math

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import Dynamics, Mascon, PointMass

PLACE = np.array([0.3, -0.2, 0.1])
VALUES = {"mascon1_GM": 0.15} | dict(
    zip(("mascon1_x", "mascon1_y", "mascon1_z"), PLACE, strict=True)
)


def points(n=50):
    x = np.random.default_rng(8).normal(size=(n, 3))
    return 1.5 * x / np.linalg.norm(x, axis=1, keepdims=True)


def test_it_is_a_shifted_point_mass():
    mascon, mass = Dynamics([Mascon()], VALUES), Dynamics([PointMass()], {"GM": 0.15})
    x = points()
    expected = mass.acceleration(x - PLACE)
    np.testing.assert_allclose(mascon.acceleration(x), expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(mascon.potential(x), mass.potential(x - PLACE), rtol=1e-14)


def test_nothing_is_taken_out():
    # far away: the total mass at the common centre of mass, up to the quadrupole
    far = 1e4 * points()
    model = Dynamics([PointMass(), Mascon()], VALUES | {"GM": 1.0})
    centre = 0.15 * PLACE / 1.15
    one = Dynamics([PointMass()], {"GM": 1.15}).acceleration(far - centre)
    scale = 1.15 / 1.5e4**2
    assert np.abs(model.acceleration(far) - one).max() < 5 * (0.4 / 1.5e4) ** 2 * scale


def test_it_turns_with_the_body():
    spin, t = 0.3, 2.0
    model = Dynamics([Mascon()], VALUES | {"spin_rate": spin, "prime_meridian": 0.1}, spinning=True)
    angle = 0.1 + spin * t
    c, s = math.cos(angle), math.sin(angle)
    place = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ PLACE
    expected = Dynamics([PointMass()], {"GM": 0.15}).acceleration(points() - place)
    np.testing.assert_allclose(model.acceleration(points(), t), expected, rtol=0, atol=1e-15)


def test_two_mascons():
    both = Dynamics(
        [Mascon(), Mascon(2)],
        VALUES | {"mascon2_GM": -0.15, "mascon2_x": 0.3, "mascon2_y": -0.2, "mascon2_z": 0.1},
    )
    assert np.abs(both.acceleration(points())).max() < 1e-16
    with pytest.raises(ConfigError, match='contains "mascon 2" twice'):
        Dynamics([Mascon(2), Mascon(2)])
    with pytest.raises(ConfigError, match=r"^mascon index is 0\. Allowed: 1 or more\.$"):
        Mascon(0)


def test_lunar_mascon_size():
    # the card: 2e-5 of the Moon's mass, 170 km deep
    model = Dynamics([Mascon()], {"mascon1_GM": 2e-5 * 4.9028e12, "mascon1_x": 1_738e3 - 170e3})
    surface, high = np.linalg.norm(model.acceleration([[1_738e3, 0, 0], [1_838e3, 0, 0]]), axis=1)
    assert abs(surface - 3.4e-3) < 0.05e-3
    assert abs(high - 1.3e-3) < 0.05e-3
