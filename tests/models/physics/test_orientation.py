"""A body that turns about a pole that is not the inertial z, or that moves."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import Dynamics, Mascon, PointMass, SphericalHarmonics, ThirdBody
from unmodeled.models.physics.orientation import Orientation
from unmodeled.models.physics.tracks import Tracks

MASCON = {"mascon1_GM": 0.15, "mascon1_x": 0.3, "mascon1_y": -0.2, "mascon1_z": 0.1}
PLACE = np.array([0.3, -0.2, 0.1])
# Precession moves the pole of rotation off that of figure by 0.4 of its rate over the spin.
PRECESSION, SPIN, WOBBLE = 2e-8, 0.7, Rotation.from_rotvec([2e-4, -1e-4, 0.0])


def body_from_inertial(times):
    """A pole 0.4 rad off that precesses, spin about it, and a pole of figure a little off."""
    slow = Rotation.from_euler("zx", np.stack([-PRECESSION * times, 0 * times - 0.4], 1))
    spin = Rotation.from_rotvec(np.outer(-SPIN * times, [0, 0, 1]))
    return (WOBBLE * spin * slow).as_matrix()


def points(n=20):
    x = np.random.default_rng(3).normal(size=(n, 3))
    return 1.7 * x / np.linalg.norm(x, axis=1, keepdims=True)


def test_the_fit_reproduces_the_rotations():
    orientation = Orientation.fit(body_from_inertial, SPIN, 0.0, 2e4)
    times = np.linspace(0.0, 2e4, 333)
    error = orientation.matrices(times) - body_from_inertial(times)
    assert np.abs(error).max() < 1e-7
    np.testing.assert_allclose(orientation.fixed, WOBBLE.as_matrix(), rtol=0, atol=1e-7)


def test_compiled_code_turns_the_same_way():
    orientation = Orientation.fit(body_from_inertial, SPIN, 0.0, 2e4)
    times, x = np.linspace(0.0, 2e4, 20), points()
    model = Dynamics([Mascon()], MASCON, orientation=orientation)
    place = np.swapaxes(orientation.matrices(times), 1, 2) @ PLACE
    d = x - place
    expected = -0.15 * d / np.linalg.norm(d, axis=1)[:, None] ** 3
    a = model.acceleration(x, times)
    # the angle is 14,000 rad: eps of it, times the slope of the field
    np.testing.assert_allclose(a, expected, rtol=0, atol=1e-12)
    # and the partials by finite differences, through both turns
    numeric = np.stack(
        [
            (model.acceleration(x + h, times) - model.acceleration(x - h, times)) / 2e-5
            for h in 1e-5 * np.eye(3)
        ],
        axis=2,
    )
    np.testing.assert_allclose(model.state_partials(x, times)[:, :, :3], numeric, atol=1e-9)


def test_a_pole_along_z_is_the_plain_spin():
    still = Orientation.of_pole(np.eye(3), SPIN, 0.3)
    effects = [PointMass(), Mascon()]
    one = Dynamics(effects, MASCON, orientation=still)
    other = Dynamics(effects, MASCON | {"spin_rate": SPIN, "prime_meridian": 0.3}, spinning=True)
    times = np.linspace(0.0, 9.0, 20)
    a, b = one.acceleration(points(), times), other.acceleration(points(), times)
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-14)
    assert {"pole_x", "pole_y", "spin_rate"} <= set(one.values)


def test_the_pole_parameters_turn_the_equator():
    tilt = Rotation.from_euler("x", -0.4).as_matrix()
    model = Dynamics([Mascon()], MASCON, orientation=Orientation.of_pole(tilt, SPIN, 0.3))
    moved = model.with_values({"pole_x": 0.01, "pole_y": -0.02})
    nod = Rotation.from_euler("xy", [-0.01, 0.02]).as_matrix()
    true = Dynamics([Mascon()], MASCON, orientation=Orientation.of_pole(nod @ tilt, SPIN, 0.3))
    np.testing.assert_allclose(
        moved.acceleration(points(), 2.0), true.acceleration(points(), 2.0), rtol=0, atol=1e-14
    )


def test_bodies_are_turned_with_the_axes():
    """A degree-2 field and a third body, both about a tilted pole: inertial axes throughout."""
    tilt = Orientation.of_pole(Rotation.from_euler("x", -0.4).as_matrix(), SPIN, 0.3)
    tracks = Tracks(0.0, 10.0, {"moon": np.array([[4.0, 1.0, 2.0]])})
    values = {"GM_moon": 1.0, "C_2_0": -1e-3, "C_2_2": 3e-4}
    effects = [SphericalHarmonics(2), ThirdBody("moon")]
    both = Dynamics(effects, values, tracks=tracks, orientation=tilt)
    field = both.with_effects(effects[:1], {})
    third = Dynamics(effects[1:], {"GM_moon": 1.0}, tracks=tracks)
    sum_ = field.acceleration(points(), 2.0) + third.acceleration(points(), 2.0)
    np.testing.assert_allclose(both.acceleration(points(), 2.0), sum_, rtol=0, atol=1e-14)


def test_series_on_different_intervals_are_refused():
    orientation = Orientation.fit(body_from_inertial, SPIN, 0.0, 2e4)
    tracks = Tracks(0.0, 1e4, {"moon": np.array([[4.0, 1.0, 2.0]])})
    with pytest.raises(ConfigError) as caught:
        Dynamics([Mascon(), ThirdBody("moon")], tracks=tracks, orientation=orientation)
    assert str(caught.value) == (
        "tracks and orientation on different intervals. Fit both on the same."
    )
