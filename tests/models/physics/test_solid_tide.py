"""The tidal bulge against the coefficients of the IERS Conventions and against J2."""

import math

import numpy as np
import pytest

from unmodeled.core.constants import GM_OF
from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import Dynamics, PointMass, SolidTide, SphericalHarmonics, Zonal
from unmodeled.models.physics.tracks import Tracks

EPS = np.finfo(float).eps
SUN, MOON = np.array([3.0, -2.0, 2.5]), np.array([-1.0, 4.0, -2.0])
STILL = Tracks(-1.0, 1.0, {"sun": SUN[None], "moon": MOON[None]})
VALUES = {"tide_k2": 0.3, "R_ref": 0.9, "GM_sun": 2.0, "GM_moon": 0.7}


def points(n=20):
    x = np.random.default_rng(5).normal(size=(n, 3))
    return 1.5 * x / np.linalg.norm(x, axis=1, keepdims=True)


def test_it_is_the_change_of_coefficients_of_the_iers_conventions():
    """[IERS2010] Eq. 6.6: dC - i dS = k2 / 5 sum (GM_b/GM) (R/s)^3 P2m(sin phi) e^(-i m lambda)."""
    gm, change = 1.3, {}
    for m in range(3):
        total = 0.0
        for mass, s in ((2.0, SUN), (0.7, MOON)):
            d = np.linalg.norm(s)
            u, w = s[2] / d, math.hypot(s[0], s[1]) / d
            legendre = (1.5 * u * u - 0.5, 3 * u * w, 3 * w * w)[m]
            norm = math.sqrt(
                (1 if m == 0 else 2) * 5 * math.factorial(2 - m) / math.factorial(2 + m)
            )
            total += (
                mass
                / gm
                * (0.9 / d) ** 3
                * norm
                * legendre
                * np.exp(-1j * m * math.atan2(s[1], s[0]))
            )
        change[f"C_2_{m}"] = 0.3 / 5 * total.real
        if m:
            change[f"S_2_{m}"] = -0.3 / 5 * total.imag
    field = Dynamics([SphericalHarmonics(2)], {"GM": gm, "R_ref": 0.9} | change)
    tide = Dynamics([SolidTide()], VALUES, tracks=STILL)
    expected = field.acceleration(points())
    bound = 50 * EPS * np.abs(expected).max()
    np.testing.assert_allclose(tide.acceleration(points()), expected, rtol=0, atol=bound)
    np.testing.assert_allclose(tide.potential(points()), field.potential(points()), atol=1e-16)


def test_a_body_over_the_pole_raises_a_negative_j2():
    pole = Tracks(-1.0, 1.0, {"moon": np.array([[0.0, 0.0, 5.0]])})
    tide = Dynamics(
        [SolidTide(["moon"])], {"tide_k2": 0.3, "R_ref": 0.9, "GM_moon": 0.7}, tracks=pole
    )
    j2 = -0.3 * 0.7 / 1.3 * (0.9 / 5.0) ** 3
    field = Dynamics([Zonal((2,))], {"GM": 1.3, "R_ref": 0.9, "J2": j2})
    expected = field.acceleration(points())
    np.testing.assert_allclose(
        tide.acceleration(points()), expected, rtol=0, atol=50 * EPS * np.abs(expected).max()
    )


def test_sizes_of_the_card():
    values = {"tide_k2": 0.3, "R_ref": 6378136.3} | {
        f"GM_{b}": GM_OF[b].value for b in ("sun", "moon")
    }
    tracks = Tracks(
        -1.0, 1.0, {"sun": np.array([[1.496e11, 0, 0]]), "moon": np.array([[3.844e8, 0, 0]])}
    )
    model = Dynamics([SolidTide()], values, tracks=tracks)
    low, lageos = np.abs(model.acceleration([[6.878e6, 0, 0], [0, 0, 1.227e7]])).max(axis=1)
    # at new moon: below both bodies, and across (half of it, at (6.878 / 12.27)^4)
    assert low == pytest.approx(5.4e-7, rel=0.05)
    assert lageos == pytest.approx(2.6e-8, rel=0.05)


def test_the_bodies_are_different_and_each_tide_comes_once():
    with pytest.raises(ConfigError) as caught:
        SolidTide(("moon", "moon"))
    assert str(caught.value) == (
        "the solid tide is raised by ('moon', 'moon'). Allowed: different bodies."
    )
    with pytest.raises(ConfigError, match='contains "solid tide moon" twice'):
        Dynamics([PointMass(), SolidTide(), SolidTide(("moon",))], tracks=STILL)
