"""Ladder: Joseph = symmetrised = square root over CR3BP-DMC, where the naive form fails."""

from __future__ import annotations

import numpy as np
import pytest

from unmodeled.core.errors import NumericalError
from unmodeled.pipeline.filters.algebra import inverse_root
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.gauss_markov import GaussMarkov, WithGaussMarkov
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.square_root import SquareRootFilter
from unmodeled.pipeline.filters.state import FilterState

STEP = 5e-5


def forms(three_body, range_and_rate, steps):
    """Run the forms side by side over [Fereoli2024] Table I, on noise-free measurements.

    Returns the sigmas of each form after the last step, and the first step at which the
    covariance of the naive one, P - K S K^T, has a negative variance.
    """
    measurement = range_and_rate(np.diag([1e-16, 1e-10]))
    model = RungeKutta(WithGaussMarkov(three_body(), 1.0))
    noise = GaussMarkov(1.0, 1e-2)
    joseph = ExtendedKalmanFilter(model, measurement, noise)
    root = SquareRootFilter(model, measurement, noise)
    x0 = np.array([1.0, 0, 0, 0, 0.5, 0, 0, 0, 0])
    # Table I; it has no uncertainty out of the plane
    P = np.diag([1e-12, 1e-12, 0, 1e-8, 1e-8, 0, 1e-2, 1e-2, 0])
    a = joseph.start(FilterState.of(x0, P, 0.0))
    c = root.start(a)
    naive, symmetric = P, P
    failed = None
    truth = RungeKutta(three_body())
    x = x0[None, :6]
    for k in range(steps):
        x, _ = truth.propagate(x, 0.0, STEP)
        z = measurement.h(x, 0.0)[0]
        predicted = joseph.predict(a, STEP)
        updated = joseph.update(predicted, z)
        a = updated.state
        c = root.update(root.predict(c, STEP), z).state
        F, Q, H = predicted.transition[0], predicted.noise[0], updated.design[0]

        def plain(P, F=F, Q=Q, H=H):
            P = F @ P @ F.T + Q
            S = H @ P @ H.T + measurement.R
            K = P @ H.T @ np.linalg.inv(S)
            return P - K @ S @ K.T

        if failed is None:
            naive = plain(naive)
            if np.diag(naive).min() < 0.0:
                failed = k + 1
        symmetric = plain(symmetric)
        symmetric = 0.5 * (symmetric + symmetric.T)
    sigmas = (a.sigma[0], np.sqrt(np.diag(symmetric)), c.sigma[0])
    return sigmas, failed, np.abs(a.mean - c.mean)[0]


@pytest.mark.parametrize(
    "steps", [1700, pytest.param(10_000, marks=pytest.mark.slow)], ids=["short", "full"]
)
def test_joseph_symmetrised_and_square_root_agree_where_the_naive_form_fails(
    three_body, range_and_rate, steps
):
    (joseph, symmetric, root), failed, apart = forms(three_body, range_and_rate, steps)
    np.testing.assert_allclose(root, joseph, rtol=1e-8)
    np.testing.assert_allclose(symmetric, joseph, rtol=1e-8)
    # 1e-6 of a sigma is far from any that matters
    assert (apart <= 1e-6 * joseph).all()
    # guards the test: this arc is hard enough
    assert failed is not None
    assert failed < steps


def test_square_root_form_with_gaps_and_gate(three_body, range_and_rate):
    rng = np.random.default_rng(0)
    measurement = range_and_rate(np.diag([1e-12, 1e-10]))
    noise = GaussMarkov(1.0, 1e-4)
    model = RungeKutta(WithGaussMarkov(three_body(), 1.0))
    kinds = (ExtendedKalmanFilter, SquareRootFilter)
    pair = [kind(model, measurement, noise, gate=1e-6) for kind in kinds]
    start = FilterState.of(
        [1.0, 0, 0, 0, 0.5, 0.1, 0, 0, 0],
        np.diag([1e-12] * 3 + [1e-8] * 3 + [1e-4] * 3),
        0.0,
        runs=3,
    )
    states = [f.start(start) for f in pair]
    x = start.mean
    for k in range(20):
        x, _ = model.propagate(x, 0.0, STEP)
        z = measurement.h(x, 0.0)[0] + np.array([1e-6, 1e-5]) * rng.normal(size=(3, 2))
        z[0, 1] = np.nan  # one component missing
        if k % 5 == 4:
            z[1] = np.nan  # all missing
        if k == 7:
            z[2] += 1.0  # nonsense
        updates = [f.update(f.predict(s, STEP), z) for f, s in zip(pair, states, strict=True)]
        states = [u.state for u in updates]
        one, two = updates
        np.testing.assert_array_equal(one.accepted, two.accepted)
        np.testing.assert_array_equal(one.accepted, [True, k % 5 != 4, k != 7])
        np.testing.assert_allclose(one.nis, two.nis, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(one.innovation_covariance, two.innovation_covariance, rtol=1e-9)
        # gains, each in its own units
        np.testing.assert_allclose(one.gain, two.gain, atol=1e-9 * np.abs(one.gain).max())
    np.testing.assert_allclose(states[0].sigma, states[1].sigma, rtol=1e-8)


@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_inverse_root_is_that_of_the_factor(m):
    root = np.random.default_rng(m).normal(size=(7, m, m + 2))
    S = root @ root.mT
    inverse = inverse_root(S, "S")
    # errors of both are some roundings times the condition of L, below 1e3 here
    np.testing.assert_allclose(
        inverse @ np.linalg.cholesky(S), np.tile(np.eye(m), (7, 1, 1)), atol=1e-12
    )
    np.testing.assert_array_equal(np.triu(inverse, 1), 0.0)
    S[4, m - 1, m - 1] = -1.0
    with pytest.raises(NumericalError, match="S of run 4 is not positive definite"):
        inverse_root(S, "S")
    S[2, 0, 0] = np.nan
    with pytest.raises(NumericalError, match="S of run 2 is not finite"):
        inverse_root(S, "S")
