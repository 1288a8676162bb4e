"""Continuous thrust: velocity change, direction, spiral."""

import math

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import ContinuousThrust, Dynamics, PointMass


def test_velocity_change_in_a_straight_line():
    values = {"thrust_a_V": 0.01, "thrust_t_on": 100.0, "thrust_t_off": 250.0, "thrust_width": 0.3}
    orbit = Dynamics([ContinuousThrust()], values).propagate([0, 0, 0, 3.0, 4.0, 0], [0.0, 400.0])
    gained = orbit[1, 3:] - orbit[0, 3:]
    # Integral of each switch from 0 to the end: t + w^2 / (2 T) at either side
    bound = 0.01 * 0.3**2 / 2 * (4 / 100)
    np.testing.assert_allclose(gained, 1.5 * np.array([0.6, 0.8, 0]), rtol=0, atol=bound)


def test_circular_orbit_spirals_out():
    # da/dt = 2 a / n while it is on; brakes with a negative sign
    for direction, name in (("velocity", "thrust_a_V"), ("rtn", "thrust_a_T")):
        for push in (1e-8, -1e-8):
            values = {name: push, "thrust_t_on": 10.0, "thrust_t_off": 40.0, "thrust_width": 0.01}
            model = Dynamics([PointMass(), ContinuousThrust(direction)], values)
            end = model.propagate([1.0, 0, 0, 0, 1, 0], [0.0, 60.0])[-1]
            a = 1 / (2 / np.linalg.norm(end[:3]) - end[3:] @ end[3:])
            # second order: 1.5 (a - 1), and tails of the switches w^2 / T
            assert abs((a - 1) / (2 * push * 30) - 1) < 3 * 60 * abs(push) + 1e-5


def test_on_and_off():
    values = {"thrust_a_R": 2.0, "thrust_t_on": 5.0, "thrust_t_off": 8.0, "thrust_width": 1e-3}
    model = Dynamics([ContinuousThrust("rtn")], values)
    states = np.tile([1.0, 0, 0, 0, 1, 0], (4, 1))
    a = model.acceleration(states, [4.0, 5.0, 6.5, 9.0])[:, 0]
    np.testing.assert_allclose(a, [0, 1, 2, 0], rtol=0, atol=2 * 1e-6)  # w^2 / (4 T^2), twice
    assert abs(model.acceleration(states[:1], [0.0])[0, 0]) < 1e-7


def test_directions_that_make_no_sense():
    with pytest.raises(
        ConfigError, match=r'^direction of the thrust is "up"\. Allowed: "velocity" or'
    ):
        ContinuousThrust("up")


def test_half_open_is_nothing():
    values = {"thrust_a_V": 1.0, "thrust_t_on": 5.0, "thrust_t_off": 5.0}
    a = Dynamics([ContinuousThrust()], values).acceleration([[1.0, 0, 0, 0, 1, 0]], 5.0)
    assert not a.any()
    assert math.isclose(Dynamics([ContinuousThrust()]).values["thrust_width"], 1.0)
