"""Hidden drag and sunlight with shadow: learned with the inputs they depend on, and only then.

Arcs of one revolution 620 km above the Earth, in planes and with Suns drawn at random, flown with
the package's own effects; tested on other planes and Suns.
"""

from functools import cache

import numpy as np
import pytest

from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, RADIUS_OF
from unmodeled.models.learned import (
    ELM,
    ExactGP,
    InputFeatures,
    NearestNeighbour,
    RBFNetwork,
    SparseGP,
)
from unmodeled.models.physics import Dynamics, ExponentialDrag, PointMass, SolarRadiationPressure
from unmodeled.models.physics.tracks import Tracks

GM, EARTH = GM_OF["earth"].value, RADIUS_OF["earth"].value
AIR = {"drag_B": 0.022, "drag_rho0": 1.5e-12, "drag_r0": EARTH + 5e5, "drag_H": 6e4}
LIGHT = {"srp_CrA_m": 0.02, "shadow_radius": EARTH}
LENGTH = 7e6
SPEED = np.sqrt(GM / LENGTH)
UNIT = 1e-7  # m/s2; the drag is 1.1e-7, sunlight 0.9e-7 outside the shadow

ALL = ("position", "velocity", "sun_direction", "sun_cosine")


def arc(rng, count=30):
    """Scaled positions, velocities, Sun directions and hidden accelerations of one revolution."""
    radius = EARTH + rng.uniform(6.18e5, 6.22e5)
    normal, sun = rng.normal(size=3), rng.normal(size=3)
    sun /= np.linalg.norm(sun)
    along = np.cross(normal, rng.normal(size=3))
    along /= np.linalg.norm(along)
    across = np.cross(normal / np.linalg.norm(normal), along)
    start = np.concatenate([radius * along, np.sqrt(GM / radius) * across])
    tracks = Tracks(-1.0, 1e5, {"sun": ASTRONOMICAL_UNIT.value * sun[None]})
    air, light = ExponentialDrag(), SolarRadiationPressure()
    times = np.arange(count) / count * 2 * np.pi * np.sqrt(radius**3 / GM)
    whole = Dynamics([PointMass(), air, light], AIR | LIGHT | {"GM": GM}, tracks=tracks)
    states = whole.propagate(start, times)
    pushes = [
        Dynamics([effect], values, tracks=tracks).acceleration(states, times) / UNIT
        for effect, values in ((air, AIR), (light, LIGHT))
    ]
    return states[:, :3] / LENGTH, states[:, 3:] / SPEED, np.tile(sun, (count, 1)), *pushes


@cache
def arcs(count, seed):
    rng = np.random.default_rng(seed)
    rows = [arc(rng) for _ in range(count)]
    return tuple(np.concatenate(column) for column in zip(*rows, strict=True))


def error(learner, names, which=(3, 4)):
    """Root mean square error on other arcs, as a share of that of predicting nothing."""
    features = InputFeatures(names)

    def made(data):
        inputs = features.of(data[0], velocities=data[1], sun_directions=data[2])
        return inputs, sum(data[k] for k in which)

    X, y = made(arcs(16, 0))
    at, truth = made(arcs(5, 1))
    found = learner.fit(X, y).predict(at)
    return np.sqrt(np.mean((found - truth) ** 2) / np.mean(truth**2))


@pytest.mark.parametrize(
    ("make", "limit"),
    [
        pytest.param(
            lambda: ExactGP(optimizer="lbfgs", epochs=8, ard=True), 0.3, marks=pytest.mark.slow
        ),
        (lambda: ExactGP(optimizer="newton"), 0.4),
        (lambda: SparseGP(inducing=100, iterations=15), 0.4),
        (lambda: RBFNetwork(centres=200), 0.5),
        (ELM, 0.6),
        (NearestNeighbour, 0.9),
    ],
    ids=["exact_gp ard", "exact_gp", "sparse_gp", "rbf_network", "elm", "nearest_neighbour"],
)
def test_drag_and_sunlight_need_velocity_and_sun(make, limit):
    """Limits are about twice the errors seen: the point is below against above one."""
    assert error(make(), ("position",)) > 0.85
    assert error(make(), ALL) < limit


def test_each_effect_needs_its_own_input():
    gp = ExactGP(optimizer="newton")
    drag, light = (3,), (4,)
    assert error(gp, ("position", "sun_direction"), drag) > 0.85
    assert error(gp, ("position", "velocity"), light) > 0.85
    assert error(SparseGP(inducing=100, iterations=15), ("position", "velocity"), drag) < 0.1
    # the edge of the shadow stays unsharp
    assert error(gp, ("position", "sun_direction", "sun_cosine"), light) < 0.5
    # radial and transverse speed do not say which way the spacecraft flies
    assert error(gp, ("position", "velocity_rtn"), drag) > 0.85
