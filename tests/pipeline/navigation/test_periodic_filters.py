"""Filters of formations whose periodic accelerations, or light and air, are states."""

from pathlib import Path

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.planned import PlannedModel
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.navigation.contestants import build
from unmodeled.pipeline.navigation.formation_truth import formation_flight
from unmodeled.pipeline.navigation.navigate import fly
from unmodeled.pipeline.navigation.periodic_contestant import periodic_accelerations
from unmodeled.pipeline.navigation.scenario_config import load_scenario
from unmodeled.pipeline.navigation.small_body_truth import small_body_flight

SCENARIOS = Path(__file__).resolve().parents[3] / "scenarios"
TUNING = {"noise": 1e-8, "sigma": 0.02}


@pytest.fixture(scope="module")
def config():
    return load_scenario(
        SCENARIOS / "leo-formation-gnss.yaml",
        degree=3,
        duration_s=18000.0,
        settle_s=3000.0,
        runs=10,
        filters=["nonlinear", "periodic", "effects", "exact"],
    )


@pytest.fixture(scope="module")
def formation(config):
    return formation_flight(config)


def test_planned_steps_are_those_of_the_integrator(formation):
    """The linear motion about the target is the derivative of the nonlinear one there."""
    physics = formation.nonlinear
    plan = PlannedModel.of(physics.linear, formation.times)
    origin = np.zeros((1, 6))
    for k in (0, 100, 400):
        t = float(formation.times[k])
        A = physics.linear(np.array([t]))[0]
        exact = physics.rates(origin, t)[1][0]
        np.testing.assert_allclose(A, exact, rtol=0, atol=1e-13 * np.abs(exact).max())
        x, F = plan.propagate(formation.truth[k : k + 1], t, 30.0)
        whole, slope = RungeKutta(physics).propagate(origin, t, 30.0)
        np.testing.assert_allclose(whole, 0.0, atol=1e-9)
        # both are of fourth order and differ in their fifth: (n h)^5 = 1e-8, of 30 s
        np.testing.assert_allclose(F, slope, rtol=0, atol=1e-8 * 30.0)
        np.testing.assert_array_equal(x, formation.truth[k : k + 1] @ F[0].T)


def test_planned_model_is_of_fourth_order():
    """A = a(t) J turns by the integral of a: the error falls by sixteen when steps are halved."""
    J = np.array([[0.0, 1.0], [-1.0, 0.0]])
    end = 2.0
    angle = end + np.sin(end)
    exact = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    errors = []
    for steps in (20, 40, 80):
        plan = PlannedModel.of(
            lambda t: (1.0 + np.cos(t))[:, None, None] * J, np.linspace(0.0, end, steps + 1)
        )
        whole = np.eye(2)
        for F in plan.transitions:
            whole = F @ whole
        errors.append(np.abs(whole - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4.0, atol=0.3)


def test_a_step_outside_the_plan_is_refused(formation):
    plan = PlannedModel.of(formation.nonlinear.linear, formation.times)
    for t, dt in ((15.0, 30.0), (0.0, 60.0), (float(formation.times[-1]), 30.0)):
        with pytest.raises(ConfigError, match=r"is not in the plan.*epochs of the measurements"):
            plan.propagate(np.zeros((1, 6)), t, dt)


def test_columns_of_the_series():
    u = np.array([0.0, 0.5])
    B = periodic_accelerations(u, 1)
    assert B.shape == (2, 3, 9)
    w = np.arange(1.0, 10.0)
    for k in range(2):
        expected = w[:3] + w[3:6] * np.cos(u[k]) + w[6:] * np.sin(u[k])
        np.testing.assert_allclose(B[k] @ w, expected, rtol=1e-15)


def test_suspects_are_what_light_and_air_do(formation, config):
    """With the true differences of the two craft they are what the nonlinear model lacks."""
    target, chaser = config.target, config.chaser

    def size(craft, factor):
        return factor * craft.area_m2 / craft.mass_kg

    light = size(chaser, chaser.reflectivity) - size(target, target.reflectivity)
    air = size(chaser, chaser.drag_coefficient) - size(target, target.drag_coefficient)
    told = light * formation.suspects["light"] + air * formation.suspects["air"]
    said = np.concatenate(
        [
            formation.nonlinear.rates(x[None], float(t))[0][:, 3:]
            for x, t in zip(formation.truth, formation.times, strict=True)
        ]
    )
    base = formation.base.rates(formation.truth, 0.0)[0][:, 3:]
    lacking = base + formation.disturbance - said
    rest = np.median(np.linalg.norm(lacking - told, axis=1))
    # tides and harmonics of degree 3 over 12 to 100 m: n^2 d J3 R / r = 1e-10
    assert rest < 0.05 * np.median(np.linalg.norm(lacking, axis=1))


def test_states_of_periodic_accelerations_carry_through_the_gap(formation, config):
    """They beat the nonlinear model, know how sure they are, and do not cheat."""
    tuning = config.tuning | {"effects": TUNING, "periodic": {"noise": 1e-7, "sigma": 3e-8}}
    result = fly(config.model_copy(update={"tuning": tuning}), formation)
    table = result.table.set_index("filter")
    assert (table["failure"] == "").all()
    assert table.loc["effects", "max_in_gap_m"] < 0.4 * table.loc["nonlinear", "max_in_gap_m"]
    for name in ("periodic", "effects"):
        assert (
            table.loc[name, "mean_position_error_m"]
            < table.loc["nonlinear", "mean_position_error_m"]
        )
        assert table.loc[name, "position_rmse_m"] > 0.9 * result.floor_position_m
        assert table.loc[name, "max_in_gap_m"] < 3.0 * table.loc[name, "sigma_in_gap_m"]
    assert table.loc["effects", "disturbance_rmse_m_s2"] < 3e-8


def test_each_run_is_the_same_alone(formation, config):
    runs = [
        fly(
            config.model_copy(
                update={"runs": n, "filters": ("effects",), "tuning": {"effects": TUNING}}
            ),
            formation,
        )
        for n in (1, 5)
    ]
    # one covariance for all; the states of one run are the rows of a product of matrices
    np.testing.assert_allclose(
        runs[0]["effects"].error, runs[1]["effects"].error, rtol=0, atol=1e-9
    )


def test_what_they_need_is_said(formation):
    start = formation.truth[:1]
    with pytest.raises(ConfigError, match="harmonics is -1"):
        build("periodic", formation, start, {"noise": 1e-8, "sigma": 1e-7, "harmonics": -1.0})
    plain = load_scenario(
        SCENARIOS / "leo-formation-gnss.yaml", truth="j2", duration_s=300.0, gap_orbits=None
    )
    with pytest.raises(ConfigError, match="no effect beyond the target's orbit"):
        build("effects", formation_flight(plain), start, TUNING)
    bennu = small_body_flight(load_scenario(SCENARIOS / "bennu-proximity.yaml"))
    for name in ("periodic", "effects"):
        with pytest.raises(ConfigError, match=f"no known orbit of a target\\. Leave {name} out"):
            build(name, bennu, start, TUNING)


def test_each_filter_has_a_colour_of_its_own():
    from unmodeled.pipeline.navigation.contestants import contestant_names
    from unmodeled.reports.figures.navigation import FILTER_COLOURS

    assert set(FILTER_COLOURS) == set(contestant_names())
    assert len(set(FILTER_COLOURS.values())) == len(FILTER_COLOURS)
