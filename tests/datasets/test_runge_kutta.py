import math

import numpy as np
import pytest
from tests.models.physics.orbits import kepler_orbit

from unmodeled.datasets.runge_kutta import propagate_rk4

GM = 4 * math.pi**2
STATES = np.array([[1.0, 0, 0, 0, 2 * math.pi, 0.5], [1.4, 0.2, -0.3, -0.5, 4.5, 2.0]])


def pull(x):
    return -GM * x / np.linalg.norm(x, axis=1, keepdims=True) ** 3


def test_order_is_four():
    """The slope of log error against log step is the order."""
    steps = np.array([8, 16, 32, 64, 128])
    duration = np.array([0.1, 0.15])
    errors = []
    for n in steps:
        orbits = propagate_rk4(pull, STATES, duration, 11, int(n))
        exact = [
            kepler_orbit(s, GM, d * np.arange(11)) for s, d in zip(STATES, duration, strict=True)
        ]
        errors.append(np.abs(orbits - exact).max())
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.3)


def test_one_step_by_hand():
    # y'' = -y from (1, 0): RK4 gives the Taylor series of cosine and sine to the fourth order.
    h = 0.1
    out = propagate_rk4(lambda x: -x, np.array([[1.0, 0, 0, 0, 0, 0]]), np.array([h]), 2, 1)
    assert out.shape == (1, 2, 6)
    assert out[0, 1, 0] == pytest.approx(1 - h**2 / 2 + h**4 / 24, rel=1e-15)
    assert out[0, 1, 3] == pytest.approx(-(h - h**3 / 6), rel=1e-15)


def test_first_sample_is_the_start_and_inputs_stay():
    states = STATES.copy()
    out = propagate_rk4(pull, states, np.array([0.1, 0.1]), 3, 2)
    assert np.array_equal(out[:, 0], STATES)
    assert np.array_equal(states, STATES)


def test_orbits_do_not_mix():
    both = propagate_rk4(pull, STATES, np.array([0.1, 0.2]), 5, 4)
    for k in range(2):
        alone = propagate_rk4(pull, STATES[k : k + 1], np.array([[0.1], [0.2]])[k], 5, 4)
        assert np.array_equal(alone[0], both[k])
