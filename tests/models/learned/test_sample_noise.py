"""Stated noise of samples: the covariance, the weights, and what they do for each network."""

import numpy as np
import pytest
import torch
from tests.models.learned.problem import (
    GM,
    acceleration,
    finite_difference_jacobian,
    fractional_error,
    other_orbit,
    samples,
)

from unmodeled.models.learned import (
    ELM,
    HarmonicLeastSquares,
    NoiseLevel,
    PointMassOnly,
    RBFNetwork,
    Residual,
    SpectralMLP,
    fit_batch,
)
from unmodeled.models.learned._sample_noise import covariances, relative, whitening
from unmodeled.models.learned._spectral_training import SpectralStack, _Work


def network():
    return SpectralMLP(layers=2, width=16, epochs=60)


def noisy(seed, position=0.03):
    """Positions and accelerations of Eq. 4, independent draws, and what is known of the noise."""
    X, _, _, _ = samples()
    generator = np.random.default_rng(seed)
    seen = X + position * generator.normal(size=X.shape)
    return seen, acceleration(X + position * generator.normal(size=X.shape)), NoiseLevel(position)


def test_covariance_of_positions_and_accelerations_is_that_of_draws():
    X = np.array([[1.5, 0.3, -0.4], [0.2, 2.0, 1.0]])
    G = finite_difference_jacobian(acceleration, X)
    own = np.array([[0.1, 0.2, 0.3], [0.05, 0.1, 0.0]])
    noise = NoiseLevel(1e-3, 0.02, own, G)
    generator = np.random.default_rng(3)
    draws = 40_000
    for k in range(2):
        one, two, three, four = generator.normal(size=(4, draws, 3))
        # Eq. 4: the pair (x + n', a(x + n) + n_a), against the field at the observed position
        drawn = acceleration(X[k] + 1e-3 * one) - acceleration(X[k] + 1e-3 * two)
        drawn += 0.02 * three + own[k] * four
        found = np.cov(drawn.T)
        expected = covariances(noise, 2, slope=0.0)[k]
        # of a variance over N draws: sqrt(2 / N), six times
        size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.abs(found - expected).max() < 6 * np.sqrt(2 / draws) * size.max()


def test_whitened_noise_has_unit_covariance():
    X, _, _, _ = samples()
    C = covariances(NoiseLevel(0.05, 0.1, gradient=PointMassOnly(GM)._jacobian(X)), len(X), 0.0)
    W = whitening(C)
    # up to the least noise of a direction, 1e-4 of the mean over the axes
    np.testing.assert_allclose(W @ C @ W.mT, np.tile(np.eye(3), (len(X), 1, 1)), atol=1e-3)
    assert np.isclose(np.mean((relative(W) ** 2).sum(axis=(1, 2))), 3.0)


def test_no_noise_and_one_level_for_all_give_no_weights():
    assert whitening(covariances(NoiseLevel(), 5, 3.0)) is None
    assert relative(whitening(covariances(NoiseLevel(0.0, 0.1), 5, 3.0))) is None
    assert relative(whitening(covariances(NoiseLevel(0.2, 0.1), 5, 3.0))) is None
    assert relative(None) is None


def test_a_sample_without_noise_counts_as_the_best_of_the_others():
    own = np.array([[0.1] * 3, [0.2] * 3, [0.0] * 3])
    W = whitening(covariances(NoiseLevel(samples=own), 3, 0.0))
    np.testing.assert_allclose(W[2], W[0], rtol=1e-4)
    np.testing.assert_allclose(W[1], 0.5 * W[0], rtol=1e-4)


@pytest.mark.parametrize("make", [RBFNetwork, ELM, network, HarmonicLeastSquares])
def test_nothing_stated_is_bit_by_bit_the_plain_fit(make):
    X, y, held, _ = samples(noise=0.05)
    plain = make().fit(X, y).predict(held)
    assert np.array_equal(make().fit(X, y, NoiseLevel()).predict(held), plain)
    assert np.array_equal(make().fit(X, y, NoiseLevel(samples=0 * y)).predict(held), plain)


def trained():
    return SpectralMLP(layers=2, width=32, epochs=600, learning_rate=3e-3)


@pytest.mark.parametrize("make", [RBFNetwork, ELM, trained, HarmonicLeastSquares])
def test_a_sample_stated_as_bad_does_no_harm(make):
    X, y, held, truth = samples()
    own, spoiled = np.full_like(y, 1e-2), y.copy()
    spoiled[::10] += 5.0
    blind = fractional_error(make().fit(X, spoiled).predict(held), truth)
    own[::10] = 1e2
    told = fractional_error(make().fit(X, spoiled, NoiseLevel(samples=own)).predict(held), truth)
    assert told < 0.5 * blind


def test_a_bad_axis_is_known_apart_from_the_others():
    X, y, held, truth = samples()
    own, spoiled = np.full_like(y, 1e-2), y.copy()
    own[:, 2] = 1.0
    spoiled[:, 2] += np.random.default_rng(1).normal(size=len(y))
    fitted = Residual(RBFNetwork()).fit(X, spoiled, NoiseLevel(samples=own))
    off = np.abs(fitted.predict(held) - truth)
    assert np.median(off[:, :2]) < 2e-2
    assert np.median(off[:, 2]) < 0.3  # not the noise of 1


@pytest.mark.parametrize("make", [RBFNetwork, ELM])
def test_stated_position_noise_helps_on_another_orbit(make):
    X, truth = other_orbit()
    gains = []
    for seed in range(5):
        seen, y, noise = noisy(seed)
        told, blind = (Residual(make()).fit(seen, y, n).predict(X) for n in (noise, None))
        gains.append(fractional_error(blind, truth) / fractional_error(told, truth))
    assert np.median(gains) > 5.0


def test_networks_on_a_point_mass_weigh_position_noise_and_raw_ones_do_not():
    seen, y, noise = noisy(1)
    raw, on = network(), Residual(network())
    assert np.array_equal(raw.fit(seen, y, noise).predict(seen), raw.fit(seen, y).predict(seen))
    assert not np.array_equal(on.fit(seen, y, noise).predict(seen), on.fit(seen, y).predict(seen))


def test_weighted_networks_are_the_same_in_a_batch_of_differing_noise():
    sets = [noisy(seed) for seed in (1, 2, 3)]
    Xs, ys, noises = zip(*sets, strict=True)
    noises = (noises[0], NoiseLevel(), NoiseLevel(0.01, 0.1))
    alone = [Residual(network()).fit(*d) for d in zip(Xs, ys, noises, strict=True)]
    members = fit_batch(Residual(network()), Xs, ys, noises)
    for one, member in zip(alone, members, strict=True):
        assert np.array_equal(one.predict(Xs[0]), member.predict(Xs[0]))


def test_slope_of_the_weighted_loss_is_that_of_autograd():
    seen, y, noise = noisy(1)
    y = Residual(network())._rest(seen, y)
    noise = Residual(network())._rest_noise(seen, noise)
    white = relative(whitening(covariances(noise, len(y), 0.0)))[None]
    stack = SpectralStack(2, 16, 2.0, [0], torch.device("cpu"))
    work = _Work(torch.from_numpy(seen[None]), stack._shapes)
    work.white = torch.from_numpy(white)
    for group in stack._groups:
        group.normalise(2.0)
    stack._forward(work, torch.from_numpy(y[None]))
    last = len(stack._shapes) - 1
    bias = stack._biases[last].clone().requires_grad_(True)
    outputs = torch.from_numpy(y[None]) + work.error.new_zeros(())
    h = work.outputs[last - 1]
    misfit = torch.bmm(h, stack._effective[last].mT) + bias - outputs
    ((work.white @ misfit[..., None]) ** 2).mean().backward()
    stack._backward(work)
    np.testing.assert_allclose(stack._d_biases[last].numpy(), bias.grad.numpy(), rtol=1e-10)
