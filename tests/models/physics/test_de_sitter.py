"""Geodetic precession: all orbits turn together about the pole of the ecliptic."""

import numpy as np
import pytest

from unmodeled.core.constants import GM_OF, SPEED_OF_LIGHT
from unmodeled.core.ephemeris import load_ephemeris
from unmodeled.models.physics import DeSitter, Dynamics, PointMass
from unmodeled.models.physics.tracks import Tracks

AU, YEAR = 149_597_870_700.0, 365.25 * 86_400.0
ARCSECOND = np.radians(1 / 3600)
EFFECT = DeSitter()
POLE = np.array([p.value for p in EFFECT.parameters if p.name[-2:] in ("_x", "_y", "_z")])
H = next(p.value for p in EFFECT.parameters if p.name == "de_sitter_h")


def model(scale, sun=AU):
    return Dynamics(
        [PointMass(), EFFECT],
        {"GM": 3.986e14, "GM_sun": GM_OF["sun"].value, "de_sitter_scale": scale},
        tracks=Tracks(0.0, 1e9, {"sun": np.array([[sun, 0.0, 0.0]])}),
    )


def test_the_rate_is_that_of_the_textbooks():
    """1.92 arc seconds a century, [IERS2010] section 10.1: the acceleration is 2 Omega x v."""
    v = np.array([[7e6, 0, 0, 0, 3e3, 7e3]])
    push = Dynamics([EFFECT], {"GM_sun": GM_OF["sun"].value}, tracks=model(1.0).tracks)
    omega = np.linalg.norm(push.acceleration(v)) / 2 / np.linalg.norm(np.cross(POLE, v[0, 3:]))
    assert omega * 100 * YEAR / ARCSECOND == pytest.approx(1.92, abs=0.005)
    assert np.linalg.norm(push.acceleration(v)) < 1e-10


def test_the_pole_and_momentum_are_those_of_the_earths_orbit():
    times = np.linspace(0.0, YEAR, 400)
    epoch = "2000-01-01T12:00:00 TDB"
    sky = load_ephemeris()
    x = np.array([sky.position("earth", "sun", epoch, times + s) for s in (-500.0, 0.0, 500.0)])
    momentum = np.cross(x[1], (x[2] - x[0]) / 1e3).mean(axis=0)
    # the Moon moves the Earth by 12 m/s of 30 km/s, which a year averages out
    assert np.linalg.norm(momentum) == pytest.approx(H, rel=1e-4)
    np.testing.assert_allclose(momentum / np.linalg.norm(momentum), POLE, atol=1e-4)


@pytest.mark.parametrize("start", [[7e6, 0, 0, 0, 2e3, 7e3], [3e7, 0, 1e7, 0, 3e3, 1e3]])
def test_every_orbit_turns_about_the_ecliptics_pole(start):
    """To first order the orbit is the undisturbed one, turned by Omega t."""
    scale, times = 1e4, np.linspace(0.0, 4e4, 9)
    with_it, without = (model(s).propagate(start, times) for s in (scale, 0.0))
    omega = scale * 1.5 * H * GM_OF["sun"].value / (SPEED_OF_LIGHT.value**2 * AU**3)
    # velocities in turning axes: the same state in both at the start is not the same orbit
    start_turned = np.array(start, dtype=float)
    start_turned[3:] -= omega * np.cross(POLE, start_turned[:3])
    still = model(0.0).propagate(start_turned, times)
    angle = omega * times[:, None]
    along = still[:, :3] @ POLE
    turned = (
        still[:, :3] * np.cos(angle)
        + np.cross(POLE, still[:, :3]) * np.sin(angle)
        + POLE * along[:, None] * (1 - np.cos(angle))
    )
    moved = np.linalg.norm(with_it[:, :3] - without[:, :3], axis=1).max()
    # what is left is of second order in Omega t
    assert np.linalg.norm(with_it[:, :3] - turned, axis=1).max() < 1e-4 * moved
