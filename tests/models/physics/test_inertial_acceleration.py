"""Constant inertial acceleration: energy and the parabola."""

import numpy as np

from unmodeled.models.physics import ConstantInertial, Dynamics, PointMass

VALUES = {"inertial_a_x": 1e-3, "inertial_a_y": -2e-3, "inertial_a_z": 5e-4}
PUSH = np.array(list(VALUES.values()))


def test_alone_it_is_a_parabola():
    times = np.linspace(0, 100, 11)
    start = np.array([1.0, 2, 3, 0.1, 0.2, 0.3])
    orbit = Dynamics([ConstantInertial()], VALUES).propagate(start, times)
    t = times[:, None]
    expected = np.hstack([start[:3] + start[3:] * t + 0.5 * PUSH * t**2, start[3:] + PUSH * t])
    np.testing.assert_allclose(orbit, expected, rtol=0, atol=1e-14 * np.abs(expected).max())


def test_energy():
    times = np.linspace(0, 30, 100)
    orbit = Dynamics([PointMass(), ConstantInertial()], VALUES).propagate(
        [1, 0, 0, 0, 1, 0.1], times
    )
    x, v = orbit[:, :3], orbit[:, 3:]
    kepler = 0.5 * np.sum(v**2, axis=1) - 1 / np.linalg.norm(x, axis=1)
    # five revolutions of some twenty steps, a few eps each
    assert np.ptp(kepler - x @ PUSH) < 100 * 3 * np.finfo(float).eps
    assert np.ptp(kepler) > 1e-3  # Kepler's energy alone is not kept
