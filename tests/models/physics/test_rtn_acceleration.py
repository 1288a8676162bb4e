"""Empirical accelerations: axes, drift of the semi-major axis, origin of the angle."""

import math

import numpy as np
import pytest

from unmodeled.models.physics import ConstantRTN, Dynamics, OncePerRevolutionRTN, PointMass


def rtn(states):
    r, v = states[:, :3], states[:, 3:]
    e_r = r / np.linalg.norm(r, axis=1, keepdims=True)
    h = np.cross(r, v)
    e_n = h / np.linalg.norm(h, axis=1, keepdims=True)
    return np.stack([e_r, np.cross(e_n, e_r), e_n], axis=1)


def semi_major_axis(orbit, gm):
    return 1 / (2 / np.linalg.norm(orbit[:, :3], axis=1) - np.sum(orbit[:, 3:] ** 2, axis=1) / gm)


def on_orbit(inclination, node, argument):
    """Unit circular orbit: state at the argument of latitude."""
    c, s = math.cos(node), math.sin(node)
    p = np.array([c, s, 0])
    q = np.array([-s * math.cos(inclination), c * math.cos(inclination), math.sin(inclination)])
    cu, su = math.cos(argument), math.sin(argument)
    return np.concatenate([cu * p + su * q, -su * p + cu * q])


def test_components():
    states = np.random.default_rng(7).normal(size=(30, 6))
    values = {"rtn_a_R": 1.0, "rtn_a_T": -2.0, "rtn_a_N": 3.0}
    a = Dynamics([ConstantRTN()], values).acceleration(states)
    back = np.einsum("nij,nj->ni", rtn(states), a)
    np.testing.assert_allclose(back, np.tile([1.0, -2.0, 3.0], (30, 1)), rtol=0, atol=1e-13)


def test_transverse_drift():
    # Circular: da/dt = 2 a_T / n, exact to first order in a_T
    push, n, revolutions = 1e-8, 1.0, 10
    times = np.linspace(0, revolutions * 2 * math.pi, 200)
    model = Dynamics([PointMass(), ConstantRTN()], {"rtn_a_T": push})
    a = semi_major_axis(model.propagate(on_orbit(0.5, 0.3, 0.1), times), 1.0)
    expected = 2 * push / n * times[-1]
    # second order: a grows by 1.3e-6 and n falls by 1.5 of it
    assert abs((a[-1] - a[0]) / expected - 1) < 3 * expected


@pytest.mark.parametrize("inclination", [0.0, 1e-9, 0.4, math.pi / 2, 2.0, 3.0])
def test_angle_is_argument_of_latitude_plus_node(inclination):
    model = Dynamics([OncePerRevolutionRTN()], {"opr_cos_R": 1.0, "opr_sin_T": 1.0})
    node = 0.7
    for argument in np.linspace(0, 6, 13):
        state = on_orbit(inclination, node, argument)
        a = rtn(state[None])[0] @ model.acceleration(state[None])[0]
        angle = argument + node
        # 1 / (1 + cos i) multiplies the rounding: 200 at 3 rad
        bound = 2e-13
        np.testing.assert_allclose(a, [math.cos(angle), math.sin(angle), 0], rtol=0, atol=bound)


def test_retrograde_angle():
    model = Dynamics([OncePerRevolutionRTN(retrograde=True)], {"opr_cos_N": 1.0, "opr_sin_R": 1.0})
    for inclination in (math.pi, 3.0, 1.0):
        for argument in np.linspace(0, 6, 7):
            state = on_orbit(inclination, 0.7, argument)
            a = rtn(state[None])[0] @ model.acceleration(state[None])[0]
            angle = argument - 0.7
            np.testing.assert_allclose(
                a, [math.sin(angle), 0, math.cos(angle)], rtol=0, atol=1e-14 * 10
            )


def test_the_singular_inclinations_are_those_documented():
    up = Dynamics([OncePerRevolutionRTN()], {"opr_cos_R": 1.0})
    down = Dynamics([OncePerRevolutionRTN(retrograde=True)], {"opr_cos_R": 1.0})
    prograde, retrograde = [[1.0, 0, 0, 0, 1, 0]], [[1.0, 0, 0, 0, -1, 0]]
    assert np.isfinite(up.acceleration(prograde)).all()
    assert np.isfinite(down.acceleration(retrograde)).all()
    assert not np.isfinite(up.acceleration(retrograde)).all()
    assert not np.isfinite(down.acceleration(prograde)).all()


def test_once_per_revolution_keeps_the_semi_major_axis_but_moves_the_eccentricity():
    times = np.linspace(0, 2 * math.pi, 300)
    model = Dynamics([PointMass(), OncePerRevolutionRTN()], {"opr_cos_T": 1e-6})
    orbit = model.propagate(on_orbit(0.5, 0.0, 0.0), times)
    a = semi_major_axis(orbit, 1.0)
    assert abs(a[-1] - a[0]) < 1e-10  # second order: (2 pi 1e-6)^2 and a factor
    x, v = orbit[-1, :3], orbit[-1, 3:]
    e = np.linalg.norm(np.cross(v, np.cross(x, v)) - x / np.linalg.norm(x))
    # Gauss: de = 2 cos(u) a_T, whose mean over the revolution is a_T
    assert abs(e / (2 * math.pi * 1e-6) - 1) < 1e-4
