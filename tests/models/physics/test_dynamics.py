"""Orbits and their partials against independent solutions."""

import math

import numpy as np
import pytest
import scipy.integrate
from tests.models.physics.orbits import kepler_orbit

from unmodeled.core.errors import DataError, OrbitError
from unmodeled.models.physics import Dynamics, PointMass, SphericalHarmonics, Zonal, dynamics

GM = 4 * math.pi**2
START = np.array([1.2, 0.3, -0.4, -1.0, 5.0, 2.5])
ZONALS = {"J2": 1.93e-2, "J3": -1.22e-3, "J4": -6.5e-3, "J5": 6.73e-5}


def point_mass():
    return Dynamics([PointMass()], {"GM": GM})


def bennu():
    return Dynamics([PointMass(), Zonal((2, 3, 4, 5))], {"GM": GM, "R_ref": 1.0} | ZONALS)


def tesseral():
    values = {"GM": GM, "C_2_0": -0.01, "C_2_2": 0.005, "S_3_1": -0.002}
    return Dynamics(
        [PointMass(), SphericalHarmonics(3)],
        values | {"spin_rate": 2.5, "prime_meridian": 0.3},
        spinning=True,
    )


MODELS = pytest.mark.parametrize("make", [point_mass, bennu, tesseral])


@pytest.mark.parametrize("first", [0.0, -3.0, 7.5])
def test_kepler_orbit(first):
    times = first + np.linspace(0.0, 20.0, 101)
    expected = kepler_orbit(START, GM, times)
    # Rounding of the mean anomaly (2 pi 10 rad at most, 1e-14) and of 10 revolutions at eps.
    scale = np.abs(expected).max()
    orbit = point_mass().propagate(START, times)
    assert np.abs(orbit - expected).max() < 1e-11 * scale
    assert np.array_equal(orbit[0], START)


def test_circular_orbit_by_hand():
    times = np.linspace(0.0, 3.0, 31)
    orbit = point_mass().propagate([1, 0, 0, 0, 2 * math.pi, 0], times)
    angle = 2 * math.pi * times
    np.testing.assert_allclose(orbit[:, 0], np.cos(angle), rtol=0, atol=1e-12)
    np.testing.assert_allclose(orbit[:, 1], np.sin(angle), rtol=0, atol=1e-12)
    assert not orbit[:, 2].any()


@MODELS
def test_against_scipy(make):
    model = make()
    times = np.linspace(0.0, 4.0, 41)

    def rate(t, y):
        return np.concatenate([y[3:], model.acceleration(y[None], t)[0]])

    solution = scipy.integrate.solve_ivp(
        rate, (0.0, 4.0), START, method="DOP853", t_eval=times, rtol=1e-13, atol=1e-13
    )
    # local errors of 1e-13 a step, some 300 steps, growing about linearly with time
    scale = np.abs(solution.y).max()
    assert np.abs(model.propagate(START, times) - solution.y.T).max() < 1e-9 * scale


def test_time_zero_matters_for_a_spinning_field_only():
    times = np.linspace(0.0, 1.0, 5)
    assert np.array_equal(bennu().propagate(START, times), bennu().propagate(START, times + 0.5))
    a, b = (tesseral().propagate(START, times + t) for t in (0.0, 0.5))
    assert np.abs(a - b).max() > 1e-4
    turned = tesseral().with_values({"prime_meridian": 0.3 + 0.5 * 2.5})
    np.testing.assert_allclose(turned.propagate(START, times), b, rtol=0, atol=1e-12)


@MODELS
def test_back_and_forth(make):
    # Reversing the velocity (and the spin) runs the orbit backwards.
    model = make()
    end = model.propagate(START, [0.0, 2.0])[-1]
    mirrored = np.concatenate([end[:3], -end[3:]])
    if "spin_rate" in model.values:
        model = model.with_values({"spin_rate": -2.5, "prime_meridian": 0.3 + 2.5 * 2.0})
    back = model.propagate(mirrored, [0.0, 2.0])[-1]
    np.testing.assert_allclose(back[:3], START[:3], rtol=0, atol=1e-11)
    np.testing.assert_allclose(-back[3:], START[3:], rtol=0, atol=1e-11 * 2 * math.pi)


def test_use_of_one_compiled_integrator_leaves_no_trace():
    times = np.linspace(0, 2, 9)
    first = bennu().propagate(START, times)
    bennu().with_values({"J2": 0.1}).propagate(START * 1.1, times + 3)
    bennu().propagate(START, [1.0])
    assert np.array_equal(bennu().propagate(START, times), first)


def richardson(function, h):
    """Derivative by central differences at h and h/2, and a bound of its error."""
    wide = (function(h) - function(-h)) / (2 * h)
    narrow = (function(h / 2) - function(-h / 2)) / h
    rounding = 1e-13 * np.abs(function(0.0)).max() / h  # orbits are good to 1e-13
    return narrow + (narrow - wide) / 3, np.abs(narrow - wide).max() / 3 + rounding


@MODELS
def test_state_transition_against_differences(make):
    model, times = make(), [0.0, 0.5, 1.5]
    out = model.propagate_variational(START, times)
    np.testing.assert_allclose(out.states, model.propagate(START, times), rtol=0, atol=1e-12)
    assert np.array_equal(out.transition[0], np.eye(6))
    assert out.sensitivity.shape == (3, 6, 0)
    for k in range(6):
        move = np.eye(6)[k]
        expected, bound = richardson(lambda h, m=move: model.propagate(START + h * m, times), 1e-4)
        np.testing.assert_allclose(out.transition[:, :, k], expected, rtol=0, atol=bound)


@MODELS
def test_sensitivity_against_differences(make):
    model, times = make(), [0.0, 0.5, 1.5]
    names = [p.name for p in model.parameters]
    out = model.propagate_variational(START, times, names)
    assert out.parameters == tuple(names)
    assert not out.sensitivity[0].any()
    for k, name in enumerate(names):
        value = model.values[name]

        def moved(h, name=name, value=value):
            return model.with_values({name: value + h}).propagate(START, times)

        expected, bound = richardson(moved, 1e-4)
        np.testing.assert_allclose(out.sensitivity[:, :, k], expected, rtol=0, atol=bound)


@MODELS
def test_transition_is_symplectic(make):
    """A Hamiltonian flow, also one that depends on time, has P' J P = J and so det P = 1."""
    out = make().propagate_variational(START, np.linspace(0, 3, 13))
    unit = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.eye(3), np.zeros((3, 3))]])
    for p in out.transition:
        # the errors of P are eps |P| a revolution, the product squares its size
        bound = 100 * np.finfo(float).eps * np.abs(p).max() ** 2 + 1e-14
        np.testing.assert_allclose(p.T @ unit @ p, unit, rtol=0, atol=bound)
        assert np.linalg.det(p) == pytest.approx(1.0, abs=6 * bound)


def test_transitions_compose():
    model, (t0, t1, t2) = tesseral(), (0.0, 0.7, 1.6)
    whole = model.propagate_variational(START, [t0, t1, t2])
    second = model.propagate_variational(whole.states[1], [t1, t2])
    product = second.transition[1] @ whole.transition[1]
    np.testing.assert_allclose(
        product, whole.transition[2], rtol=0, atol=1e-12 * np.abs(product).max() ** 2
    )


@pytest.mark.parametrize(
    ("state", "times", "text"),
    [
        (START[:3], [0.0, 1.0], "state has shape (3,). Allowed: shape (6,)."),
        (START, [[0.0, 1.0]], "times has shape (1, 2). Allowed: shape (n,)."),
        (START, [], "no times. Allowed: at least one."),
        (
            START,
            [0.0, 2.0, 1.0],
            "times goes back at sample 2: 2.000000 s is followed by 1.000000 s. "
            "Allowed: strictly increasing times. Sort the samples and remove duplicates.",
        ),
    ],
)
def test_bad_states_and_times(state, times, text):
    for call in (bennu().propagate, bennu().propagate_variational):
        with pytest.raises(DataError) as caught:
            call(state, times)
        assert str(caught.value) == text


def test_an_orbit_that_never_ends_is_given_up(monkeypatch):
    """A search may try a state that circles a centre at almost no distance."""
    monkeypatch.setattr(dynamics, "_MOST_STEPS", 1000)
    tight = Dynamics([PointMass()], {"GM": 1.0})
    state = [1e-3, 0, 0, 0, 1000.0**0.5, 0]  # a revolution in 2e-4
    follow = {
        4000: lambda: tight.propagate(state, [0.0, 1.0]),
        1000: lambda: tight.fly(state, 0.0, 0.0, 1.0),
        50: lambda: tight.fly(state, 0.0, 0.0, 1.0, most_steps=50),
    }
    for steps, run in follow.items():
        with pytest.raises(OrbitError, match=rf"is not followed beyond t = .* after {steps} steps"):
            run()
