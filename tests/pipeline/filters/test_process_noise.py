"""Ladder: process noise against high-precision arithmetic, and of the right size."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.gauss_markov import GaussMarkov, WithGaussMarkov
from unmodeled.pipeline.filters.linear import LinearModel
from unmodeled.pipeline.filters.process_noise import (
    ConstantNoise,
    HeldAcceleration,
    WhiteAcceleration,
)
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.filters.van_loan import van_loan


def state(n):
    return FilterState.of(np.zeros(n), np.eye(n), 0.0)


def exact(dt, tau, order):
    """Q of one axis for unit density, by the matrix exponential in 80 digits."""
    with mpmath.workdps(80):
        size = 2 + order
        A = mpmath.zeros(size)
        for i in range(size - 1):
            A[i, i + 1] = 1
        beta = 1 / mpmath.mpf(tau)
        if order == 1:
            A[2, 2] = -beta
        else:
            A[3, 2], A[3, 3] = -(beta**2), -2 * beta
        block = mpmath.zeros(2 * size)
        for i in range(size):
            for j in range(size):
                block[i, j], block[size + i, size + j] = -A[i, j], A[j, i]
        block[size - 1, 2 * size - 1] = 1
        whole = mpmath.expm(block * mpmath.mpf(dt), method="taylor")
        Q = whole[size:, size:].T * whole[:size, size:]
        return np.array([[float(Q[i, j]) for j in range(size)] for i in range(size)])


def textbook_position(dt, tau):
    """Q_rr of the closed form found in textbooks [TapleySchutzBorn2004], unit density."""
    b, e = 1 / tau, np.exp(-dt / tau)
    return dt**3 / (3 * b**2) - dt**2 / b**3 + dt / b**4 * (1 - 2 * e) + (1 - e**2) / (2 * b**5)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("ratio", [1e-8, 1e-5, 1e-3, 0.1, 1.0, 10.0])
def test_gauss_markov_noise_has_all_its_digits(ratio, order):
    dt = 30.0
    tau = dt / ratio
    ours = GaussMarkov(tau, 1.0, order, dimensions=1).covariance(state(2 + order), dt)
    right = exact(dt, tau, order)
    # acceleration and its rate become uncorrelated: then their product counts, not its rest
    sigma = np.sqrt(np.diag(right))
    allowed = 1e-10 * np.abs(right) + 1e-14 * sigma * sigma[:, None]
    assert (np.abs(ours - right) <= allowed).all()


def test_the_closed_form_cancels_where_ours_does_not():
    # [Fereoli2024]: dt 5e-5, tau 1. Guards the test above: the usual formula fails it.
    right = exact(5e-5, 1.0, 1)[0, 0]
    assert right == pytest.approx(5e-5**5 / 20, rel=1e-4)
    assert abs(textbook_position(5e-5, 1.0) / right - 1) > 1e3
    assert textbook_position(2.0, 1.0) == pytest.approx(exact(2.0, 1.0, 1)[0, 0], rel=1e-12)
    ours = GaussMarkov(1.0, 1.0, dimensions=1).covariance(state(3), 5e-5)
    assert ours[0, 0] == pytest.approx(right, rel=1e-12)


def test_van_loan_over_many_time_constants():
    A, L = np.array([[-1.0]]), np.array([[2.0]])
    F, Q = van_loan(A, L, 1000.0)
    assert Q[0, 0] == pytest.approx(1.0, rel=1e-12)  # q tau / 2
    assert F[0, 0] < 1e-300


@pytest.mark.parametrize("order", [1, 2])
def test_stationary_sigma(order):
    noise = GaussMarkov.of_sigma(100.0, [1e-6, 2e-6, 3e-6], order)
    np.testing.assert_allclose(noise.stationary_sigma(), [1e-6, 2e-6, 3e-6], rtol=1e-12)
    Q = noise.covariance(state(6 + 3 * order), 1e4)  # a hundred time constants
    np.testing.assert_allclose(np.sqrt(np.diag(Q)[6:9]), [1e-6, 2e-6, 3e-6], rtol=1e-9)


def test_held_form_is_the_printed_one():
    # [Fereoli2024] Eq. 22 at B dt = 1, where it does not cancel
    B, dt = 0.5, 2.0
    e = np.exp(-B * dt)
    gamma = np.array(
        [dt**2 / (2 * B) - dt / B**2 + (1 - e) / B**3, dt / B - (1 - e) / B**2, (1 - e) / B]
    )
    Q = GaussMarkov(1 / B, 3.0, dimensions=1, held=True).covariance(state(3), dt)
    np.testing.assert_allclose(Q, 3.0 * np.outer(gamma, gamma), rtol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_model_and_noise_belong_together(order):
    # the transition of the wrapped model is that of the noise's own chain of integrators
    model = RungeKutta(WithGaussMarkov(LinearModel(np.diag(np.ones(3), 3)), 50.0, order), 0.05)
    x = np.random.default_rng(0).normal(size=(2, model.size))
    after, F = model.propagate(x, 0.0, 1.0)
    np.testing.assert_allclose(after, (F @ x[:, :, None])[:, :, 0], atol=1e-12)
    A = np.diag(np.ones(1 + order), 1)
    A[-1, 2:] = [-1 / 50.0] if order == 1 else [-1 / 50.0**2, -2 / 50.0]
    chain, _ = van_loan(A, np.zeros_like(A), 1.0)
    # what a fourth-order step of 0.05 leaves out of the fastest chain: 0.05^4 / (60 x 50^2)
    np.testing.assert_allclose(F[0], np.kron(chain, np.eye(3)), atol=1e-9)


def test_a_step_cut_in_two_gives_the_same_white_noise():
    noise, F = WhiteAcceleration([1e-6, 2e-6, 0.0]), np.eye(6) + np.diag(np.full(3, 5.0), 3)
    half, whole = noise.covariance(state(6), 5.0), noise.covariance(state(6), 10.0)
    np.testing.assert_allclose(F @ half @ F.T + half, whole, rtol=1e-12)


def test_held_acceleration():
    Q = HeldAcceleration(2.0, dimensions=1).covariance(state(2), 3.0)
    G = np.array([4.5, 3.0])
    np.testing.assert_allclose(Q, 4.0 * np.outer(G, G), rtol=1e-15)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: GaussMarkov(0.0, 1.0), r"time constant is 0\.0 s\. Allowed: > 0"),
        (lambda: GaussMarkov(1.0, 1.0, 3), r"order is 3\. Allowed: 1 or 2"),
        (lambda: GaussMarkov(np.inf, 1.0, 2), "finite time constant"),
        (lambda: GaussMarkov(1.0, 1.0, 2, held=True), "held noise with order 2"),
        (lambda: GaussMarkov.of_sigma(np.inf, 1.0), "random walk has no stationary sigma"),
        (lambda: WhiteAcceleration(-1.0).covariance(state(6), 1.0), "density is -1"),
        (lambda: GaussMarkov(1.0, 1.0).covariance(state(6), 1.0), "WithGaussMarkov"),
        (lambda: ConstantNoise(np.diag([1.0, -1.0])), "negative eigenvalue"),
    ],
)
def test_errors_say_what_is_allowed(make, text):
    with pytest.raises(ConfigError, match=text):
        make()
