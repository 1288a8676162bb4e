"""Ladder, linear rungs: textbook cases, Riccati equation, least squares, other programs."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest
from scipy.linalg import block_diag, solve_discrete_are

from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.linear import LinearMeasurement, LinearModel
from unmodeled.pipeline.filters.process_noise import ConstantNoise, WhiteAcceleration
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.smoother import smooth
from unmodeled.pipeline.filters.square_root import SquareRootFilter
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.filters.update import correct, correct_one_by_one


@dataclass(frozen=True)
class Affine:
    """x_next = F x + u: a linear model with a known push, such as gravity on a cannonball."""

    F: np.ndarray
    u: np.ndarray

    @property
    def size(self):
        return len(self.F)

    def propagate(self, x, t, dt):
        return x @ self.F.T + self.u, self.F[None]


def joint_estimate(F, u, Q, H, R, mean, P, z):
    """Condition the joint Gaussian of all states on all measurements: no recursion at all."""
    n, k = len(F), len(z)
    powers = [np.linalg.matrix_power(F, i) for i in range(k + 1)]
    states, prior = [], np.zeros(0)
    noise = block_diag(P, *[Q] * k)  # of the start and of each step
    expected = mean
    for i in range(1, k + 1):
        expected = F @ expected + u
        prior = np.concatenate([prior, expected])
        row = [powers[i - j] if j <= i else np.zeros((n, n)) for j in range(k + 1)]
        states.append(np.hstack(row))
    design = np.vstack(states)
    covariance = design @ noise @ design.T
    big_H, big_R = block_diag(*[H] * k), block_diag(*[R] * k)
    S = big_H @ covariance @ big_H.T + big_R
    gain = np.linalg.solve(S, big_H @ covariance).T
    x = prior + gain @ (np.concatenate(z) - big_H @ prior)
    return x.reshape(k, n), covariance - gain @ S @ gain.T


def cannonball():
    dt = 0.1
    F = np.eye(4)
    F[0, 2] = F[1, 3] = dt
    u = np.array([0.0, -0.5 * 9.81 * dt**2, 0.0, -9.81 * dt])
    H = np.eye(2, 4)
    return F, u, 1e-3 * np.eye(4), H, 9.0 * np.eye(2), np.array([0.0, 0.0, 70.7, 70.7])


def constant_acceleration():
    dt = 0.1
    F = np.array([[1.0, dt], [0.0, 1.0]])
    G = np.array([[0.5 * dt**2], [dt]])
    Q = 0.04 * G @ G.T + 1e-12 * np.eye(2)
    return F, 0.1 * G[:, 0], Q, np.array([[1.0, 0.0]]), np.array([[100.0]]), np.zeros(2)


def test_random_constant_in_rational_arithmetic():
    # The constant of [WelchBishop2006]: Q = 1e-5, R = 0.01, P0 = 1; here every digit is exact.
    rng = np.random.default_rng(0)
    z = np.round(-0.37727 + 0.1 * rng.normal(size=50), 6)
    x, P = Fraction(0), Fraction(1)
    Q, R = Fraction(1, 100000), Fraction(1, 100)
    for value in z:
        P += Q
        K = P / (P + R)
        x += K * (Fraction(str(value)) - x)
        P *= 1 - K
    model = LinearModel(np.zeros((1, 1)))
    filter_ = ExtendedKalmanFilter(
        model, LinearMeasurement([[1.0]], [[0.01]]), ConstantNoise(np.array([[1e-5]]))
    )
    run = run_filter(
        filter_, FilterState.of([0.0], [[1.0]], 0.0), np.arange(1.0, 51.0), z[:, None, None]
    )
    assert run.mean[-1, 0, 0] == pytest.approx(float(x), abs=1e-12)
    assert run.sigma[-1, 0, 0] ** 2 == pytest.approx(float(P), rel=1e-12)


@pytest.mark.parametrize("case", [constant_acceleration, cannonball])
@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, SquareRootFilter])
def test_filter_and_smoother_are_conditioning_of_the_joint_gaussian(case, kind):
    F, u, Q, H, R, mean = case()
    rng = np.random.default_rng(1)
    P = np.diag(rng.uniform(1, 5, len(F)))
    k = 25
    x = mean + rng.normal(size=len(F))
    z = []
    for _ in range(k):
        x = F @ x + u + 0.1 * rng.normal(size=len(F))
        z.append(H @ x + 3.0 * rng.normal(size=len(H)))
    z = np.array(z)
    filter_ = kind(Affine(F, u), LinearMeasurement(H, R), ConstantNoise(Q))
    run = run_filter(
        filter_, FilterState.of(mean, P, 0.0), np.arange(1.0, k + 1), z[:, None], keep="all"
    )
    xs, covariance = joint_estimate(F, u, Q, H, R, mean, P, z)
    n = len(F)
    size = np.abs(xs).max()
    # 1e-12 of the largest state: rounding of a 100 x 100 system
    np.testing.assert_allclose(run.mean[-1, 0], xs[-1], atol=1e-12 * size)
    last = covariance[-n:, -n:]
    np.testing.assert_allclose(
        run.updates[-1].state.covariance[0], last, atol=1e-11 * np.abs(last).max()
    )
    smoothed = smooth(run)
    np.testing.assert_allclose(smoothed.mean[:, 0], xs, atol=1e-11 * size)
    for i in range(k):
        block = covariance[i * n : i * n + n, i * n : i * n + n]
        np.testing.assert_allclose(
            smoothed.covariance[i, 0], block, atol=1e-10 * np.abs(block).max()
        )


def test_steady_state_is_the_riccati_solution(relative_motion):
    model = LinearModel(relative_motion(8.6e-4))
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [0.1] * 3, 6)
    noise = WhiteAcceleration(1e-10)
    filter_ = ExtendedKalmanFilter(model, measurement, noise)
    state = filter_.start(FilterState.of(np.zeros(6), np.diag([1.0] * 3 + [1e-4] * 3), 0.0))
    for _ in range(3000):
        predicted = filter_.predict(state, 30.0)
        state = filter_.update(predicted, np.zeros((1, 3))).state
    F = model.propagate(np.zeros((1, 6)), 0.0, 30.0)[1][0]
    scale = np.array([1.0] * 3 + [1e-3] * 3)  # metres and mm/s: scipy's pencil needs like sizes
    D, E = np.diag(scale), np.diag(1 / scale)
    steady = solve_discrete_are(
        (E @ F @ D).T, (measurement.H @ D).T, E @ noise.covariance(state, 30.0) @ E, measurement.R
    )
    np.testing.assert_allclose(
        E @ predicted.state.covariance[0] @ E, steady, atol=1e-9 * np.abs(steady).max()
    )


def test_without_process_noise_it_is_least_squares(relative_motion, simulated):
    rng = np.random.default_rng(2)
    model = LinearModel(relative_motion(8.6e-4))
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [0.1] * 3, 6)
    P = np.diag([100.0] * 3 + [1e-2] * 3)
    x0 = rng.normal(size=(1, 6)) * np.sqrt(np.diag(P))
    times = 30.0 * np.arange(1, 201)
    z, rows = [], []
    for t in times:
        F = model.propagate(x0, 0.0, t)[1][0]
        rows.append(measurement.H @ F)
        z.append(measurement.H @ F @ x0[0] + 0.1 * rng.normal(size=3))
    z = np.array(z)
    filter_ = ExtendedKalmanFilter(model, measurement, ConstantNoise(np.zeros((6, 6))))
    run = run_filter(filter_, FilterState.of(np.zeros(6), P, 0.0), times, z[:, None])
    # one orthogonal decomposition of all equations, scaled by their sigmas
    design = np.vstack([np.diag(1 / np.sqrt(np.diag(P))), np.vstack(rows) / 0.1])
    target = np.concatenate([np.zeros(6), z.ravel() / 0.1])
    best = np.linalg.lstsq(design, target, rcond=None)[0]
    F = model.propagate(x0, 0.0, times[-1])[1][0]
    R = np.linalg.qr(design, mode="r")
    root = F @ np.linalg.inv(R)
    covariance = root @ root.T
    sigma = np.sqrt(np.diag(covariance))
    # In units of the final sigma. Positions grow to 1e6 sigmas, whose rounding, 1e-10, adds up
    # over 200 steps.
    np.testing.assert_allclose((run.mean[-1, 0] - F @ best) / sigma, 0.0, atol=1e-7)
    np.testing.assert_allclose(run.mean[-1, 0], F @ best, atol=1e-8)
    np.testing.assert_allclose(
        run.final.covariance[0] / sigma / sigma[:, None],
        covariance / sigma / sigma[:, None],
        atol=1e-8,
    )


@pytest.mark.parametrize("iterations", [1, 4])
def test_extended_filter_on_a_linear_model_is_the_textbook_filter(
    relative_motion, simulated, iterations
):
    rng = np.random.default_rng(3)
    A = relative_motion(8.6e-4)
    model = LinearModel(A)
    F = model.propagate(np.zeros((1, 6)), 0.0, 10.0)[1][0]
    Q = np.diag([1e-4] * 3 + [1e-6] * 3)
    measurement = LinearMeasurement.of_sigma([0, 1, 2, 3], [0.1, 0.2, 0.3, 0.01], 6)
    H, R = measurement.H, measurement.R
    P = np.diag([1.0] * 3 + [1e-4] * 3)
    _, z = simulated(F, Q, H, R, rng.normal(size=(1, 6)), 40, rng)
    filter_ = ExtendedKalmanFilter(model, measurement, ConstantNoise(Q), iterations=iterations)
    run = run_filter(filter_, FilterState.of(np.zeros(6), P, 0.0), 10.0 * np.arange(1, 41), z)
    x = np.zeros(6)
    for value in z[:, 0]:
        x, P = F @ x, F @ P @ F.T + Q
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        x, P = x + K @ (value - H @ x), (np.eye(6) - K @ H) @ P
    np.testing.assert_allclose(run.mean[-1, 0], x, rtol=0, atol=1e-12 * np.abs(x).max())
    np.testing.assert_allclose(run.final.covariance[0], P, rtol=0, atol=1e-12 * P.max())


def test_one_component_after_another_is_the_vector_update():
    rng = np.random.default_rng(4)
    b, n, m = 5, 6, 3
    root = rng.normal(size=(b, n, n))
    P, H = root @ root.mT, rng.normal(size=(b, m, n))
    x, z, variances = rng.normal(size=(b, n)), rng.normal(size=(b, m)), np.array([0.5, 1.0, 2.0])
    innovation = z - (H @ x[:, :, None])[:, :, 0]
    whole = correct(x, P, innovation, H, np.diag(variances), np.ones((1, m), dtype=bool))
    mean, covariance = correct_one_by_one(x, P, z, H, variances)
    np.testing.assert_allclose(mean, whole.mean, atol=1e-12 * np.abs(mean).max())
    np.testing.assert_allclose(covariance, whole.covariance, atol=1e-12 * np.abs(P).max())


def test_each_run_is_the_same_alone_and_in_a_batch(relative_motion, simulated):
    rng = np.random.default_rng(5)
    # RungeKutta and a start of its own for each run: nothing is common
    model = RungeKutta(LinearModel(relative_motion(8.6e-4)))
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [0.1] * 3, 6)
    noise = WhiteAcceleration(1e-6)
    times = 10.0 * np.arange(1, 31)
    z = rng.normal(size=(30, 4, 3))
    P = np.diag([1.0] * 3 + [1e-4] * 3) * rng.uniform(1, 3, 4)[:, None, None]
    used = rng.uniform(size=(30, 4)) > 0.3
    filter_ = ExtendedKalmanFilter(model, measurement, noise)
    together = run_filter(filter_, FilterState.of(np.zeros((4, 6)), P, 0.0), times, z, used)
    for i in range(4):
        start = FilterState.of(np.zeros(6), P[i], 0.0)
        alone = run_filter(filter_, start, times, z[:, [i]], used[:, [i]])
        np.testing.assert_array_equal(alone.mean[:, 0], together.mean[:, i])
        np.testing.assert_array_equal(alone.sigma[:, 0], together.sigma[:, i])
        np.testing.assert_array_equal(alone.nis[:, 0], together.nis[:, i])


def test_filterpy_says_the_same(relative_motion, simulated):
    kalman = pytest.importorskip("filterpy.kalman", reason="install the extra `truth`")
    rng = np.random.default_rng(6)
    model = LinearModel(relative_motion(8.6e-4))
    measurement = LinearMeasurement.of_sigma([0, 1, 2], [0.1] * 3, 6)
    noise = WhiteAcceleration(1e-8)
    P = np.diag([1.0] * 3 + [1e-4] * 3)
    F = model.propagate(np.zeros((1, 6)), 0.0, 10.0)[1][0]
    start = FilterState.of(np.zeros(6), P, 0.0)
    Q = noise.covariance(start, 10.0)
    truth, z = simulated(F, Q, measurement.H, measurement.R, rng.normal(size=(1, 6)), 60, rng)
    times = 10.0 * np.arange(1, 61)
    run = run_filter(
        ExtendedKalmanFilter(model, measurement, noise), start, times, z, truth=truth, keep="all"
    )
    other = kalman.KalmanFilter(6, 3)
    other.F, other.H, other.R, other.Q, other.P = F, measurement.H, measurement.R, Q, P
    means, covariances = [], []
    for k in range(60):
        other.predict()
        other.update(z[k, 0])
        means.append(other.x.ravel())
        covariances.append(other.P)
        assert other.mahalanobis**2 == pytest.approx(run.nis[k, 0], rel=1e-9)
    scale = np.abs(means).max()
    np.testing.assert_allclose(run.mean[:, 0], means, rtol=0, atol=1e-12 * scale)
    xs, Ps, _, _ = other.rts_smoother(np.array(means), np.array(covariances))
    smoothed = smooth(run)
    # filterpy inverts the predicted covariance, condition number 1e5
    np.testing.assert_allclose(smoothed.mean[:, 0], xs, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(smoothed.covariance[:, 0], Ps, rtol=0, atol=1e-9 * Ps.max())
