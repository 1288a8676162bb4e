"""Motion models: against exact orbits, other libraries and complex steps."""

from functools import cache

import heyoka as hy
import numpy as np
import pytest
from scipy.linalg import expm

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.relative_frame import (
    inertial_from_relative,
    relative_acceleration,
    relative_from_inertial,
)
from unmodeled.datasets.elements import state_from_elements
from unmodeled.models.physics import Dynamics, PointMass, Zonal
from unmodeled.models.physics.motion import (
    CentralBody,
    ClohessyWiltshire,
    ReferenceOrbit,
    RestrictedThreeBody,
    XuWang,
    reference_variables,
)
from unmodeled.models.physics.motion.clohessy_wiltshire import clohessy_wiltshire_matrix
from unmodeled.models.physics.motion.reference_orbit import (
    Oblate,
    reference_from_positions,
    reference_rates,
)
from unmodeled.models.physics.motion.xu_wang import frame_rates, xu_wang_rates

GM = 3.986004418e14
EARTH = Oblate(GM, 1.0826e-3, 6.378137e6)
N = 8.5918e-4
MU = 0.012150584269542


def two_orbits(times=None):
    """Target and a chaser about a kilometre away, under a point mass and J2."""
    return _two_orbits(tuple(np.arange(0.0, 7200.0, 1.0) if times is None else times))


@cache
def _two_orbits(times):
    separation, times = 1e3, np.array(times)
    model = Dynamics([PointMass(), Zonal((2,))], {"GM": GM, "J2": EARTH.j2, "R_ref": EARTH.radius})
    elements = np.array([[8143.1e3, 0.14, *np.radians([98.2, 79.2, 85.9, 40.0])]])
    target = state_from_elements(elements, GM)[0]
    offset = np.array([0.6, -0.7, 0.4, 5e-4, -3e-4, 4e-4]) * separation
    chaser = inertial_from_relative(target[None], offset[None])[0]
    return model, times, model.propagate(target, times), model.propagate(chaser, times)


def complex_step(model, x, t=0.7, h=1e-30):
    """Jacobian of the rates, exact to rounding."""
    columns = []
    for k in range(x.shape[1]):
        z = x.astype(complex)
        z[:, k] += 1j * h
        columns.append(model.rates(z, t)[0].imag / h)
    return np.stack(columns, axis=2)


@pytest.mark.parametrize("dt", [1e-3, 1.0, 30.0, 400.0, 7313.0])
def test_clohessy_wiltshire_is_the_matrix_exponential(dt):
    x = np.array([[10.0, -1.0, 5.0, -0.01, 1e-3, -0.05]])
    new, F = ClohessyWiltshire(N).propagate(x, 0.0, dt)
    exact = expm(clohessy_wiltshire_matrix(N) * dt)
    # elements of exp(A dt) grow to n dt / n: scale by rows and columns before comparing
    scale = np.array([1, 1, 1, N, N, N])
    np.testing.assert_allclose(
        F[0] / scale[:, None] * scale, exact / scale[:, None] * scale, rtol=1e-11, atol=1e-12
    )
    np.testing.assert_allclose(new, x @ F[0].T, rtol=1e-15)


def test_worked_example_of_the_thesis():
    """[Marchese2023] Eq. 3.15-3.17, an example of [Curtis2020]."""
    mu = 398600e9  # the constant of the textbook
    rows = []
    for h, e, i, node, w, nu in (
        (52_059e6, 0.025724, 60, 40, 30, 40),
        (52_362e6, 0.0072696, 50, 40, 120, 40),
    ):
        a = h**2 / mu / (1 - e**2)
        rows.append([a, e, *np.radians([i, node, w, nu])])
    a, b = state_from_elements(rows, mu)
    found = relative_from_inertial(a[None], b[None])[0]
    pulls = [-mu * s[:3] / np.linalg.norm(s[:3]) ** 3 for s in (a, b)]
    acceleration = relative_acceleration(a[None], b[None], pulls[0][None], pulls[1][None])[0]
    # half a unit of the last printed digit; the y velocity is printed as 111.199
    np.testing.assert_allclose(found[:3], [-6.7012e6, 6.8283e6, -4.0626e5], atol=50.0)
    np.testing.assert_allclose(found[3:], [316.67, 111.99, 1247.0], atol=0.05)
    # the x acceleration, 0.222229, is printed cut off and not rounded
    np.testing.assert_allclose(acceleration, [-0.22222, -0.18074, 0.50593], atol=1e-5)


def test_relative_state_goes_there_and_back():
    model, _, a, b = two_orbits(times=np.arange(0.0, 600.0, 60.0))
    pull = model.acceleration(a)
    for given in (None, pull):
        relative = relative_from_inertial(a, b, given)
        # positions of 7e6 m carry 1e-9 m of rounding
        np.testing.assert_allclose(inertial_from_relative(a, relative, given), b, atol=1e-8)


def test_relative_velocity_is_the_rate_of_the_position():
    model, _, a, b = two_orbits(times=np.arange(0.0, 400.0, 1.0))
    relative = relative_from_inertial(a, b, model.acceleration(a))
    # rounding of 1e-9 m over 4 s; without the turn about the radius it would be 3e-4 m/s
    rate = (relative[4:, :3] - relative[:-4, :3]) / 4.0
    smooth = relative[3:-3, 3:]
    third = np.gradient(np.gradient(relative[:, 3:], 1.0, axis=0), 1.0, axis=0)[3:-3]
    np.testing.assert_allclose(rate[1:-1], smooth + third * 4.0**2 / 24.0, atol=3e-8)


def test_xu_wang_equals_two_exact_orbits():
    """Right-hand side against second differences: 1e-8 m/s2, PLATFORM ladder 6."""
    model, times, a, b = two_orbits()
    relative = relative_from_inertial(a, b, model.acceleration(a))
    xu_wang = XuWang(ReferenceOrbit.from_states(times, a, EARTH))
    for k in range(100, 7000, 431):
        rates, _ = xu_wang.rates(relative[k : k + 1], times[k])
        # five-point difference of velocities that carry 2e-12 m/s: error 3e-12 m/s2
        v = relative[:, 3:]
        exact = (v[k - 2] - 8 * v[k - 1] + 8 * v[k + 1] - v[k + 2]) / 12.0
        np.testing.assert_allclose(rates[0, 3:], exact, atol=1e-9)
        np.testing.assert_array_equal(rates[0, :3], relative[k, 3:])


@pytest.mark.parametrize(("wrong", "least"), [("true anomaly", 1e-4), ("sign of alpha_x", 5e-6)])
def test_the_two_slips_of_the_paper_are_seen(wrong, least):
    """The 1e-9 above is not a test that cannot fail: as printed the model is far off."""
    model, times, a, b = two_orbits()
    relative = relative_from_inertial(a, b, model.acceleration(a))
    c = reference_variables(a)
    worst = 0.0
    for k in range(100, 7000, 431):
        here = c[k].copy()
        if wrong == "true anomaly":
            here[4] -= np.radians(85.9)
        xu_wang = ReferenceOrbit.from_states(times, a, EARTH)
        rates, _ = XuWang(xu_wang).rates(relative[k : k + 1], times[k])
        v = relative[:, 3:]
        exact = (v[k - 2] - 8 * v[k - 1] + 8 * v[k + 1] - v[k + 2]) / 12.0
        if wrong == "true anomaly":
            rates = xu_wang_rates(relative[k : k + 1], here, EARTH)[0]
            error = rates[0, 3:] - exact
        else:
            r, i, u = here[0], here[3], here[4]
            slip = 2.0 * EARTH.k * np.sin(2 * i) * np.cos(u) / r**5
            error = rates[0, 3:] - exact - np.cross([slip, 0, 0], relative[k, :3])
        worst = max(worst, np.abs(error).max())
    assert worst > least


def test_clohessy_wiltshire_is_xu_wang_on_a_circle_nearby():
    radius = 8e6
    body = Oblate(GM, 0.0, 6.4e6)
    n = np.sqrt(GM / radius**3)
    c = np.array([radius, 0.0, n * radius**2, 1.0, 0.5])
    orbit = ReferenceOrbit.integrated(c, np.linspace(0.0, 100.0, 5), body)
    x = np.random.default_rng(3).normal(size=(4, 6)) * [10, 10, 10, 0.01, 0.01, 0.01]
    a, J = XuWang(orbit).rates(x, 50.0)
    b, A = ClohessyWiltshire(n).rates(x, 50.0)
    # second order in separation: 6 n^2 d^2 / r
    np.testing.assert_allclose(a, b, atol=6 * n**2 * 30.0**2 / radius)
    np.testing.assert_allclose(J, np.broadcast_to(A, J.shape), atol=10 * n**2 * 30.0 / radius)


@pytest.mark.parametrize("kind", ["cw", "xw", "cr3bp", "bicircular", "mass"])
def test_jacobians_against_complex_step(kind):
    rng = np.random.default_rng(5)
    if kind in ("cw", "xw"):
        x = rng.normal(size=(5, 6)) * [50, 50, 50, 0.05, 0.05, 0.05]
        _, times, a, _ = two_orbits(times=np.arange(0.0, 10.0))
        model = {
            "cw": ClohessyWiltshire(N),
            "xw": XuWang(ReferenceOrbit.from_states(times, a, EARTH)),
        }[kind]
    elif kind == "mass":
        x, model = rng.normal(size=(5, 6)) * 500.0, CentralBody(4.89)
    else:
        x = np.array([1.0, 0, 0, 0, 0.5, 0]) + 0.05 * rng.normal(size=(5, 6))
        sun = {"sun_mass": 328900.54, "push": 3e-3} if kind == "bicircular" else {}
        model = RestrictedThreeBody(MU, **sun)
    J = np.broadcast_to(model.rates(x, 0.7)[1], (5, 6, 6))
    expected = complex_step(model, x)
    np.testing.assert_allclose(J, expected, rtol=1e-8, atol=1e-10 * np.abs(expected).max())


def test_restricted_three_body_is_that_of_heyoka():
    """heyoka counts momenta and puts the larger primary at +mu: turned by half a revolution."""
    equations = hy.model.cr3bp(mu=MU)
    function = hy.cfunc([e for _, e in equations], [v for v, _ in equations])
    x = np.array([[1.02, 0.03, 0.01, 0.1, 0.5, -0.02], [0.4, -0.3, 0.2, 0.3, 0.1, 0.2]])
    ours = RestrictedThreeBody(MU).rates(x, 0.0)[0]
    for state, found in zip(x, ours, strict=True):
        px, py = state[3] - state[1], state[4] + state[0]
        turned = np.array([-state[0], -state[1], state[2], -px, -py, state[5]])
        rates = function(turned)
        ax = -rates[3] + found[1]  # d(px)/dt = ax - vy
        ay = -rates[4] - found[0]
        np.testing.assert_allclose(found[3:], [ax, ay, rates[5]], rtol=1e-13)


def test_the_sun_leaves_the_barycentre_alone():
    model = RestrictedThreeBody(MU, sun_mass=328900.54)
    pull = model.disturbance(np.zeros((1, 6)), 1.3)
    # the difference of two attractions of 2.2 each
    np.testing.assert_allclose(pull, 0.0, atol=1e-14)
    light = RestrictedThreeBody(MU, push=1.0).disturbance(np.zeros((1, 6)), 0.0)
    np.testing.assert_allclose(light, [[-1.0, 0.0, 0.0]], atol=1e-15)


def test_reference_variables_follow_their_equations():
    _, times, a, _ = two_orbits(times=np.arange(0.0, 7200.0, 20.0))
    c = reference_variables(a)
    orbit = ReferenceOrbit.integrated(c[0], times, EARTH)
    scale = np.array([7e6, 1e3, 5e10, 1.0, 1.0])
    np.testing.assert_allclose(orbit.values / scale, c / scale, atol=1e-10)
    measured = reference_from_positions(times, a[:, :3])
    # central differences over 20 s: n^2 dt^2 / 6 of the velocity, 6e-5 at the perigee
    np.testing.assert_allclose(measured[1:-1] / scale, c[1:-1] / scale, atol=2e-3)
    rates = reference_rates(c.T, EARTH).T
    slope = (c[2:] - c[:-2]) / 40.0
    np.testing.assert_allclose(slope / scale, rates[1:-1] / scale, atol=2e-7)


def test_axes_turn_as_the_variables_say():
    _, _, a, _ = two_orbits(times=np.arange(0.0, 3000.0, 1.0))
    c = reference_variables(a)
    omega = np.array([frame_rates(row, EARTH)[0] for row in c])
    alpha = np.array([frame_rates(row, EARTH)[1] for row in c])
    slope = (omega[2:] - omega[:-2]) / 2.0
    # third derivative of omega: n^4, 1e-12 rad/s4 at most, over 6
    np.testing.assert_allclose(slope, alpha[1:-1], atol=2e-12)


def test_bad_input():
    with pytest.raises(ConfigError, match="mean motion 0"):
        ClohessyWiltshire(0.0)
    with pytest.raises(ConfigError, match=r"mass share 0\.7"):
        RestrictedThreeBody(0.7)
    with pytest.raises(ConfigError, match="GM -1"):
        CentralBody(-1.0)
    with pytest.raises(DataError, match="plane of the equator"):
        reference_variables([[7e6, 0, 0, 0, 7e3, 0]])
    with pytest.raises(DataError, match="no orbital plane"):
        relative_from_inertial([[1.0, 0, 0, 1.0, 0, 0]], [[1.0, 0, 0, 1.0, 0, 0]])
    _, times, a, _ = two_orbits(times=np.arange(0.0, 10.0))
    with pytest.raises(DataError, match="time 99 s"):
        ReferenceOrbit.from_states(times, a, EARTH).at(99.0)
    with pytest.raises(DataError, match="three or more"):
        reference_from_positions(times[:2], a[:2, :3])
