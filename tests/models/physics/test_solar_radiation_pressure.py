"""Sunlight: inverse square, away from the Sun, none in the shadow."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.models.physics.orbits import kepler_orbit

from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, RADIUS_OF
from unmodeled.models.physics import Dynamics, PointMass, SolarRadiationPressure
from unmodeled.models.physics.tracks import Tracks

AU, GM, EARTH, SUN = (
    ASTRONOMICAL_UNIT.value,
    GM_OF["earth"].value,
    RADIUS_OF["earth"].value,
    RADIUS_OF["sun"].value,
)
LAGEOS = {"srp_CrA_m": 7.85e-4}


def still(sun):
    return Tracks(-1.0, 1e7, {"sun": np.array([sun], dtype=float)})


def free_share(c, a, b):
    """Share of a disc of radius a that one of radius b >= a leaves free, centres c apart.

    [MontenbruckGill2000] Eq. 3.87-3.94, angles as lengths.
    """
    if c >= a + b:
        return 1.0
    if c <= b - a:
        return 0.0
    x = (c * c + a * a - b * b) / (2 * c)
    y = math.sqrt(max(a * a - x * x, 0.0))
    hidden = a * a * math.acos(x / a) + b * b * math.acos((c - x) / b) - c * y
    return 1.0 - hidden / (math.pi * a * a)


def across_the_penumbra(r, u):
    """Positions at distance r behind the Earth, Sun on +x, u half-widths from the middle."""
    angle = np.arcsin(EARTH / r) + SUN / AU * u
    return r * np.stack([-np.cos(angle), np.sin(angle), 0 * angle], axis=1)


@pytest.mark.parametrize(
    ("r", "largest"), [(6.6e6, 0.025), (1.22e7, 0.025), (4.2164e7, 0.0265), (3.844e8, 0.046)]
)
def test_the_share_of_light_is_that_of_two_discs(r, largest):
    tracks = still([AU, 0, 0])
    x = across_the_penumbra(r, np.linspace(-4, 4, 801))
    dark = Dynamics([SolarRadiationPressure()], LAGEOS | {"shadow_radius": EARTH}, tracks=tracks)
    light = Dynamics([SolarRadiationPressure(shadow=False)], LAGEOS, tracks=tracks)
    share = dark.acceleration(x)[:, 0] / light.acceleration(x)[:, 0]
    to_sun = [AU, 0, 0] - x
    d = np.linalg.norm(to_sun, axis=1)
    c = np.arctan2(np.linalg.norm(np.cross(x, to_sun), axis=1), -np.sum(x * to_sun, axis=1))
    a, b = np.arcsin(SUN / d), math.asin(EARTH / r)
    exact = np.array([free_share(ci, ai, b) for ci, ai in zip(c, a, strict=True)])
    u = (c - b) / a
    assert np.abs(share - exact).max() < largest
    assert np.abs(share - exact)[np.abs(u) > 3].max() < 1e-4
    assert np.all(np.diff(share[np.argsort(u)]) > -1e-12)
    # the push through the whole penumbra, in its half-widths
    assert abs(np.trapezoid(share - exact, u)) < (4e-3 if r < 1e8 else 0.04)


def test_entry_and_exit_are_where_geometry_puts_them():
    """A circular orbit about the Sun line: half the light is gone where sin(phase) = R / r."""
    r = 6.878e6
    model = Dynamics(
        [SolarRadiationPressure()],
        LAGEOS | {"shadow_radius": EARTH},
        tracks=still([1e3 * AU, 0, 0]),
    ).with_values({"sun_radius": 1e3 * SUN, "au": 1e3 * AU})
    phase = np.linspace(0.5, 1.5, 100_001) * np.pi
    x = r * np.stack([np.cos(phase), np.sin(phase), 0 * phase], axis=1)
    push = -model.acceleration(x)[:, 0] / (4.56e-6 * 7.85e-4)
    # The share is 1/2 where Sun's centre and the Earth's limb coincide: parallel light.
    crossing = phase[1:][np.diff(np.sign(push - 0.5)) != 0]
    edge = math.asin(EARTH / r)
    np.testing.assert_allclose(crossing, [np.pi - edge, np.pi + edge], rtol=0, atol=3.2e-5)


def test_sizes_of_the_card():
    model = Dynamics([SolarRadiationPressure(shadow=False)], LAGEOS, tracks=still([0, AU, 0]))
    a = model.acceleration([[1.2e7, 0, 0]])[0]
    assert a[1] == pytest.approx(-3.58e-9, rel=1e-3)
    # away from the Sun means towards the central body and beyond, a little along +x
    assert a[0] == pytest.approx(3.58e-9 * 1.2e7 / AU, rel=1e-3, abs=0)
    near = model.with_values({"au": AU * 2})
    assert near.acceleration([[1.2e7, 0, 0]])[0][1] == pytest.approx(4 * a[1], rel=1e-12, abs=0)


@pytest.mark.parametrize(("r", "tolerance"), [(6.878e6, 1e-5), (1.2163e7, 1e-5), (2.656e7, 1e-5)])
def test_the_edges_of_the_shadow_are_seen(r, tolerance):
    """Two revolutions through shadows: the offset that light makes, against scipy's DOP853.

    Encke's form: the deviation from the Kepler orbit alone, so scipy's tolerance is of the light.
    """
    values = {"GM": GM, "shadow_radius": EARTH} | LAGEOS
    model = Dynamics(
        [PointMass(), SolarRadiationPressure()], values, tracks=still([0.8 * AU, 0.6 * AU, 0])
    )
    light = Dynamics(
        [SolarRadiationPressure()],
        {k: v for k, v in values.items() if k != "GM"},
        tracks=model.tracks,
    )
    speed = math.sqrt(GM / r)
    start = np.array([r, 0, 0, 0, speed * math.cos(0.3), speed * math.sin(0.3)])
    end = 4 * math.pi * math.sqrt(r**3 / GM)

    def kepler(t):
        return kepler_orbit(start, GM, [0.0, t])[1] if t else start

    def deviation(t, y):
        k = kepler(t)[:3]
        q = y[:3] @ (y[:3] + 2 * k) / (k @ k)
        x = k + y[:3]
        pull = -GM / np.linalg.norm(k) ** 3 * (y[:3] + x * np.expm1(-1.5 * np.log1p(q)))
        return np.concatenate([y[3:], pull + light.acceleration(x[None], t)[0]])

    # steps shorter than the penumbra, which scipy too would pass over
    width = 2 * r * SUN / AU / speed
    out = solve_ivp(
        deviation, (0, end), np.zeros(6), "DOP853", rtol=1e-9, atol=1e-10, max_step=2 * width
    )
    expected = out.y[:3, -1]

    offset = model.propagate(start, [0.0, end])[-1, :3] - kepler(end)[:3]
    assert np.linalg.norm(expected) > 0.02
    np.testing.assert_allclose(offset, expected, rtol=0, atol=tolerance)
    # and the sensitivity to the area is the same offset, per unit: light is a small effect
    orbit = model.propagate_variational(start, [0.0, end], ["srp_CrA_m"])
    by_area = orbit.sensitivity[-1, :3, 0] * LAGEOS["srp_CrA_m"]
    np.testing.assert_allclose(by_area, expected, rtol=0, atol=10 * tolerance)
