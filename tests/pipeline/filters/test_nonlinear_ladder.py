"""Ladder, nonlinear rungs: Jacobians, convergence order, consistency over runs, iteration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import minimize

from unmodeled.pipeline.filters.adaptive import ForgettingNoise, MatchedNoise
from unmodeled.pipeline.filters.consistency import consistency, mean_bounds
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.gauss_markov import WithGaussMarkov
from unmodeled.pipeline.filters.linear import LinearMeasurement, LinearModel
from unmodeled.pipeline.filters.observer import FullStateObserver
from unmodeled.pipeline.filters.process_noise import ConstantNoise, WhiteAcceleration
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.smoother import smooth
from unmodeled.pipeline.filters.state import FilterState

START = np.array([0.8, 0.1, 0.05, 0.1, 0.4, 0.02])


def differences(function, x, h=1e-6):
    """Central differences (b, m, n) of a function of states (b, n)."""
    columns = []
    for j in range(x.shape[1]):
        step = np.zeros(x.shape[1])
        step[j] = h
        columns.append((function(x + step) - function(x - step)) / (2 * h))
    return np.stack(columns, axis=2)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_jacobians_and_transition_are_derivatives(three_body, range_and_rate, order):
    rng = np.random.default_rng(0)
    model = WithGaussMarkov(three_body(), 2.0, order) if order else three_body()
    x = np.zeros((3, model.size))
    x[:, :6] = START + 0.05 * rng.normal(size=(3, 6))
    x[:, 6:] = 0.1 * rng.normal(size=(3, model.size - 6))
    _, A = model.rates(x, 0.0)
    np.testing.assert_allclose(A, differences(lambda y: model.rates(y, 0.0)[0], x), atol=1e-8)
    steps = RungeKutta(model, 0.02)
    _, F = steps.propagate(x, 0.0, 0.1)
    np.testing.assert_allclose(
        F, differences(lambda y: steps.propagate(y, 0.0, 0.1)[0], x), atol=1e-8
    )
    measurement = range_and_rate(np.eye(2))
    _, H = measurement.h(x, 0.0)
    np.testing.assert_allclose(H, differences(lambda y: measurement.h(y, 0.0)[0], x), atol=1e-8)


def test_runge_kutta_is_of_fourth_order(three_body):
    x = START[None]
    fine, F_fine = RungeKutta(three_body(), 0.3 / 512).propagate(x, 0.0, 0.3)
    errors, errors_F = [], []
    for parts in (8, 16, 32):
        y, F = RungeKutta(three_body(), 0.3 / parts).propagate(x, 0.0, 0.3)
        errors.append(np.abs(y - fine).max())
        errors_F.append(np.abs(F - F_fine).max())
    for found in (errors, errors_F):
        slopes = np.diff(np.log2(found))
        # within a quarter of the claim: the next order still shows at these steps
        assert np.abs(slopes + 4).max() < 0.25


def monte_carlo(three_body, runs=100, steps=150):
    """True states (k, b, 6), measurements and a filter that knows all about them."""
    rng = np.random.default_rng(7)
    model, dt = RungeKutta(three_body()), 0.01
    noise = WhiteAcceleration(1e-5)
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [1e-4] * 3, 6)
    P = np.diag([1e-8] * 3 + [1e-6] * 3)
    x = START + rng.normal(size=(runs, 6)) * np.sqrt(np.diag(P))
    start = FilterState.of(START, P, 0.0, runs=runs)
    root = np.linalg.cholesky(noise.covariance(start, dt))
    truth, z = [], []
    for k in range(steps):
        x = model.propagate(x, k * dt, dt)[0] + rng.normal(size=x.shape) @ root.T
        truth.append(x)
        z.append(measurement.h(x, 0.0)[0] + 1e-4 * rng.normal(size=(runs, 3)))
    times = dt * np.arange(1, steps + 1)
    return model, measurement, noise, start, times, np.array(truth), np.array(z)


def test_extended_filter_is_consistent_over_a_hundred_runs(three_body):
    model, measurement, noise, start, times, truth, z = monte_carlo(three_body)
    run = run_filter(
        ExtendedKalmanFilter(model, measurement, noise), start, times, z, truth=truth, keep="all"
    )
    found = consistency(run)
    assert found.nees_inside >= 0.9
    assert found.nis_bounds[0] <= found.nis_mean <= found.nis_bounds[1]
    assert abs(found.autocorrelation) <= found.autocorrelation_bound
    assert found.consistent
    assert found.verdict.startswith("consistent: NEES")
    smoothed = smooth(run)
    better = np.sqrt(np.mean((smoothed.mean - truth) ** 2)) / np.sqrt(
        np.mean((run.mean - truth) ** 2)
    )
    assert better < 0.8
    # the smoother, too, knows how wrong it is: mid-arc, over runs
    error = smoothed.mean[75] - truth[75]
    nees = np.mean(
        [e @ np.linalg.solve(P, e) for e, P in zip(error, smoothed.covariance[75], strict=True)]
    )
    low, high = mean_bounds(6, 100, 0.999)
    assert low < nees < high


def test_noise_added_to_the_prediction_doubles_the_innovations(three_body):
    # The slip of the public code of [Fereoli2024]: `expected` is drawn, not computed.
    model, measurement, noise, start, times, truth, z = monte_carlo(three_body)
    rng = np.random.default_rng(8)

    @dataclass(frozen=True)
    class Noisy:
        R: np.ndarray

        def h(self, x, t):
            expected, H = measurement.h(x, t)
            return expected + 1e-4 * rng.normal(size=expected.shape), H

    plain = ExtendedKalmanFilter(model, measurement, noise)
    wrong = ExtendedKalmanFilter(model, Noisy(measurement.R), noise)
    predicted = plain.predict(plain.start(start), 0.01)
    first, second = plain.update(predicted, z[0]), plain.update(predicted, z[0])
    np.testing.assert_array_equal(first.innovation, second.innovation)
    np.testing.assert_array_equal(first.state.mean, second.state.mean)
    found = consistency(run_filter(wrong, start, times, z, truth=truth))
    assert not found.consistent
    assert found.nis_mean > 1.5


def test_iterated_update_is_the_most_probable_state(range_and_rate):
    # a prior as wide as the distance is long, so that one linearisation is not enough
    measurement = range_and_rate(np.diag([1e-4, 1e-4]))
    P = np.diag([0.05] * 3 + [0.05] * 3)
    mean = np.array([[0.5, 0.3, 0.2, 0.1, 0.4, 0.2]])
    z = np.array([[0.9, 0.1]])
    still = LinearModel(np.zeros((6, 6)))
    start = FilterState.of(mean, P, 0.0)

    def cost(x):
        r = z[0] - measurement.h(x[None], 0.0)[0][0]
        d = x - mean[0]
        return 0.5 * r @ np.linalg.solve(measurement.R, r) + 0.5 * d @ np.linalg.solve(P, d)

    costs = []
    for iterations in (1, 2, 10):
        noise = ConstantNoise(np.zeros((6, 6)))
        filter_ = ExtendedKalmanFilter(still, measurement, noise, iterations=iterations)
        after = filter_.update(filter_.predict(start, 1.0), z).state
        costs.append(cost(after.mean[0]))
    best = minimize(cost, after.mean[0] + 0.01, method="BFGS", options={"gtol": 1e-8})
    assert costs[0] > costs[1] > costs[2]
    assert costs[2] == pytest.approx(best.fun, rel=1e-6)


def test_gap_is_a_prediction_and_a_missing_component_is_as_if_it_did_not_exist():
    rng = np.random.default_rng(9)
    A = np.diag(np.ones(2), 2)
    model, noise = LinearModel(A), WhiteAcceleration(1e-3, dimensions=2)
    R = np.array([[1.0, 0.6], [0.6, 2.0]])  # correlated
    both = ExtendedKalmanFilter(model, LinearMeasurement(np.eye(2, 4), R), noise)
    second = ExtendedKalmanFilter(model, LinearMeasurement(np.eye(4)[[1]], R[1:, 1:]), noise)
    start = FilterState.of(rng.normal(size=(3, 4)), np.eye(4), 0.0)
    predicted = both.predict(start, 1.0)
    gap = both.update(predicted, np.full((3, 2), np.nan))
    np.testing.assert_array_equal(gap.state.mean, predicted.state.mean)
    np.testing.assert_array_equal(gap.state.covariance, predicted.state.covariance)
    assert not gap.accepted.any()
    assert (gap.freedom == 0).all()
    assert (gap.nis == 0).all()
    z = rng.normal(size=(3, 2))
    left_out = both.update(predicted, z, used=[False, True])
    alone = second.update(predicted, z[:, 1:])
    np.testing.assert_allclose(left_out.state.mean, alone.state.mean, atol=1e-15)
    np.testing.assert_allclose(left_out.state.covariance, alone.state.covariance, atol=1e-15)
    np.testing.assert_allclose(left_out.nis, alone.nis, rtol=1e-13)
    nan = both.update(predicted, np.column_stack([np.full(3, np.nan), z[:, 1]]))
    np.testing.assert_array_equal(nan.state.mean, left_out.state.mean)


def test_gate_rejects_an_outlier_logs_it_and_changes_nothing():
    model = LinearModel(np.diag(np.ones(3), 3))
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [1.0] * 3, 6)
    times = np.arange(1.0, 11.0)
    z = np.zeros((10, 2, 3))
    z[4, 0] = 100.0
    start = FilterState.of(np.zeros(6), np.eye(6), 0.0, runs=2)
    noise = WhiteAcceleration(1e-2)
    gated = run_filter(ExtendedKalmanFilter(model, measurement, noise, gate=1e-6), start, times, z)
    assert gated.rejected == 1
    assert not gated.accepted[4, 0]
    assert gated.nis[4, 0] > 1000
    used = np.ones((10, 2), dtype=bool)
    used[4, 0] = False
    gap = run_filter(ExtendedKalmanFilter(model, measurement, noise), start, times, z, used)
    np.testing.assert_array_equal(gated.mean, gap.mean)
    np.testing.assert_array_equal(gated.sigma, gap.sigma)
    open_ = run_filter(ExtendedKalmanFilter(model, measurement, noise), start, times, z)
    assert open_.mean[4, 0, 0] > 10
    # in the outage the sigma grows, and falls with the next measurement
    assert gap.sigma[4, 0, 0] > gap.sigma[3, 0, 0]
    assert gap.sigma[5, 0, 0] < gap.sigma[4, 0, 0]


@pytest.fixture(scope="module")
def random_walk():
    """A hundred runs of a double integrator with known noise."""
    rng = np.random.default_rng(10)
    model = LinearModel(np.diag(np.ones(3), 3))
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [0.1] * 3, 6)
    start = FilterState.of(np.zeros(6), np.diag([1.0] * 3 + [1e-2] * 3), 0.0, runs=100)
    F = model.propagate(start.mean, 0.0, 10.0)[1][0]
    root = np.linalg.cholesky(WhiteAcceleration(1e-6).covariance(start, 10.0))
    x = rng.normal(size=(100, 6)) * start.sigma
    truth = []
    for _ in range(900):
        x = x @ F.T + rng.normal(size=x.shape) @ root.T
        truth.append(x)
    truth = np.array(truth)
    z = truth[:, :, :3] + 0.1 * rng.normal(size=(900, 100, 3))
    return model, measurement, start, 10.0 * np.arange(1, 901), truth, z


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_wrong_process_noise_is_seen_and_matched_noise_mends_it(random_walk, factor):
    model, measurement, start, times, truth, z = random_walk
    base = WhiteAcceleration(1e-6 * factor)
    fixed = run_filter(ExtendedKalmanFilter(model, measurement, base), start, times, z, truth=truth)
    word = {1e-3: "overconfident", 1.0: "consistent", 1e3: "too cautious"}[factor]
    assert consistency(fixed, start=500).verdict.startswith(word)
    matched = MatchedNoise(base)
    run = run_filter(
        ExtendedKalmanFilter(model, measurement, matched), start, times, z, truth=truth
    )
    found = consistency(run, start=500)
    assert found.consistent, found.verdict
    scale = np.median(matched.scale(run.final), axis=0) * np.sqrt(factor)
    # spread of one run is 0.12 (window of 320 updates); of the median of a hundred, 0.015
    np.testing.assert_allclose(scale, 1.0, atol=0.1)


def test_paper_mode_is_the_printed_rule_and_is_not_consistent(random_walk):
    model, measurement, start, times, truth, z = random_walk
    Q0 = WhiteAcceleration(1e-6).covariance(start, 10.0)
    filter_ = ExtendedKalmanFilter(model, measurement, ForgettingNoise(Q0, 0.99))
    used = np.ones(400, dtype=bool)
    used[50] = False
    run = run_filter(filter_, start, times[:400], z[:400], used, truth[:400], keep="all")
    Q = Q0
    for k in range(60):  # Eq. 27 for the first run, written out
        if k != 50:
            d = run.updates[k].gain[0] @ run.innovation[k, 0]
            Q = 0.99 * Q + 0.01 * np.outer(d, d)
        np.testing.assert_allclose(run.updates[k].state.memory["Q"][0], Q, rtol=1e-12)
    found = consistency(run, start=300)
    assert found.nees_mean > 18  # three times what it should be
    assert found.verdict.startswith("overconfident")


def test_observer_with_the_steady_kalman_gain_is_the_steady_filter(random_walk):
    model, measurement, start, times, truth, z = random_walk
    noise = WhiteAcceleration(1e-6)
    times, truth, z = times[:400], truth[:400], z[:400]
    kalman = run_filter(
        ExtendedKalmanFilter(model, measurement, noise), start, times, z, truth=truth, keep="all"
    )
    observer = FullStateObserver(model, measurement, noise, rate=kalman.updates[-1].gain[0] / 10.0)
    run = run_filter(observer, start, times, z)
    np.testing.assert_allclose(run.mean[-1], kalman.mean[-1], atol=1e-9)
    np.testing.assert_allclose(run.sigma[-1], kalman.sigma[-1], rtol=1e-9)
    # a gain of half the size is worse, and its covariance says so
    slow = FullStateObserver(model, measurement, noise, rate=kalman.updates[-1].gain[0] / 20.0)
    worse = run_filter(slow, start, times, z, truth=truth)
    assert consistency(worse, start=200).consistent
    assert worse.sigma[-1, 0, 0] > 1.05 * kalman.sigma[-1, 0, 0]


def test_angles_that_wrap_are_compared_round_the_circle():
    @dataclass(frozen=True)
    class Bearing:
        R: np.ndarray

        def h(self, x, t):
            H = np.zeros((len(x), 1, 2))
            H[:, 0] = np.stack([-x[:, 1], x[:, 0]], axis=1) / (x**2).sum(axis=1)[:, None]
            return np.arctan2(x[:, 1], x[:, 0])[:, None], H

        def difference(self, z, expected):
            return (z - expected + np.pi) % (2 * np.pi) - np.pi

    filter_ = ExtendedKalmanFilter(
        LinearModel(np.zeros((2, 2))), Bearing(np.array([[1e-4]])), ConstantNoise(np.zeros((2, 2)))
    )
    start = FilterState.of([-1.0, 0.01], 0.01 * np.eye(2), 0.0)
    after = filter_.update(filter_.predict(start, 1.0), np.array([[-np.pi + 0.01]]))
    assert after.innovation[0, 0] == pytest.approx(0.02, abs=1e-6)
    assert after.state.mean[0, 1] == pytest.approx(-0.01, abs=1e-3)
