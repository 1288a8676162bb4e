import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unmodeled.core.errors import OrbitError
from unmodeled.datasets.elements import kepler_period, osculating_period, state_from_elements

EPS = np.finfo(float).eps
ANGLE = st.floats(-7.0, 7.0)
ELEMENTS = st.tuples(
    st.floats(0.1, 10.0), st.floats(0.0, 0.95), st.floats(0.0, math.pi), ANGLE, ANGLE, ANGLE
)


def test_published_example():
    """Vallado, Fundamentals of Astrodynamics (4th ed.), Example 2-5 / 2-6.

    Printed to 5-6 digits: p = 11067.790 km, e = 0.83285, i = 87.87, node = 227.89,
    periapsis = 53.38, true anomaly = 92.335 degrees.
    """
    p, e = 11067.790, 0.83285
    angles = np.radians([87.87, 227.89, 53.38, 92.335])
    state = state_from_elements([[p / (1 - e**2), e, *angles]], gm=398600.4418)[0]
    # angles are printed to 0.005 degrees, which moves a position of 11,450 km by about 1 km
    np.testing.assert_allclose(state[:3], [6525.344, 6861.535, 6449.125], atol=1.5)
    np.testing.assert_allclose(state[3:], [4.902276, 5.533124, -1.975709], atol=1e-3)


@given(ELEMENTS, st.floats(0.1, 10.0))
def test_integrals_of_motion(elements, gm):
    a, e, i, node, _, nu = elements
    state = state_from_elements([elements], gm)[0]
    r, v = state[:3], state[3:]
    radius = np.linalg.norm(r)
    # vis-viva; speed and radius are good to some eps, their difference loses (1 + e) / (1 - e)
    tolerance = 20 * EPS * (1 + e) / (1 - e)
    assert v @ v == pytest.approx(gm * (2 / radius - 1 / a), rel=0, abs=tolerance * 2 * gm / radius)
    h = np.cross(r, v)
    size = math.sqrt(gm * a * (1 - e**2))
    pole = [math.sin(node) * math.sin(i), -math.cos(node) * math.sin(i), math.cos(i)]
    np.testing.assert_allclose(h / size, pole, rtol=0, atol=2 * tolerance)
    ecc = np.cross(v, h) / gm - r / radius
    assert np.linalg.norm(ecc) == pytest.approx(e, abs=2 * tolerance)
    assert ecc @ r == pytest.approx(e * radius * math.cos(nu), abs=4 * tolerance * radius)


def test_by_hand():
    # a = 2, e = 0.5, at apoapsis: r = 3, v = sqrt(gm (2/3 - 1/2)) against the direction at start
    state = state_from_elements([[2.0, 0.5, 0.0, 0.0, 0.0, math.pi]], gm=6.0)[0]
    np.testing.assert_allclose(state, [-3, 0, 0, 0, -1, 0], atol=10 * EPS)


def test_period():
    assert kepler_period(1.0, 4 * math.pi**2) == pytest.approx(1.0, rel=4 * EPS)
    # [Neamati2022] Eq. 1 for Bennu's Brillouin radius
    assert kepler_period(290.0, 4.89) == pytest.approx(14032.0, rel=5e-5)


@given(ELEMENTS)
def test_osculating_period(elements):
    states = state_from_elements([elements, elements], 2.0)
    tolerance = 100 * EPS * (1 + elements[1]) / (1 - elements[1])
    assert osculating_period(states, 2.0) == pytest.approx(
        float(kepler_period(elements[0], 2.0)), rel=tolerance
    )


@pytest.mark.parametrize("e", [1.0, 1.5, -0.1])
def test_only_ellipses(e):
    with pytest.raises(OrbitError) as caught:
        state_from_elements([[1, 0.1, 0, 0, 0, 0], [1, e, 0, 0, 0, 0]], 1.0)
    assert str(caught.value) == (
        f"eccentricity {e:g}. Allowed: 0 <= e < 1. "
        "Only bound orbits can be sampled period by period."
    )


@pytest.mark.parametrize("a", [0.0, -2.0])
def test_positive_axes(a):
    with pytest.raises(OrbitError) as caught:
        state_from_elements([[a, 0.1, 0, 0, 0, 0]], 1.0)
    assert str(caught.value) == f"semi-major axis {a:g}. Allowed: a number > 0."


def test_unbound_states_have_no_period():
    with pytest.raises(OrbitError) as caught:
        osculating_period([[1.0, 0, 0, 0, 2.0, 0]] * 3, 1.0)
    assert str(caught.value) == (
        "the orbit is not bound (median specific energy 1). "
        "Allowed: a closed orbit about the body. "
        "Check the body, the units and that velocities are relative to inertial axes."
    )
