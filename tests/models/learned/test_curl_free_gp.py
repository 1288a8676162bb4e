import numpy as np
import pytest
import torch
from tests.models.learned.problem import acceleration, fractional_error, orbit, samples

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.learned import CurlFreeGP, ExactGP, NoiseLevel, Residual
from unmodeled.models.learned import _curl_free_likelihood as likelihood_module
from unmodeled.models.learned import curl_free_gp as module
from unmodeled.models.learned._curl_free_likelihood import CurlFreeLikelihood, covariance
from unmodeled.models.learned._exact_gp_gpytorch import gpytorch


@pytest.fixture(scope="module")
def fitted():
    X, y, _, _ = samples(noise=0.05)
    return CurlFreeGP().fit(X, y, NoiseLevel(acceleration=0.05))


def few(count=40):
    X = orbit(1.9, 0.3, 60.0, 0.0, samples=count)
    return X, acceleration(X) + 0.05 * np.random.default_rng(2).normal(size=X.shape)


def potential_kernel(x, z, length, signal):
    square = ((x - z) ** 2).sum()
    return signal * length**2 * torch.exp(-0.5 * square / length**2)


def test_kernel_is_the_mixed_derivative_of_a_potential_kernel():
    """By autograd, written out point by point."""
    rng = np.random.default_rng(0)
    x, z, length, signal = rng.normal(size=(4, 3)), rng.normal(size=(5, 3)), 0.7, 2.3
    z[0] = x[0]
    ours = covariance(x, z, length, signal).reshape(3, 4, 3, 5)
    for a in range(4):
        for b in range(5):
            both = torch.from_numpy(np.concatenate([x[a], z[b]]))
            hessian = torch.autograd.functional.hessian(
                lambda p: potential_kernel(p[:3], p[3:], length, signal), both
            )
            np.testing.assert_allclose(ours[:, a, :, b], hessian[:3, 3:].numpy(), atol=1e-14)


def test_kernel_is_the_gradient_block_of_gpytorch():
    rng = np.random.default_rng(0)
    x, z, length = rng.normal(size=(6, 3)), rng.normal(size=(5, 3)), 0.7
    kernel = gpytorch.kernels.RBFKernelGrad().double()
    kernel.lengthscale = torch.tensor(length, dtype=torch.float64)
    # ordered by component, values first: (4 x 6, 4 x 5)
    with torch.no_grad():
        whole = kernel(torch.from_numpy(x), torch.from_numpy(z)).to_dense().numpy()
    theirs = whole.reshape(6, 4, 5, 4)[:, 1:, :, 1:].transpose(1, 0, 3, 2).reshape(18, 15)
    np.testing.assert_allclose(covariance(x, z, length, length**-2), theirs, atol=1e-12)


def test_gradient_is_the_slope_of_the_likelihood():
    X, y = few()
    own = np.random.default_rng(1).uniform(0, 1e-2, size=y.shape)
    likelihood = CurlFreeLikelihood(X - X.mean(axis=0), y / y.std(), own)
    at, step = np.log([0.9, 1.5, 1e-3]), 1e-5
    _, gradient = likelihood(at)
    for j, shift in enumerate(step * np.eye(3)):
        slope = (likelihood(at + shift)[0] - likelihood(at - shift)[0]) / (2 * step)
        # truncation step^2; rounding 1e-16 of a value of 1e3 over the step
        assert gradient[j] == pytest.approx(slope, rel=1e-6, abs=1e-5)


def test_it_is_dense_algebra(fitted):
    X, y, held, _ = samples(noise=0.05)
    kernels = [
        covariance(a, b, fitted.lengthscale_, fitted.amplitude_**2)
        for a, b in ((X, X), (held, X), (held, held))
    ]
    K = kernels[0] + fitted.noise_std_**2 * np.eye(3 * len(X))
    ones, target = np.kron(np.eye(3), np.ones((len(X), 1))), y.T.ravel()
    mean = np.linalg.solve(ones.T @ np.linalg.solve(K, ones), ones.T @ np.linalg.solve(K, target))
    rest = target - ones @ mean
    wanted = mean[:, None] + (kernels[1] @ np.linalg.solve(K, rest)).reshape(3, -1)
    # condition number 1e6: 1e-10 of the accelerations
    np.testing.assert_allclose(fitted.predict(held), wanted.T, rtol=0, atol=1e-8)
    whole = kernels[2] - kernels[1] @ np.linalg.solve(K, kernels[1].T)
    left = np.kron(np.eye(3), np.ones((len(held), 1))) - kernels[1] @ np.linalg.solve(K, ones)
    whole += left @ np.linalg.solve(ones.T @ np.linalg.solve(K, ones), left.T)
    blocks = np.einsum("imjm->mij", whole.reshape(3, len(held), 3, len(held)))
    np.testing.assert_allclose(fitted.predict_covariance(held), blocks, rtol=0, atol=1e-8)
    nll = 0.5 * (rest @ np.linalg.solve(K, rest) + np.linalg.slogdet(2 * np.pi * K)[1])
    scaled = nll - 3 * len(X) * np.log(fitted._scaling.y_scale)
    assert fitted.nll_ == pytest.approx(scaled, rel=1e-9)


def test_no_other_hyperparameters_are_more_likely(fitted):
    X, y, _, _ = samples(noise=0.05)
    x, t = fitted._scaling.positions(X), fitted._scaling.targets(y)
    likelihood = CurlFreeLikelihood(x, t, np.zeros_like(t))
    at = np.log(fitted._theta)
    assert likelihood(at)[0] == pytest.approx(fitted.nll_, rel=1e-12)
    assert np.abs(likelihood(at)[1]).max() < 0.05
    for shift in 0.05 * np.concatenate([np.eye(3), -np.eye(3)]):
        assert likelihood(at + shift)[0] > fitted.nll_


def test_no_curl_and_the_potential_has_that_gradient(fitted):
    at = np.concatenate([samples()[2], [[0.5, 0.2, 3.0]]])
    jacobian = fitted.jacobian(at)
    assert np.array_equal(jacobian, jacobian.mT)
    step = 1e-5
    slopes = [
        (fitted.potential(at + d) - fitted.potential(at - d)) / (2 * step) for d in step * np.eye(3)
    ]
    # rounding of a potential of 1e2 over the step: 1e-9; its third derivatives times step^2: 1e-8
    np.testing.assert_allclose(fitted.predict(at), np.stack(slopes, axis=1), rtol=0, atol=1e-6)


def test_a_field_with_curl_is_not_learned():
    """Swirl about z: one component's process fits it, this one must call it noise."""
    rng = np.random.default_rng(5)
    X = rng.uniform(-1, 1, size=(150, 3))
    swirl = np.cross([0.0, 0.0, 1.0], X)
    held = rng.uniform(-0.8, 0.8, size=(40, 3))
    model, free = CurlFreeGP().fit(X, swirl), ExactGP(optimizer="newton").fit(X, swirl)
    truth = np.cross([0.0, 0.0, 1.0], held)
    assert fractional_error(free.predict(held), truth) < 1e-3
    assert fractional_error(model.predict(held), truth) > 0.5


def test_position_noise_is_noise_through_the_gradient():
    X, _, held, truth = samples()
    rng = np.random.default_rng(3)
    seen = X + 0.05 * rng.normal(size=X.shape)
    y = acceleration(X + 0.05 * rng.normal(size=X.shape))
    noise = NoiseLevel(position=0.05)
    plain, aware = (
        Residual(CurlFreeGP(position_noise=p)).fit(seen, y, noise) for p in (False, True)
    )
    errors = [fractional_error(m.predict(held), truth) for m in (plain, aware)]
    assert errors[1] < errors[0]
    assert aware.learner_.noise_std_ < 0.2 * plain.learner_.noise_std_


def test_many_samples_are_refused_with_their_cost():
    X = orbit(1.9, 0.3, 60.0, 0.0, samples=1001)
    text = r"1001 samples: matrices of 0.072 GB and 9 Gflop.*Allowed: max_samples, 1000.*sparse_gp"
    with pytest.raises(DataError, match=text):
        CurlFreeGP().fit(X, X)
    with pytest.raises(ConfigError, match=r"curl_free_gp: iterations is 0\. Allowed: > 0"):
        CurlFreeGP(iterations=0).fit(X, X)
    with pytest.raises(DataError, match="learns from the position alone"):
        CurlFreeGP().fit(np.column_stack([X, X]), X)


def test_large_factors_are_not_kept(monkeypatch):
    X, y = few()
    kept = CurlFreeGP(iterations=2).fit(X, y)
    monkeypatch.setattr(module, "_KEEP", 10)
    dropped = CurlFreeGP(iterations=2).fit(X, y)
    assert dropped._kept_factor is None
    assert np.array_equal(kept.predict_covariance(X[:3]), dropped.predict_covariance(X[:3]))


def test_a_singular_kernel_is_infinitely_unlikely():
    X = np.zeros((5, 3))
    likelihood = likelihood_module.CurlFreeLikelihood(X, X, np.zeros((5, 3)))
    value, gradient = likelihood(np.log([1.0, 1.0, 1e-300]))
    assert value == np.inf
    assert not gradient.any()
