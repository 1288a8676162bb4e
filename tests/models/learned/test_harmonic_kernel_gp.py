"""The learner with a closed harmonic kernel: limit of the finite rank, skill, covariances."""

from itertools import pairwise

import numpy as np
import pytest
from tests.models.learned.problem import fractional_error, other_orbit, samples

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.learned import HarmonicKernelGP, NoiseLevel
from unmodeled.models.learned._harmonic_kernel_likelihood import HarmonicKernelLikelihood
from unmodeled.models.learned._harmonic_kernels import LAWS, coefficient_variances, derivative_block
from unmodeled.models.physics.exterior_harmonics import (
    column_degrees,
    derivative,
    exterior_harmonics,
)

NOISE = NoiseLevel(acceleration=0.1)


@pytest.fixture(scope="module")
def fitted():
    X, y, _, _ = samples(noise=0.1)
    return HarmonicKernelGP().fit(X[::2], y[::2], NOISE)


def design(X, degree, order):
    tables = [exterior_harmonics(X, degree + order)]
    for _ in range(order):
        tables = [derivative(t, i) for t in tables for i in range(3)]
    return np.stack([t.T for t in tables], axis=1)  # (n, 3^order, p)


def finite_posterior(learner, y, X, degree, order):
    """Mean (n, k) and covariance (n, k, k) of weights to a degree under the same prior."""
    n = column_degrees(degree)
    q, s, sigma = learner.attenuation_, learner.amplitude_, learner.noise_std_ / learner.gm
    prior = s * q**n * np.sqrt(coefficient_variances(learner.kernel, n))
    rows = design(learner._x, degree, 1).reshape(-1, len(n))
    # Square roots all along, so that the rounding is that of the kernel's side alone.
    unit = np.where(n < 2, sigma / np.linalg.norm(rows, axis=0), prior)
    stacked = np.concatenate([rows * unit / sigma, np.eye(len(n))[4:]])
    target = np.concatenate([y.ravel() / learner.gm / sigma, np.zeros(len(n) - 4)])
    orthogonal, triangle = np.linalg.qr(stacked)
    root = unit[:, None] * np.linalg.inv(triangle)
    mean = root @ (orthogonal.T @ target)
    at = design(X, degree, order)
    half = at @ root
    return learner.gm * at @ mean, learner.gm**2 * half @ half.mT


def roundings(learner, X, order):
    """What sums of terms much larger than themselves leave of mean and covariance.

    The kernel also holds degrees 0 and 1, which the flat prior cancels: terms are as large as they
    are. Some 50 roundings make a term, and the squares of the covariance are three such sums.
    """
    eps = 50 * np.finfo(float).eps
    cross = np.concatenate([c for _, c in learner._pieces(X, order)])
    c, signal = learner._theta[:2]
    alone = X[:, None, :]
    prior = np.abs(derivative_block(learner.kernel, alone, alone, c, order, order)).max()
    mean = learner.gm * (np.abs(cross) * np.abs(learner._weights)).sum(axis=-1).max()
    return eps * mean, 3 * eps * learner.gm**2 * signal / c * prior


@pytest.mark.parametrize("law", LAWS)
def test_it_is_the_limit_of_the_finite_rank(law):
    """Mean and covariance of all three at the rate of the tail, q^2 / (r r') to the power N."""
    X, y, _, _ = samples(noise=0.1)
    X, y = X[::3], y[::3]
    learner = HarmonicKernelGP(law)
    learner.n_samples_, learner.n_inputs_ = len(X), 3
    theta = np.array([0.7**2, 0.02**2, (0.1 / learner.gm) ** 2])
    learner._condition(X, y / learner.gm, np.zeros_like(X), theta)
    other = other_orbit()[0][::10]
    for order, mean, covariance in (
        (0, learner.potential(other), learner.potential_variance(other)[:, None, None]),
        (1, learner.predict(other), learner.predict_covariance(other)),
        (2, learner.jacobian(other), learner.jacobian_covariance(other)),
    ):
        mean = mean.reshape(len(other), -1)
        rounding = np.array(roundings(learner, other, order))
        misses = []
        for degree in (4, 8, 12, 16, 20):
            found, spread = finite_posterior(learner, y, other, degree, order)
            misses.append([np.abs(found - mean).max(), np.abs(spread - covariance).max()])
        s = 0.7**2 / np.linalg.norm(other, axis=1).min() ** 2
        for before, after in pairwise(misses):
            # s^4 for four degrees; the factor N^(2 order + 1) rises by at most 2^5
            assert (np.array(after) < np.maximum(2.0**5 * s**4 * np.array(before), rounding)).all()
        assert misses[-1][0] < 1e-8 * np.abs(mean).max()
        assert misses[-1][1] < 1e-6 * np.abs(covariance).max()


@pytest.mark.parametrize("law", LAWS)
def test_closed_form_gradient_of_the_likelihood(law):
    X, y, _, _ = samples(noise=0.1)
    own = np.random.default_rng(1).uniform(0, 1e-5, (30, 3))
    likelihood = HarmonicKernelLikelihood(law, X[::8], y[::8] / 40, own)
    at, step = np.log([0.3, 1e-3, 1e-5]), 1e-5
    slopes = [
        (likelihood(at + h)[0] - likelihood(at - h)[0]) / (2 * step) for h in step * np.eye(3)
    ]
    gradient = likelihood(at)[1]
    # truncation step^2 = 1e-10, rounding 1e-13 / step = 1e-8, both of values of order 100
    np.testing.assert_allclose(gradient, slopes, rtol=0, atol=1e-6 * np.abs(slopes).max())


@pytest.mark.parametrize("law", LAWS)
def test_it_carries_over_to_another_orbit(law):
    X, y, _, _ = samples()
    other, truth = other_orbit()
    learner = HarmonicKernelGP(law, iterations=15).fit(X[::3], y[::3])
    # the bare point mass has 5e-3 there, the exact GP more than 0.1
    assert fractional_error(learner.predict(other), truth) < 1e-6


def test_potential_acceleration_and_gradient_belong_together(fitted):
    X, step = other_orbit()[0][:6], 1e-4
    moves = step * np.eye(3)
    slope = [(fitted.potential(X + m) - fitted.potential(X - m)) / (2 * step) for m in moves]
    predicted = fitted.predict(X)
    # truncation 1e-8; the potential is a sum whose terms are 10^4 times larger: 1e-12 / step
    size = np.abs(predicted).max()
    np.testing.assert_allclose(np.stack(slope, axis=1), predicted, rtol=0, atol=1e-7 * size)
    gradient = fitted.jacobian(X)
    size = np.abs(gradient).max()
    np.testing.assert_allclose(gradient, gradient.mT, rtol=0, atol=1e-12 * size)
    mean, variance = roundings(fitted, X, 2)
    assert np.abs(np.trace(gradient, axis1=1, axis2=2)).max() < mean < 1e-7 * size
    spread = fitted.jacobian_covariance(X)
    assert np.abs(spread[:, [0, 4, 8]].sum(axis=1)).max() < variance
    assert (fitted.potential_variance(X) > 0).all()


def test_noise_and_band_are_those_of_the_data(fitted):
    other, truth = other_orbit()
    assert fitted.noise_std_ == pytest.approx(0.1, rel=0.15)  # 3.5 standard errors of 353 freedoms
    deviation = np.sqrt(np.diagonal(fitted.predict_covariance(other), axis1=1, axis2=2))
    share = np.mean(np.abs(fitted.predict(other) - truth) < 1.96 * deviation)
    assert share > 0.85


def test_position_noise_widens_the_band():
    X, y, _, _ = samples()
    X, y = X[::3], y[::3]
    noisy = X + 0.05 * np.random.default_rng(2).normal(size=X.shape)
    other = other_orbit()[0]
    told, untold = (
        HarmonicKernelGP(iterations=15).fit(noisy, y, noise)
        for noise in (NoiseLevel(position=0.05), NoiseLevel())
    )
    assert told.noise_std_ < untold.noise_std_
    assert told.facts()["jitter"] == untold.facts()["jitter"] == 0.0
    assert np.isfinite(told.predict(other)).all()


def test_bad_input_is_refused_with_a_reason(fitted):
    X, y, _, _ = samples()
    with pytest.raises(
        ConfigError, match=r'harmonic_kernel_gp: kernel is "rbf". Allowed: reciprocal'
    ):
        HarmonicKernelGP("rbf").fit(X, y)
    with pytest.raises(ConfigError, match=r"noise_floor is 0. Allowed: a number > 0"):
        HarmonicKernelGP(noise_floor=0).fit(X, y)
    with pytest.raises(DataError, match=r"was given 238 samples.*max_samples, 100. Thin"):
        HarmonicKernelGP(max_samples=100).fit(X, y)
    inside = 0.5 * fitted.attenuation_
    with pytest.raises(DataError, match=r"position 0 is .* inside the Bjerhammar sphere of 0"):
        fitted.predict([[inside, 0.0, 0.0]])
