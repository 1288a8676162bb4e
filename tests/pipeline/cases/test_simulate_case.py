"""Simulated cases: the hidden strength is the one asked for, and the truth stays apart."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.pipeline.cases.load_case import load_case
from unmodeled.pipeline.cases.outside_effects import outside_effects
from unmodeled.pipeline.cases.quantities import parse_quantity
from unmodeled.pipeline.cases.scenario_orbits import SCENARIOS, scenario
from unmodeled.pipeline.cases.simulate_case import HiddenEffect, scenario_case, simulate
from unmodeled.pipeline.cases.simulated_files import TRUTH_FILE, simulate_case
from unmodeled.pipeline.yaml12 import read_yaml

#: Noise so small that the cost is what the hidden effect alone makes of it.
QUIET = 1e-5


@pytest.mark.parametrize(
    "name",
    [
        "srp",
        "constant_transverse",
        "manoeuvre",
        "gm_error",
        "zonal_2",
        "tesseral_4_2",
        "frame_rotation",
        "pulse_train",
        "whirl",
    ],
)
def test_the_cost_left_by_a_hidden_effect_is_its_noncentrality(name):
    """Chi-square of the known model on data without noise: lambda, by definition."""
    hidden = [HiddenEffect(name, noncentrality=100.0)]
    sim = simulate("bennu", 3, hidden, noise_factor=QUIET)
    # The amplitude is exact for small effects; a few per cent remain of the next order.
    assert sim.case.fit().cost == pytest.approx(100.0, rel=0.05)
    assert "srp" in {c.name for c in sim.case.candidates}
    assert sim.case.dynamics.values == scenario_case("bennu", 3).dynamics.values


@pytest.mark.slow
@pytest.mark.parametrize("name", ["range_bias[goldstone-range]", "station_position[madrid]"])
def test_instruments_can_be_wrong_too(name):
    hidden = [HiddenEffect(name, noncentrality=30.0)]
    sim = simulate("leo_tracking", 1, hidden, noise_factor=QUIET)
    assert sim.case.fit().cost == pytest.approx(30.0, rel=0.05)
    assert not sim.case.instruments


def test_the_right_model_fits_its_own_truth():
    """With the hidden effects put in, at their true values, only noise is left."""
    hidden = [
        HiddenEffect("srp", noncentrality=1000.0),
        HiddenEffect("zonal_5", {"J5": 0.01}),
    ]
    sim = simulate("bennu", 4, hidden)
    assert sim.truth["zonal_5"]["J5"] == 0.01
    named = {c.name: c for c in sim.case.candidates}
    full = sim.case
    for name, values in sim.truth.items():
        full = full.with_effect(named[name], values, {})
    fit = full.fit()
    assert abs(fit.cost - fit.freedom) < 4 * np.sqrt(2 * fit.freedom)
    error = fit.states[0] - sim.states[0]
    assert error @ np.linalg.solve(fit.covariance[:6, :6], error) < 26.0  # chi2(6), 1 in 5000
    assert sim.case.fit().cost > fit.cost + 500


def test_two_hidden_effects_of_one_kind_act_both():
    """Both are parameters of one push along radial, transverse and normal: neither replaces one."""
    pushes = {"constant_radial": {"rtn_a_R": 2e-10}, "constant_normal": {"rtn_a_N": 3e-10}}

    def data(*names):
        hidden = [HiddenEffect(n, pushes[n]) for n in names]
        return simulate("bennu", 5, hidden).data[0].values

    quiet = data()
    radial, normal = data("constant_radial") - quiet, data("constant_normal") - quiet
    both = data("constant_radial", "constant_normal") - quiet
    # Linear up to the square of a push that is 1e-5 of gravity.
    size = np.abs(radial).max() + np.abs(normal).max()
    np.testing.assert_allclose(both, radial + normal, atol=1e-3 * size)
    assert min(np.abs(radial).max(), np.abs(normal).max()) > 0.1 * size


def test_noise_can_be_other_than_stated():
    fit = simulate("bennu", 5, noise_factor=2.0).case.fit()
    assert fit.cost / fit.freedom == pytest.approx(4.0, rel=0.2)


def test_files_hold_the_same_case_and_the_truth_is_not_read(tmp_path):
    hidden = [HiddenEffect("constant_transverse", noncentrality=50.0)]
    path = simulate_case("bennu", hidden, seed=6, folder=tmp_path / "one", held_out=True)
    truth = read_yaml(path.parent / TRUTH_FILE)
    sim = simulate("bennu", 6, hidden, held_out=True)
    push = parse_quantity(truth["hidden"]["constant_transverse"]["rtn_a_T"], "m s-2", "push")
    assert push == sim.truth["constant_transverse"]["rtn_a_T"]
    (path.parent / TRUTH_FILE).unlink()
    case = load_case(path)
    pairs = zip((*case.arcs, *case.held_out), (*sim.case.arcs, *sim.case.held_out), strict=True)
    for read, made in pairs:
        np.testing.assert_array_equal(read.state, made.state)
        # Turned to ICRF axes for the file, and back: rounding.
        a, b = read.measurements[0], made.measurements[0]
        np.testing.assert_allclose(a.values, b.values, atol=1e-12)
        np.testing.assert_array_equal(a.sigmas, b.sigmas)
    assert case.dynamics.values == sim.case.dynamics.values
    assert [c.name for c in case.candidates] == [c.name for c in sim.case.candidates]
    assert "constant_transverse" not in path.read_text()
    with pytest.raises(ConfigError, match="holds a case already"):
        simulate_case("bennu", hidden, seed=6, folder=tmp_path / "one")


def test_a_case_is_the_same_each_time_and_another_for_another_seed():
    one, two, other = (simulate("bennu", seed).data[0].values for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_draws_orbits_and_keeps_its_structure(name):
    drawn = [scenario(name, seed, held_out=True) for seed in range(20)]
    assert len({tuple(d.flights[0].state) for d in drawn}) == 20
    assert len({repr(d.mapping["known"]) for d in drawn}) == 1
    assert len({tuple(f.times[0] for f in d.flights) for d in drawn}) == 1
    assert [f.held_out for f in drawn[0].flights] == [False, True]
    assert not np.array_equal(drawn[0].flights[0].state, drawn[0].flights[1].state)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_fits_its_own_data(name):
    sim = simulate(name, 7)
    fit = sim.case.fit()
    assert abs(fit.cost - fit.freedom) < 4 * np.sqrt(2 * fit.freedom)


def test_what_cannot_be_hidden_is_said():
    with pytest.raises(ConfigError, match='there is no scenario "benu"'):
        scenario("benu", 1)
    with pytest.raises(ConfigError, match='there is no candidate "spr"'):
        simulate("bennu", 1, [HiddenEffect("spr")])
    with pytest.raises(ConfigError, match='srp has no parameter "A2"'):
        simulate("bennu", 1, [HiddenEffect("srp", {"A2": 1.0})])
    with pytest.raises(ConfigError, match="noncentrality is -1"):
        simulate("bennu", 1, [HiddenEffect("srp", noncentrality=-1.0)])
    # The clock's zero is arbitrary about a body whose forces hardly know the time.
    with pytest.raises(NumericalError, match="the measurements do not see time_tag"):
        simulate("bennu", 1, [HiddenEffect("time_tag", noncentrality=30.0)])


def test_no_candidate_is_an_outside_effect():
    case = scenario_case("bennu", 1)
    assert {c.name for c in outside_effects(case)}.isdisjoint(c.name for c in case.candidates)
