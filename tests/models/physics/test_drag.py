"""Drag: decay of a circular orbit, co-rotation, exponential profile."""

import math

import numpy as np

from unmodeled.models.physics import Dynamics, ExponentialDrag, PointMass

GM, R = 3.986004418e14, 6.878e6
AIR = {"drag_B": 0.022, "drag_rho0": 5e-13, "drag_r0": R, "drag_H": 6e4}


def circular(r=R):
    return np.array([r, 0, 0, 0, math.sqrt(GM / r), 0])


def test_decay_of_a_circular_orbit():
    n = math.sqrt(GM / R**3)
    times = np.linspace(0, 10 * 2 * math.pi / n, 50)
    orbit = Dynamics([PointMass(), ExponentialDrag()], AIR | {"GM": GM}).propagate(
        circular(), times
    )
    a = 1 / (2 / np.linalg.norm(orbit[:, :3], axis=1) - np.sum(orbit[:, 3:] ** 2, axis=1) / GM)
    expected = -AIR["drag_rho0"] * AIR["drag_B"] * math.sqrt(GM * R) * times[-1]
    assert -40 < expected < -30  # metres in 10 revolutions
    # the air is denser by da / H where the orbit has come to, on average half of it, and the
    # radius swings by as much as da about a
    assert abs((a[-1] - a[0]) / expected - 1) < 2 * abs(expected) / AIR["drag_H"]


def test_against_the_velocity_and_exponential():
    model = Dynamics([ExponentialDrag()], AIR)
    v = circular()[4]
    low, high = model.acceleration([circular(), [R + 6e4, 0, 0, 0, v, 0]])
    size = 0.5 * 5e-13 * 0.022 * v * v
    assert abs(low[1] / -size - 1) < 1e-14
    assert 2e-7 < size < 4e-7
    assert abs(high[1] / low[1] - math.exp(-1)) < 1e-13  # exp of an argument of size 1


def test_air_that_turns():
    rate = 7.292115e-5
    model = Dynamics([ExponentialDrag()], AIR | {"drag_omega": rate})
    # at rest relative to the air there is no drag, to the rounding of a velocity of 500 m/s
    still = model.acceleration([[R, 0, 0, 0, rate * R, 0]])
    assert np.abs(still).max() < 0.5 * 5e-13 * 0.022 * (500 * 4 * np.finfo(float).eps) ** 2
    v = circular()[4]
    with_air, against = model.acceleration([circular(), [R, 0, 0, 0, -v, 0]])[:, 1]
    ratio = ((v - rate * R) / (v + rate * R)) ** 2
    assert abs(-with_air / against - ratio) < 1e-14
    assert 0.74 < ratio < 0.78
