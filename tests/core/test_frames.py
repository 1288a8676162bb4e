import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unmodeled.core.errors import DataError
from unmodeled.core.frames import (
    body_fixed_from_inertial,
    inertial_from_perifocal,
    rotation_about_x,
    rotation_about_z,
    rtn_from_inertial,
)

ANGLE = st.floats(-10.0, 10.0)
EPS = np.finfo(float).eps
# Products of two or three rotations: at most 3 terms and 3 factors, each rounded to eps / 2.
TINY = 10 * EPS


def assert_rotation(m):
    np.testing.assert_allclose(
        m @ np.swapaxes(m, -1, -2), np.broadcast_to(np.eye(3), m.shape), rtol=0, atol=TINY
    )
    np.testing.assert_allclose(np.linalg.det(m), 1.0, rtol=TINY)


@given(ANGLE, ANGLE, ANGLE)
def test_rotations_are_orthogonal_and_right_handed(a, b, c):
    for m in (rotation_about_x(a), rotation_about_z(b), inertial_from_perifocal(a, b, c)):
        assert_rotation(m)


@given(ANGLE, ANGLE)
def test_angles_about_one_axis_add(a, b):
    for turn in (rotation_about_x, rotation_about_z):
        # a + b itself is rounded: |a + b| eps, at most 20 eps
        np.testing.assert_allclose(turn(a) @ turn(b), turn(a + b), rtol=0, atol=30 * EPS)
        np.testing.assert_allclose(turn(a) @ turn(-a), np.eye(3), rtol=0, atol=TINY)


def test_direction_by_hand():
    # The axes turn by +90 degrees: what lay on the old axis lies on minus the next new one.
    quarter = np.pi / 2
    np.testing.assert_allclose(rotation_about_z(quarter) @ [1, 0, 0], [0, -1, 0], atol=EPS)
    np.testing.assert_allclose(rotation_about_x(quarter) @ [0, 1, 0], [0, 0, -1], atol=EPS)


def test_many_angles_at_once():
    angles = np.linspace(-3, 3, 7)
    stacked = rotation_about_z(angles)
    assert stacked.shape == (7, 3, 3)
    for k, angle in enumerate(angles):
        assert np.array_equal(stacked[k], rotation_about_z(angle))


def test_perifocal_by_hand():
    # Equatorial orbit, periapsis at 90 degrees: perifocal x is inertial y.
    m = inertial_from_perifocal(0.0, 0.0, np.pi / 2)
    np.testing.assert_allclose(m @ [1, 0, 0], [0, 1, 0], atol=EPS)
    # Polar, node at 90 degrees: the normal is (sin node sin i, -cos node sin i, cos i)
    m = inertial_from_perifocal(np.pi / 2, np.pi / 2, 0.3)
    np.testing.assert_allclose(m @ [0, 0, 1], [1, 0, 0], atol=2 * EPS)
    # The node direction is the perifocal direction at minus the argument of periapsis.
    np.testing.assert_allclose(m @ [np.cos(0.3), -np.sin(0.3), 0], [0, 1, 0], atol=4 * EPS)


def test_a_point_of_the_spinning_body_stands_still():
    rate, meridian, times = 4e-4, 0.7, np.array([0.0, 100.0, 5e4])
    longitude = meridian + rate * times
    inertial = np.stack([np.cos(longitude), np.sin(longitude), np.full(3, 0.5)], axis=1)
    fixed = np.einsum("nij,nj->ni", body_fixed_from_inertial(times, rate, meridian), inertial)
    # the angle, up to 21 rad, is rounded to 21 eps at most
    np.testing.assert_allclose(fixed, np.tile([1, 0, 0.5], (3, 1)), atol=30 * EPS)


def test_rtn_by_hand():
    axes = rtn_from_inertial([[0.0, 2.0, 0.0, -3.0, 1.0, 0.0]])[0]
    np.testing.assert_allclose(axes, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=EPS)


@given(st.lists(st.floats(-5, 5), min_size=6, max_size=6))
def test_rtn_axes(state):
    r, v = np.array(state[:3]), np.array(state[3:])
    size = np.linalg.norm(r) * np.linalg.norm(v)
    if not np.linalg.norm(np.cross(r, v)) > 1e-3 * size > 1e-6:
        return  # nearly straight: the axes are ill conditioned
    m = rtn_from_inertial([state])[0]
    # the cross product loses a factor size / |r x v| < 1e3
    np.testing.assert_allclose(m @ m.T, np.eye(3), atol=1e4 * EPS)
    assert np.linalg.det(m) == pytest.approx(1.0, abs=1e4 * EPS)
    np.testing.assert_allclose(m[0], r / np.linalg.norm(r), atol=TINY)
    assert m[1] @ v > 0
    assert abs(m[2] @ v) <= 1e4 * EPS * np.linalg.norm(v)


def test_rtn_needs_a_plane():
    with pytest.raises(DataError) as caught:
        rtn_from_inertial([[1.0, 0, 0, 0, 1, 0], [1.0, 0, 0, 2, 0, 0]])
    assert str(caught.value) == (
        "state 1 has no orbital plane. Allowed: position and velocity that are not parallel."
    )
    with pytest.raises(DataError, match=r"states has shape \(1, 3\)"):
        rtn_from_inertial([[1.0, 0, 0]])
