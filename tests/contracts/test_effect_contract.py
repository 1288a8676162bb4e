"""What every effect must do; the effects are listed in `effect_cases`."""

import dataclasses
import math

import numpy as np
import pytest
from tests.contracts.effect_cases import EFFECT_CASES

from unmodeled.core.errors import ConfigError, DataError, OrbitError
from unmodeled.models.physics import Dynamics, PointMass, SphericalHarmonics, Zonal, compiled

EPS = np.finfo(float).eps
CASES = pytest.mark.parametrize("key", EFFECT_CASES)
CONSERVATIVE = pytest.mark.parametrize("key", [k for k, c in EFFECT_CASES.items() if c.potential])
# Where a source moves or the Sun sets, nothing is kept.
STEADY = pytest.mark.parametrize("key", [k for k, c in EFFECT_CASES.items() if c.steady])
HARMONIC = pytest.mark.parametrize("key", [k for k, c in EFFECT_CASES.items() if c.harmonic])
AXISYMMETRIC = pytest.mark.parametrize(
    "key", [k for k, c in EFFECT_CASES.items() if c.axisymmetric]
)
TIME = 0.8

# Where expressions divide by the distance from an axis or a plane, these points show it.
SPECIAL = np.array(
    [
        [1.5, 0, 0],
        [-1.5, 0, 0],
        [0, 1.5, 0],
        [0, -1.5, 0],
        [0, 0, 1.5],
        [0, 0, -1.5],
        [1.0, 1.0, 0],
        [1e-200, 0, 1.5],
    ]
)


def points(n=20):
    """Directions uniform on the sphere, 1.1 to 3 from the centre, special ones first."""
    generator = np.random.default_rng(11)
    x = generator.normal(size=(n, 3))
    x *= (generator.uniform(1.1, 3.0, n) / np.linalg.norm(x, axis=1))[:, None]
    return np.concatenate([SPECIAL, x])


def states(n=20):
    x = points(n)
    return np.hstack([x, np.random.default_rng(12).normal(size=x.shape)])


def where(key, n=20):
    """The least that the effect asks for: positions, or states."""
    return states(n) if EFFECT_CASES[key].needs_states else points(n)


def dynamics(key, with_mass=False):
    case = EFFECT_CASES[key]
    effects, values = [case.effect], dict(case.values)
    if with_mass and "gravity C(0,0)" not in case.effect.terms:
        effects.insert(0, PointMass())
    return Dynamics(effects, values, spinning=case.spinning, tracks=case.tracks)


def slope(function, steps):
    """Central differences at two step sizes: the derivative and a bound of its error.

    With errors E h^2 (truncation) at step h, the pair gives E; Richardson's extrapolation leaves
    what is of higher order, for which the whole correction is a generous bound.
    """
    h = steps
    wide = (function(h) - function(-h)) / (2 * h)
    narrow = (function(h / 2) - function(-h / 2)) / h
    size = np.abs(function(0.0)).max() + np.abs(function(h)).max()
    rounding = 20 * EPS * size / h
    return narrow + (narrow - wide) / 3, np.abs(narrow - wide).max() / 3 + rounding


@CASES
def test_shape_and_finiteness(key):
    model = dynamics(key)
    for x in (where(key), states()):
        n = len(x)
        a, partials = model.acceleration(x, TIME), model.state_partials(x, TIME)
        assert a.shape == (n, 3)
        assert partials.shape == (n, 3, 6)
        assert np.isfinite(a).all()
        assert np.isfinite(partials).all()
        names = [p.name for p in model.parameters]
        by_parameter = model.parameter_partials(x, names, TIME)
        assert by_parameter.shape == (n, 3, len(names))
        assert np.isfinite(by_parameter).all()
    assert model.acceleration(where(key)[:0]).shape == (0, 3)
    assert model.parameter_partials(where(key), []).shape == (len(where(key)), 3, 0)


@CASES
def test_one_point_at_a_time(key):
    model, x = dynamics(key), states()
    times = np.linspace(0.0, 5.0, len(x))
    together = model.acceleration(x, times)
    alone = [model.acceleration(x[k : k + 1], times[k])[0] for k in range(len(x))]
    # compiled for several points at a time, sine and square root may round differently
    np.testing.assert_allclose(alone, together, rtol=0, atol=10 * EPS * np.abs(together).max())


@CASES
def test_position_only_is_true(key):
    model, x = dynamics(key), states()
    assert EFFECT_CASES[key].effect.position_only is not EFFECT_CASES[key].needs_states
    if EFFECT_CASES[key].needs_states:
        with pytest.raises(
            DataError, match=r"^states has shape \(28, 3\)\. Allowed: shape \(n, 6\)"
        ):
            model.acceleration(x[:, :3], TIME)
        return
    assert np.array_equal(model.acceleration(x, TIME), model.acceleration(x[:, :3], TIME))
    assert not model.state_partials(x, TIME)[:, :, 3:].any()


@CASES
def test_state_partials(key):
    model, x = dynamics(key), states()
    partials = model.state_partials(x, TIME)
    for k in range(6):
        move = np.eye(6)[k]
        expected, bound = slope(lambda h, m=move: model.acceleration(x + h * m, TIME), 1e-3)
        np.testing.assert_allclose(partials[:, :, k], expected, rtol=0, atol=bound)


@CASES
def test_parameter_partials(key):
    model, x = dynamics(key), where(key)
    names = [p.name for p in model.parameters]
    partials = model.parameter_partials(x, names, TIME)
    for k, name in enumerate(names):
        value = model.values[name]

        def moved(h, name=name, value=value):
            return model.with_values({name: value + h}).acceleration(x, TIME)

        expected, bound = slope(moved, 1e-3)
        np.testing.assert_allclose(partials[:, :, k], expected, rtol=0, atol=bound)


@CONSERVATIVE
def test_acceleration_is_the_gradient_of_the_potential(key):
    model, x = dynamics(key), points()
    a = model.acceleration(x, TIME)
    assert model.potential(x, TIME).shape == (len(x),)
    for k in range(3):
        move = np.eye(3)[k]
        expected, bound = slope(lambda h, m=move: model.potential(x + h * m, TIME), 1e-3)
        np.testing.assert_allclose(a[:, k], expected, rtol=0, atol=bound)


@CONSERVATIVE
def test_curl_free(key):
    gradient = dynamics(key).state_partials(points(), TIME)[:, :, :3]
    # sums of at most a few hundred terms of the size of the largest entry
    bound = 500 * EPS * np.abs(gradient).max()
    np.testing.assert_allclose(gradient, np.swapaxes(gradient, 1, 2), rtol=0, atol=bound)


@HARMONIC
def test_laplace(key):
    gradient = dynamics(key).state_partials(points(), TIME)[:, :, :3]
    bound = 500 * EPS * np.abs(gradient).max()
    np.testing.assert_allclose(np.trace(gradient, axis1=1, axis2=2), 0.0, atol=bound)


@AXISYMMETRIC
def test_turning_about_z_changes_nothing(key):
    model, x = dynamics(key), states()
    c, s = math.cos(1.234), math.sin(1.234)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    a = model.acceleration(x)
    bound = 50 * EPS * np.abs(a).max()
    turned = np.hstack([x[:, :3] @ turn.T, x[:, 3:] @ turn.T])
    np.testing.assert_allclose(model.acceleration(turned), a @ turn.T, rtol=0, atol=bound)


@STEADY
def test_energy_or_jacobi_integral_is_kept(key):
    """E - omega h_z is kept in a field that turns about z with omega; E for omega = 0."""
    model = dynamics(key, with_mass=True)
    start = np.array([2.4, 0.1, 0.3, 0.05, 0.5, 0.4])
    times = np.linspace(0.0, 300.0, 400)  # about 10 revolutions
    orbit = model.propagate(start, times)
    x, v = orbit[:, :3], orbit[:, 3:]
    energy = 0.5 * np.sum(v**2, axis=1) - model.potential(x, times)
    spin = EFFECT_CASES[key].values.get("spin_rate", 0.0)
    integral = energy - spin * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])
    scale = np.abs(0.5 * np.sum(v**2, axis=1)).max() + np.abs(model.potential(x, times)).max()
    # Taylor steps at machine precision: some eps a step, about 20 steps a revolution, adding up
    # at worst linearly.
    assert np.abs(integral - integral[0]).max() < 10 * 20 * 3 * EPS * scale
    if spin:
        assert np.ptp(energy) > 1e6 * EPS * scale  # the energy itself is not kept


@CASES
def test_parameters_are_described_and_bounded(key):
    model = dynamics(key)
    for p in model.parameters:
        assert p.unit
        assert p.description
        assert p.scale > 0
        assert p.lower <= p.value <= p.upper
    assert model.values == {p.name: p.value for p in model.parameters}
    names = [p.name for p in model.parameters]
    assert len(set(names)) == len(names)


@CASES
def test_unknown_parameter(key):
    model = dynamics(key, with_mass=True)  # which brings GM to those that have none
    for call in (
        lambda: model.with_values({"gm": 1.0}),
        lambda: model.parameter_partials(states(), ["gm"]),
        lambda: model.propagate_variational(np.ones(6), [0.0, 1.0], ["gm"]),
    ):
        with pytest.raises(ConfigError) as caught:
            call()
        assert str(caught.value) == 'unknown parameter "gm". Did you mean "GM"?'
    with pytest.raises(ConfigError, match=r"^parameters GM, GM\. Allowed: each name once\.$"):
        model.parameter_partials(states(), ["GM", "GM"])


@CASES
def test_value_out_of_bounds(key):
    with pytest.raises(ConfigError) as caught:
        dynamics(key, with_mass=True).with_values({"GM": -1.0})
    assert str(caught.value) == "parameter GM = -1.0 m3 s-2. Allowed: 0.0 to inf m3 s-2."


@CASES
def test_effects_are_frozen_values(key):
    effect = EFFECT_CASES[key].effect
    same = dataclasses.replace(effect)
    assert same is not effect
    assert same == effect
    assert hash(same) == hash(effect)
    for field in (*[f.name for f in dataclasses.fields(effect)], "new"):
        with pytest.raises((dataclasses.FrozenInstanceError, TypeError)):
            setattr(effect, field, 3)
    assert effect.terms
    assert effect.name
    assert effect.axes in ("inertial", "body")
    card = " ".join(type(effect).__doc__.split())
    assert "Source: [" in card
    assert "ot to be combined" in card or "must not be" in card


@CASES
def test_a_new_value_leaves_the_model_alone_and_compiles_nothing(key):
    model, x = dynamics(key, with_mass=True), states()
    names = tuple(p.name for p in model.parameters)
    start, times = [2.4, 0.1, 0.3, 0.05, 0.5, 0.4], [0.0, 0.1]
    caches = [
        compiled.acceleration_function,
        compiled.state_partials_function,
        compiled.parameter_partials_function,
        compiled.potential_function,
        compiled.integrator,
        compiled.variational_integrator,
    ]

    def use(m):
        m.propagate(start, times)
        m.propagate_variational(start, times, names[:1])
        return np.hstack(
            [
                m.acceleration(x, TIME),
                m.state_partials(x, TIME).reshape(len(x), -1),
                m.parameter_partials(x, names[:1], TIME)[:, :, 0],
                *([m.potential(x, TIME)[:, None]] if EFFECT_CASES[key].potential else []),
            ]
        )

    before, values = use(model), model.values
    misses = [c.cache_info().misses for c in caches]
    other = model.with_values({"GM": 2.0 * values["GM"]})
    rebuilt = Dynamics(
        [dataclasses.replace(e) for e in model.effects],
        values,
        spinning=EFFECT_CASES[key].spinning,
        tracks=EFFECT_CASES[key].tracks,
    )
    assert not np.array_equal(use(other), before)
    assert np.array_equal(use(rebuilt), before)
    assert np.array_equal(use(model), before)
    assert [c.cache_info().misses for c in caches] == misses
    assert model.values == values
    model.values["GM"] = 7.0  # a copy
    assert model.values == values


@CASES
def test_no_term_twice(key):
    effect = EFFECT_CASES[key].effect
    with pytest.raises(ConfigError) as caught:
        Dynamics([effect, dataclasses.replace(effect)])
    term = min(effect.terms)
    assert str(caught.value) == (
        f'the force model contains "{term}" twice ({effect.name}, {effect.name}). '
        "Allowed: each term once. Drop one of the effects or change its degrees."
    )


@pytest.mark.parametrize(
    ("effects", "term", "who"),
    [
        (
            [PointMass(), SphericalHarmonics(4, min_degree=0)],
            "gravity C(0,0)",
            "point_mass, spherical_harmonics",
        ),
        ([Zonal((2,)), SphericalHarmonics(2)], "gravity C(2,0)", "zonal, spherical_harmonics"),
        ([Zonal((2, 3)), PointMass(), Zonal((3,))], "gravity C(3,0)", "zonal, zonal"),
    ],
)
def test_the_same_term_in_two_effects(effects, term, who):
    with pytest.raises(ConfigError) as caught:
        Dynamics(effects)
    assert str(caught.value) == (
        f'the force model contains "{term}" twice ({who}). Allowed: each term once. '
        "Drop one of the effects or change its degrees."
    )


def test_effects_that_share_parameters_but_no_term_combine():
    model = Dynamics([PointMass(), Zonal((2,)), SphericalHarmonics(4, 0, min_degree=3)])
    names = [p.name for p in model.parameters]
    assert names == ["GM", "R_ref", "J2", "C_3_0", "C_4_0"]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Dynamics([]), "a force model without effects. Add at least a point mass."),
        (lambda: Zonal(()), "zonal degrees are (). Allowed: different integers of 2 or more."),
        (
            lambda: Zonal([1, 2]),
            "zonal degrees are (1, 2). Allowed: different integers of 2 or more.",
        ),
        (
            lambda: Zonal((2, 2)),
            "zonal degrees are (2, 2). Allowed: different integers of 2 or more.",
        ),
        (
            lambda: SphericalHarmonics(1),
            "spherical harmonics from degree 2 to 1. Allowed: 0 <= min_degree <= degree.",
        ),
        (
            lambda: SphericalHarmonics(3, order=4),
            "spherical harmonics of degree 3 and order 4. Allowed: 0 <= order <= degree.",
        ),
    ],
)
def test_structures_that_make_no_sense(make, text):
    with pytest.raises(ConfigError) as caught:
        make()
    assert str(caught.value) == text


@CASES
def test_bad_points_and_times(key):
    model = dynamics(key)
    what, width = ("states", 6) if EFFECT_CASES[key].needs_states else ("positions", 3)
    for points_, times, text in (
        ([1.0, 2.0, 3.0], 0.0, f"{what} has shape (3,). Allowed: shape (n, {width})."),
        ([[1.0, 2.0]], 0.0, f"{what} has shape (1, 2). Allowed: shape (n, {width})."),
        (np.ones((2, width)), [0.0], "times has shape (1,). Allowed: shape (2,)."),
    ):
        with pytest.raises(DataError) as caught:
            model.acceleration(points_, times)
        assert str(caught.value) == text
    with pytest.raises(DataError, match=f"{what} has 1 value"):
        model.acceleration([[1.0, np.nan] + [0.0] * (width - 2)])


def test_falling_into_the_centre_breaks_down_with_a_reason():
    # Radial fall from r = 2 with GM = 1 takes pi (half the period of an ellipse with a = 1).
    with pytest.raises(OrbitError, match=r"^the orbit breaks down at t = 3\.14.*\. Check that it"):
        Dynamics([PointMass()]).propagate([2.0, 0, 0, 0, 0, 0], [0.0, 10.0])
