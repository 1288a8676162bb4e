"""Geometry against elements that an orbit was made from, and the shadow against sampling."""

from __future__ import annotations

import numpy as np
import pytest

from unmodeled.core.constants import RADIUS_OF
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import state_from_elements
from unmodeled.models.physics import Dynamics, PointMass
from unmodeled.models.physics.orientation import Orientation
from unmodeled.models.physics.tracks import Tracks
from unmodeled.pipeline.comparison.orbit_geometry import orbit_geometry, revolution

AU = 1.495978707e11


def dynamics(sun, body, orientation=None):
    tracks = Tracks.fit({"sun": lambda t: np.tile(sun, (len(t), 1))}, -1e7, 1e7)
    return Dynamics([PointMass()], {"GM": body.gm}, tracks=tracks, orientation=orientation)


def test_angles_are_those_of_the_elements():
    body = load_body("bennu")
    argument, anomaly = 0.7, 2.1
    state = state_from_elements([[800.0, 0.2, 0.9, 1.3, argument, anomaly]], body.gm)
    spin = Orientation.of_pole(np.eye(3), 1e-3, 0.4)
    model = dynamics([0.0, 0.0, AU], body, spin)
    g = orbit_geometry(model, body, state, np.array([100.0])).iloc[0]
    assert g["true_anomaly"] == pytest.approx(anomaly, abs=1e-9)
    assert g["argument_of_latitude"] == pytest.approx(argument + anomaly, abs=1e-9)
    assert g["radius"] == pytest.approx(800 * (1 - 0.04) / (1 + 0.2 * np.cos(anomaly)))
    assert g["altitude"] == pytest.approx(g["radius"] - body.reference_radius)
    assert np.sin(g["latitude"]) == pytest.approx(np.sin(0.9) * np.sin(argument + anomaly))
    # The body has turned by 0.4 + 1e-3 * 100 under the orbit.
    apart = g["right_ascension"] - g["longitude"] - 0.5
    assert np.cos(apart) == pytest.approx(1.0)
    # The Sun stands over the pole: its height over the plane is 90 degrees less inclination.
    assert g["sun_elevation"] == pytest.approx(np.pi / 2 - 0.9)
    assert g["sun_angle"] == pytest.approx(np.pi / 2 - g["latitude"])


@pytest.mark.parametrize("step", [-1.2, -0.6, -0.1, 0.3, 0.8, 1.3])
def test_sunlit_share_is_that_of_sampled_discs(step):
    body = load_body("earth")
    distance = 7e6
    sun = RADIUS_OF["sun"].value / AU
    earth = np.arcsin(body.reference_radius / distance)
    apart = earth + step * sun
    # Angle between Sun and Earth's centre as seen from the spacecraft; parallax is 5e-5 of it.
    place = -distance * np.array([np.cos(apart), np.sin(apart), 0.0])
    state = np.concatenate([place, [0.0, 1.0, 7e3]])[None]
    model = dynamics(place + AU * np.array([1.0, 0.0, 0.0]), body)
    share = orbit_geometry(model, body, state, np.zeros(1))["sunlit"].iloc[0]
    disc = np.random.default_rng(0).uniform(-1, 1, (400_000, 2))
    disc = disc[np.sum(disc**2, axis=1) < 1]
    # Directions of points of the Sun's disc, and how far from the Earth's centre they are.
    x, y = apart + sun * disc[:, 0], sun * disc[:, 1]
    assert share == pytest.approx(np.mean(np.hypot(x, y) > earth), abs=3e-3)


def test_what_concerns_the_sun_is_nan_where_it_is_unknown():
    body = load_body("bennu")
    state = state_from_elements([[800.0, 0.2, 0.9, 1.3, 0.7, 2.1]], body.gm)
    g = orbit_geometry(Dynamics([PointMass()], {"GM": body.gm}), body, state, np.zeros(1))
    assert g[["sun_angle", "sun_elevation", "sunlit"]].isna().all(axis=None)
    assert g["longitude"].iloc[0] == g["right_ascension"].iloc[0]


def test_revolution_is_keplers():
    body = load_body("bennu")
    period = 2 * np.pi * np.sqrt(800.0**3 / body.gm)
    times = np.linspace(0.0, 3 * period, 2000)
    state = state_from_elements([[800.0, 0.2, 0.9, 1.3, 0.7, 2.1]], body.gm)[0]
    states = Dynamics([PointMass()], {"GM": body.gm}).propagate(state, times)
    assert revolution(states, times) == pytest.approx(period, rel=1e-5)
