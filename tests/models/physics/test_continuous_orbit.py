"""An orbit integrated once, asked anywhere."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError, OrbitError
from unmodeled.models.physics import Dynamics, PointMass, Zonal

MODEL = Dynamics([PointMass(), Zonal((2,))], {"GM": 1.0, "R_ref": 0.5, "J2": 1e-2})
STATE = np.array([1.0, 0.1, 0.2, -0.1, 0.9, 0.2])


def test_states_are_those_of_a_propagation_to_the_last_bit():
    orbit = MODEL.fly(STATE, 1.0, -3.0, 6.0)
    after, before = np.linspace(1.0, 6.0, 23), np.linspace(1.0, -3.0, 17)
    np.testing.assert_array_equal(orbit.states(after), MODEL.propagate(STATE, after))
    np.testing.assert_array_equal(orbit.states(before), MODEL.propagate(STATE, before))
    # Any order, and repeatedly.
    np.testing.assert_array_equal(orbit.states([6.0, 1.0, -3.0])[1], STATE)
    assert orbit.stops == ()


def test_an_instant_is_an_orbit_too():
    np.testing.assert_array_equal(MODEL.fly(STATE, 2.0, 2.0, 2.0).states([2.0]), STATE[None])


def test_bad_intervals_are_refused():
    with pytest.raises(ConfigError, match="start <= epoch <= end"):
        MODEL.fly(STATE, 0.0, 1.0, 2.0)
    with pytest.raises(DataError, match="where the orbit was integrated"):
        MODEL.fly(STATE, 0.0, 0.0, 1.0).states([1.1])


def test_a_fall_into_the_centre_is_an_orbit_error():
    with pytest.raises(OrbitError, match="breaks down"):
        MODEL.fly(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.0, 0.0, 3.0)
