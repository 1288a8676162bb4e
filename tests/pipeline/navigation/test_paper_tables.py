"""What the papers' tables are computed with: integrators, fits, wrong tuning, learning rules."""

from pathlib import Path

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics.motion.clohessy_wiltshire import clohessy_wiltshire_transition
from unmodeled.pipeline.navigation.cislunar_truth import cislunar_flight
from unmodeled.pipeline.navigation.contestants import build
from unmodeled.pipeline.navigation.disturbance_errors import disturbance_errors
from unmodeled.pipeline.navigation.disturbance_fit import fit_disturbance
from unmodeled.pipeline.navigation.flight import draw
from unmodeled.pipeline.navigation.formation_truth import formation_flight
from unmodeled.pipeline.navigation.integration_error import (
    MEAN_MOTION,
    euler_transition,
    integration_error,
    runge_kutta_transition,
)
from unmodeled.pipeline.navigation.navigate import fly
from unmodeled.pipeline.navigation.off_nominal import draw_factors, mistune, off_nominal
from unmodeled.pipeline.navigation.scenario_config import load_scenario

ROOT = Path(__file__).resolve().parents[3]
DENSE = ROOT / "scenarios" / "leo-formation.yaml"
SPARSE = ROOT / "scenarios" / "leo-formation-gnss.yaml"


@pytest.fixture(scope="module")
def dense():
    """Ten minutes under J2 alone, position and velocity each second."""
    config = load_scenario(DENSE, truth="j2", duration_s=600.0, settle_s=200.0, runs=12)
    return config, formation_flight(config)


@pytest.fixture(scope="module")
def sparse():
    config = load_scenario(SPARSE, truth="j2", duration_s=9000.0, gap_orbits=None, settle_s=4000.0)
    return config, formation_flight(config)


def test_euler_is_of_first_order_and_as_printed():
    """[Marchese2023] Table 3.3: 0.6870 m at 1 s; half the step, half the error."""
    one = integration_error(lambda: euler_transition(1.0))
    half = integration_error(lambda: euler_transition(0.5))
    assert one.position.mean() == pytest.approx(0.6870, rel=0.01)
    assert one.velocity.max() == pytest.approx(2.0259e-3, rel=0.01)
    assert one.position.mean() / half.position.mean() == pytest.approx(2.0, rel=0.01)


def test_runge_kutta_and_the_closed_form_are_as_good_as_rounding():
    runge_kutta = integration_error(runge_kutta_transition)
    exact = integration_error(lambda: clohessy_wiltshire_transition(MEAN_MOTION, 30.0))
    assert len(exact.times) == 1200
    # 1,200 steps, rounding of 10 m (2e-15 m) that the drift carries along
    assert runge_kutta.position.max() < 1e-8
    assert exact.position.max() < 1e-8
    with pytest.raises(ConfigError, match=r"an Euler step of 7 s\. Allowed: a whole share of 30"):
        euler_transition(7.0)


def test_as_many_gaussians_as_samples_repeat_the_noise(sparse):
    _, flight = sparse
    noise = 1e-6
    few = fit_disturbance(flight, 30, 1e-2, noise)
    all_of_them = fit_disturbance(flight, len(flight.times), 1e4, noise)
    # the mean length of white noise on three axes is 1.596 sigma; six standard errors of 301
    spread = 6 * 0.67 / np.sqrt(len(flight.times))
    assert all_of_them.length_errors[0] / noise == pytest.approx(1.596, abs=spread)
    assert few.length_errors[0] < 0.7 * all_of_them.length_errors[0]
    mean, largest = few.axis_errors
    assert few.length_errors[0] <= mean.sum()
    assert np.all(mean < largest)
    with pytest.raises(ConfigError, match="302 neurons"):
        fit_disturbance(flight, len(flight.times) + 1, 1.0, noise)


def test_factors_span_what_is_asked_for():
    factors = draw_factors(2000, 1)
    assert factors.min() == pytest.approx(0.1, rel=0.02)
    assert factors.max() == pytest.approx(10.0, rel=0.02)
    assert np.mean(factors < 1.0) == pytest.approx(0.5, abs=6 * 0.5 / np.sqrt(2000))
    # the tenth run has the same factor, however many follow
    np.testing.assert_array_equal(draw_factors(10, 1), factors[:10])


def test_each_run_flies_its_own_noise(dense):
    """Run i of a mistuned batch is run i of a batch whose tuning is wrong by its factor."""
    config, flight = dense
    starts, z = draw(flight, 3, config.seed)
    factor = np.array([0.1, 1.0, 10.0])
    for name in ("kf", "rbf", "rbf_adaptive", "observer"):
        tuning = dict(config.tuning[name])
        wrong = mistune(build(name, flight, starts, tuning), factor)
        state = wrong.filter.start(wrong.start)
        before = wrong.filter.predict(state, 1.0)
        after = wrong.filter.update(before, z[1])
        if name == "observer":
            tuning |= {k: 10.0 * tuning[k] for k in ("position_gain", "velocity_gain")}
        else:
            tuning["noise"] *= np.sqrt(10.0)
        alone = build(name, flight, starts[2:], tuning)
        state = alone.filter.start(alone.start)
        right = alone.filter.update(alone.filter.predict(state, 1.0), z[1, 2:])
        np.testing.assert_allclose(after.state.mean[2], right.state.mean[0], rtol=1e-9)
        if name != "observer":
            np.testing.assert_allclose(before.noise[2], alone.filter.predict(state, 1.0).noise[0])


def test_a_wrong_gain_hurts_an_observer_more_than_a_filter(dense):
    config, flight = dense
    table = off_nominal(config, flight, ("observer", "kf"))
    assert len(table) == 24
    assert (table.groupby("filter")["factor"].nunique() == 12).all()
    worst = table.groupby("filter")["position_rmse_m"].max()
    assert worst["observer"] > 2 * worst["kf"]


def test_a_filter_without_noise_cannot_be_mistuned():
    class Other:
        pass

    with pytest.raises(ConfigError, match="a filter of type Other has no Q"):
        mistune(type("C", (), {"filter": Other(), "start": None})(), np.ones(1))


def test_learning_rules_find_the_disturbance(sparse):
    config, flight = sparse
    changes = {
        "measured": {"step_s": 30.0, "position_m": 0.01},
        "truth": "j2",
        "duration_s": 9000.0,
        "gap_orbits": None,
        "settle_s": 4000.0,
        "runs": 2,
        "tuning": {
            "gradient": {"noise": 3e-6, "rate": 0.1, "relaxation": 0.99},
            "kf": {"noise": 1},
        },
    }
    config = load_scenario(SPARSE, **changes)
    flight = formation_flight(config)
    error = disturbance_errors(config, flight, ("gradient",))["gradient"]
    size = np.linalg.norm(flight.disturbance[flight.settled], axis=1).mean()
    assert error.length.shape == (301, 2)
    assert error.mean < 0.6 * size
    assert error.mean < error.largest
    with pytest.raises(ConfigError, match="filter kf estimates no disturbance"):
        disturbance_errors(config, flight, ("kf",))


def test_the_observer_flies_where_the_whole_state_is_measured(dense, sparse):
    config, flight = dense
    config = config.model_copy(update={"filters": ("observer",), "runs": 3})
    result = fly(config, flight)
    row = result.table.iloc[0]
    # ten times better than a measurement of 17 mm
    assert row["position_rmse_m"] < 5e-3
    assert result["observer"].disturbance is not None
    _, positions_only = sparse
    with pytest.raises(ConfigError, match="measures 3 of six states"):
        build(
            "observer",
            positions_only,
            np.zeros((1, 6)),
            {"position_gain": 0.1, "velocity_gain": 0.1, "noise": 1e-6, "rate": 1e-3},
        )


@pytest.mark.parametrize(("source", "most"), [("integrated", 1e-9), ("measured", 3e-8)])
def test_the_target_may_be_known_by_measurement_only(source, most, sparse):
    """Accelerations of the nonlinear model differ from those about the known orbit, m/s2."""
    config, known = sparse
    config = config.model_copy(
        update={"reference": config.reference.model_copy(update={"source": source})}
    )
    flight = formation_flight(config)
    assert known.nonlinear is not None
    assert flight.nonlinear is not None
    for k in (3, 50, 200):
        x, t = known.truth[k : k + 1], float(known.times[k])
        difference = flight.nonlinear.rates(x, t)[0] - known.nonlinear.rates(x, t)[0]
        assert np.abs(difference).max() < most
    np.testing.assert_array_equal(flight.disturbance, known.disturbance)


def test_a_flight_in_a_plane_is_judged_on_four_states():
    """Nothing is wrong across the plane, so neither floor nor bounds may count it."""
    config = load_scenario(ROOT / "scenarios" / "cislunar.yaml", steps=300, runs=2, filters=["dmc"])
    flight = cislunar_flight(config)
    assert flight.facts["lowest_above_moon_m"] > 1e6
    np.testing.assert_array_equal(flight.free, [True, True, False, True, True, False])
    result = fly(config, flight)
    assert not result.floor[:, [2, 5]].any()
    assert "of 4" in result["dmc"].verdict
