"""Scenarios and flights: truth, draws, floor, judgement; bad input."""

import re
from pathlib import Path

import numpy as np
import pytest

import unmodeled as um
from unmodeled.core.errors import ConfigError, OrbitError
from unmodeled.pipeline.filters.basis import HarmonicBasis
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.navigation.cislunar_truth import RangeAndRate, cislunar_flight
from unmodeled.pipeline.navigation.contestants import build, contestant_names
from unmodeled.pipeline.navigation.flight import draw
from unmodeled.pipeline.navigation.formation_truth import formation_flight
from unmodeled.pipeline.navigation.learning_contestants import TurningBasis
from unmodeled.pipeline.navigation.navigate import fly
from unmodeled.pipeline.navigation.network_contestant import fed_back, train_on_dmc
from unmodeled.pipeline.navigation.scenario_config import load_scenario, resolve_scenario
from unmodeled.pipeline.navigation.small_body_truth import small_body_flight

ROOT = Path(__file__).resolve().parents[3]
FORMATION = ROOT / "scenarios" / "leo-formation-gnss.yaml"
BENNU = ROOT / "scenarios" / "bennu-proximity.yaml"
CISLUNAR = ROOT / "scenarios" / "cislunar-paper.yaml"


def short_formation(**changes):
    """A formation under J2 alone: no Earth orientation to compile."""
    content = {"truth": "j2", "duration_s": 9000.0, "gap_orbits": [0.5, 0.8], "settle_s": 1500.0}
    return load_scenario(FORMATION, **(content | changes))


@pytest.fixture(scope="module")
def formation():
    return formation_flight(short_formation())


def test_all_scenarios_are_read():
    names = []
    for path in sorted((ROOT / "scenarios").glob("*.yaml")):
        if re.search(r"^kind:", path.read_text(encoding="utf-8"), re.MULTILINE):
            config = load_scenario(path)
            names.append(config.name)
            assert config.name == path.stem
            assert set(config.filters) <= set(contestant_names())
            assert resolve_scenario(config.as_dict()).hash == config.hash
    assert {"leo-formation", "leo-formation-gnss", "cislunar", "bennu-proximity"} <= set(names)


def test_the_start_is_that_of_the_papers(formation):
    """[Marchese2023] Eq. 4.3; its x velocity is in m/s, not mm/s."""
    truth = formation.truth[0]
    np.testing.assert_allclose(truth[1], -12.22, atol=0.005)
    np.testing.assert_allclose(truth[0], -1.20e-5, atol=5e-8)
    np.testing.assert_allclose(truth[3], -1.727e-3, atol=5e-7)
    assert formation.facts["period_s"] == pytest.approx(7313.0, abs=0.5)


def test_the_nonlinear_model_is_all_of_a_j2_truth(formation):
    assert formation.nonlinear is not None
    rate = np.concatenate(
        [
            formation.nonlinear.rates(x[None], t)[0][:, 3:]
            for x, t in zip(formation.truth, formation.times, strict=True)
        ]
    )
    base = formation.base.rates(formation.truth, 0.0)[0][:, 3:]
    inner = slice(3, -3)  # the spline's ends are less exact
    difference = (rate - base - formation.disturbance)[inner]
    # n^4 h^3 d / 24 of the spline is 2e-10 at 30 s; the disturbance is 1e-6
    assert np.abs(difference).max() < 5e-10
    assert np.abs(formation.disturbance).max() > 1e-6


def test_draws_do_not_depend_on_the_number_of_runs(formation):
    few, many = draw(formation, 2, 5), draw(formation, 4, 5)
    np.testing.assert_array_equal(few[0], many[0][:2])
    np.testing.assert_array_equal(few[1], many[1][:, :2])
    assert np.isnan(few[1][0]).all()
    inside = formation.during("gap")
    assert np.isnan(few[1][inside][1:-1]).all()


def test_filters_beside_each_other(formation):
    """The true model stays at the floor, CW does not cheat, DMC sees the disturbance."""
    names = ["kf", "dmc", "pinn", "nonlinear", "exact"]
    config = short_formation(filters=names, runs=8)
    result = fly(config, formation)
    table = result.table.set_index("filter")
    assert (table["failure"] == "").all()
    ratio = table["position_rmse_m"] / result.floor_position_m
    # 8 runs of correlated errors: 15 % is six standard errors of the mean square
    assert ratio["exact"] == pytest.approx(1.0, abs=0.3)
    assert (ratio > 0.7).all()
    assert table.loc["nonlinear", "max_in_gap_m"] < table.loc["kf", "max_in_gap_m"]
    assert (
        table.loc["pinn", "disturbance_rmse_m_s2"] < 0.5 * table.loc["dmc"]["disturbance_rmse_m_s2"]
    )
    size = np.sqrt((formation.disturbance**2).sum(axis=1).mean())
    assert table.loc["dmc", "disturbance_rmse_m_s2"] < size
    assert result["exact"].nees.mean() == pytest.approx(6.0, abs=2.0)


@pytest.fixture(scope="module")
def moon():
    return cislunar_flight(load_scenario(CISLUNAR, steps=1500))


def test_cislunar_disturbance_is_found(moon):
    """The Sun's tide 2 m d / r^3 + 3 m d^2 / r^4 at the start; NIS of two measurements is 2."""
    size = np.linalg.norm(moon.disturbance, axis=1)
    tide = 328900.54 * (2.0 / 388.81114**3 + 3.0 / 388.81114**4)
    # the next term, 4 m d^3 / r^5, is 1.5e-7
    assert size[0] == pytest.approx(tide, abs=1e-6)
    assert size.max() == pytest.approx(0.011, rel=0.05)
    config = load_scenario(CISLUNAR, steps=1500, runs=4, filters=["dmc"])
    result = fly(config, moon)
    assert 2.0 * result.table["nis"][0] == pytest.approx(2.0, abs=0.1)


def test_a_network_learns_what_dmc_estimates(moon):
    """Most of a disturbance that hardly changes in 7 hours; nothing out of the plane."""
    trained = train_on_dmc(moon, 1, 7.1e-3, 1.0, epochs=200)
    assert trained.label_percent < 20.0
    assert trained.truth_percent < 20.0
    assert "off the truth" in trained.sentence
    assert not trained.network.evaluate(moon.truth[:5], 0.0)[0][:, 2].any()
    contestant = fed_back(moon, moon.truth[:1], trained.network, 1e-3, 1.0)
    assert contestant.start.mean.shape == (1, 9)


def test_range_partials():
    model, h = RangeAndRate(1e-8, 1e-5), 1e-6
    x = np.array([[1.0, 0.1, 0.05, 0.1, 0.5, -0.2, 7.0]])
    _, H = model.h(x, 0.0)
    for k in range(7):
        step = np.zeros(7)
        step[k] = h
        slope = (model.h(x + step, 0.0)[0] - model.h(x - step, 0.0)[0]) / (2 * h)
        # truncation h^2, rounding 1e-16 / h
        np.testing.assert_allclose(H[0, :, k], slope[0], atol=1e-9)


def short_bennu(**changes):
    content = {
        "duration_s": 86400.0,
        "measured": {"step_s": 300.0, "position_m": 1.0},
        "gap_s": [43200, 50400],
        "transfer": {"at_s": 64800, "semi_major_axis_km": 0.68, "coast_s": 7200},
        "settle_s": 21600,
    }
    return load_scenario(BENNU, **(content | changes))


def test_harmonics_learned_in_flight_carry_through_a_gap():
    config = short_bennu(runs=3, filters=["dmc", "harmonic"])
    flight = small_body_flight(config)
    assert len(flight.impulses) == 1
    table = fly(config, flight).table.set_index("filter")
    assert (table["failure"] == "").all()
    assert table.loc["harmonic", "max_in_gap_m"] < 0.5 * table.loc["dmc", "max_in_gap_m"]


def test_a_turning_basis_is_the_basis_in_body_axes():
    inner = HarmonicBasis(3, 4.89, 290.0)
    basis, x, w = TurningBasis(inner, 4e-4), np.array([[300.0, 400.0, 100.0, 0, 0, 0]]), 0.01
    weights = w * np.random.default_rng(2).normal(size=(1, basis.size))
    np.testing.assert_allclose(basis.evaluate(x, 0.0), inner.evaluate(x, 0.0), rtol=1e-14)
    t, h = 900.0, 1e-3
    slope = basis.slope(x, t, weights)
    for k in range(3):
        step = np.zeros(6)
        step[k] = h
        up, down = (basis.evaluate(x + s * step, t) @ weights[0] for s in (1, -1))
        # differences of 1e-7 m/s2 over 2e-3 m: truncation 1e-15, rounding 1e-20
        np.testing.assert_allclose(slope[0, :, k], (up - down)[0] / (2 * h), atol=1e-13)
    whole = basis.evaluate(x, 2 * np.pi / 4e-4)
    np.testing.assert_allclose(whole, inner.evaluate(x, 0.0), rtol=1e-8, atol=1e-16)


def test_unknown_names_suggest_the_nearest(formation):
    content = load_scenario(FORMATION).as_dict()
    with pytest.raises(ConfigError, match='unknown key "setle_s", did you mean "settle_s"'):
        resolve_scenario(content | {"setle_s": 1.0})
    with pytest.raises(ConfigError, match=r'kind "formatoin"\. Did you mean "formation"'):
        resolve_scenario(content | {"kind": "formatoin"})
    with pytest.raises(ConfigError, match="no kind"):
        resolve_scenario({"name": "x", "body": "bennu"})
    with pytest.raises(ConfigError, match='filter "kf" is listed twice'):
        resolve_scenario(content | {"filters": ["kf", "kf"]})
    with pytest.raises(ConfigError, match=r'no filter "dmcc"\. Did you mean "dmc"'):
        um.navigate(FORMATION, filters=["dmcc"])
    with pytest.raises(ConfigError, match="--learner with the formation scenario"):
        um.navigate(FORMATION, learner="field.safetensors")
    with pytest.raises(ConfigError, match='"nose"'):
        build("kf", formation, formation.truth[:1], {"nose": 1.0})
    with pytest.raises(ConfigError, match='filter "kf" has no noise'):
        build("kf", formation, formation.truth[:1], {})
    with pytest.raises(ConfigError, match="harmonics in formation"):
        build("harmonic", formation, formation.truth[:1], {"noise": 1e-9})
    with pytest.raises(ConfigError, match="Give --learner"):
        build("learned", formation, formation.truth[:1], {})


def test_bad_flights():
    with pytest.raises(ConfigError, match="first the gap, then the transfer"):
        small_body_flight(short_bennu(gap_s=[43200, 72000]))
    deep = short_bennu(transfer={"at_s": 64800, "semi_major_axis_km": 0.45, "coast_s": 7200})
    with pytest.raises(OrbitError, match="Brillouin sphere"):
        small_body_flight(deep)
    with pytest.raises(ConfigError, match='tesserals has "C_9_9"'):
        small_body_flight(short_bennu(tesserals={"C_9_9": 0.1}))


def test_a_learned_field_flies(tmp_path):
    """The field of a file is the residual: with the true one the gap is harmless."""
    from unmodeled.core.units import NormalisedUnits
    from unmodeled.models.learned import learner_class
    from unmodeled.pipeline.learned_field import LearnedField

    flight = small_body_flight(short_bennu())
    units = NormalisedUnits.of_body(4.89, 290.0)
    x = flight.truth[::5, :3] / units.length
    rate, _ = flight.exact.rates(flight.truth[::5], 0.0)
    learner = learner_class("harmonic_least_squares")()
    learner.fit(x, rate[:, 3:] / units.acceleration)
    path = tmp_path / "field.safetensors"
    LearnedField(learner, units).save(path)
    config = short_bennu(runs=2, filters=["kf"])
    result = um.navigate(config, learner=path)
    table = result.table.set_index("filter")
    assert list(table.index) == ["kf", "learned"]
    assert table.loc["learned", "max_in_gap_m"] < 0.2 * table.loc["kf", "max_in_gap_m"]
    assert "field.safetensors" in result.notes[0]


def test_a_field_learned_in_body_axes_turns_with_the_body():
    from unmodeled.core.frames import body_fixed_from_inertial, turned
    from unmodeled.core.units import NormalisedUnits
    from unmodeled.models.learned import learner_class
    from unmodeled.pipeline.learned_field import LearnedField
    from unmodeled.pipeline.navigation.learning_contestants import fixed_field

    flight = small_body_flight(short_bennu(spins=True, tesserals={"C_2_2": 0.02, "S_3_1": 0.01}))
    rate = flight.facts["spin_rate"]
    assert rate > 0.0
    units = NormalisedUnits.of_body(4.89, 290.0)
    true = np.stack(
        [
            flight.exact.rates(x[None], t)[0][0, 3:]
            for x, t in zip(flight.truth, flight.times, strict=True)
        ]
    )
    axes = body_fixed_from_inertial(flight.times, rate)
    learner = learner_class("harmonic_least_squares")()
    learner.fit(
        turned(axes, flight.truth[:, :3]) / units.length, turned(axes, true) / units.acceleration
    )
    made = fixed_field(flight, flight.truth[:1], LearnedField(learner, units, "body_fixed"), 1e-8)
    model = made.filter.model
    for k in (0, len(flight.times) // 2, len(flight.times) - 1):
        x, t = flight.truth[k : k + 1], float(flight.times[k])
        after, F = model.propagate(x, t, 60.0)
        exact, slope = RungeKutta(flight.exact).propagate(x, t, 60.0)
        np.testing.assert_allclose(after, exact, rtol=0, atol=1e-4)
        np.testing.assert_allclose(F, slope, rtol=0, atol=1e-4 * np.abs(slope).max())
    still = fixed_field(flight, flight.truth[:1], LearnedField(learner, units), 1e-8).filter.model
    wrong = still.propagate(x, t, 60.0)[0]
    assert np.abs(wrong - exact).max() > 100 * np.abs(after - exact).max()


def test_the_predicted_measurement_is_deterministic(formation):
    """The public code of [Fereoli2024] adds noise to it: NIS 4 instead of 2."""
    first = formation.measurement.h(formation.truth, 0.0)[0]
    np.testing.assert_array_equal(first, formation.measurement.h(formation.truth, 0.0)[0])
    starts, z = draw(formation, 2, 3)
    made = build("kf", formation, starts, {"noise": 1e-5})
    runs = [
        run_filter(made.filter, made.start, formation.times, z, formation.used) for _ in range(2)
    ]
    np.testing.assert_array_equal(runs[0].mean, runs[1].mean)
