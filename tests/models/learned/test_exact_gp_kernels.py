"""Kernels, lengthscales by input, and position noise of `ExactGP`."""

import numpy as np
import pytest
import torch
from tests.models.learned.problem import (
    acceleration,
    finite_difference_jacobian,
    fractional_error,
    orbit,
    samples,
)

from unmodeled.core.errors import ConfigError
from unmodeled.models.learned import ExactGP, NoiseLevel
from unmodeled.models.learned._exact_gp_gpytorch import GpytorchModel, exact_algebra, gpytorch
from unmodeled.models.learned._exact_gp_likelihood import Likelihood
from unmodeled.models.learned._kernels import KERNELS

MATERN = KERNELS[1:]


def few(noise=0.05, count=80):
    X = orbit(1.9, 0.3, 60.0, 0.0, samples=count)
    return X, acceleration(X) + noise * np.random.default_rng(2).normal(size=X.shape)


def hyperparameters(ard):
    lengths = [[0.8, 1.7, 1.1], [1.9, 0.9, 1.3], [2.5, 3.1, 0.7]][: 3 if ard else 1]
    return np.log([*lengths, [2.0, 0.5, 1.0], [1e-3, 3e-3, 1e-2]])


@pytest.mark.parametrize("ard", [False, True])
@pytest.mark.parametrize("kernel", KERNELS)
def test_likelihood_and_gradient_are_those_of_gpytorch(kernel, ard):
    X, y = few()
    scaling = ExactGP(epochs=1).fit(X, y)._scaling
    x, t = scaling.positions(X), scaling.targets(y)
    log_theta = hyperparameters(ard)
    ours = Likelihood([x], [t], kernel=kernel, ard=ard)(log_theta.T)
    twin = GpytorchModel(x, t, 1e-8, kernel, ard)
    twin.set_theta(np.vstack([np.exp(log_theta), ours.mean]))
    twin.train()
    with exact_algebra():
        objective = gpytorch.mlls.ExactMarginalLogLikelihood(twin.likelihood, twin)
        loss = -objective(twin(*twin.train_inputs), twin.train_targets) * len(x)
        loss.sum().backward()
    # gpytorch clamps squared distances from below and takes |x|^2 - 2 x.z + |z|^2: 1e-15 of them,
    # 3e-8 of the distance, which only the cusp of matern12 feels to first order
    loose = 100.0 if kernel == "matern12" else 1.0
    np.testing.assert_allclose(ours.value, loss.detach().numpy(), rtol=1e-8 * loose)
    raw = twin.covar_module.base_kernel.raw_lengthscale
    slope = raw.grad / torch.sigmoid(raw) * torch.nn.functional.softplus(raw)
    theirs = slope.detach().numpy()[:, 0]
    size = np.abs(theirs).max()
    np.testing.assert_allclose(
        ours.gradient[:, :-2], theirs, rtol=1e-7 * loose, atol=1e-7 * loose * size
    )


@pytest.mark.parametrize("ard", [False, True])
@pytest.mark.parametrize("kernel", KERNELS)
def test_gradient_is_the_slope_of_the_likelihood(kernel, ard):
    X, y = few()
    scaling = ExactGP(epochs=1).fit(X, y)._scaling
    x, t = scaling.positions(X), scaling.targets(y)
    likelihood = Likelihood([x], [t], kernel=kernel, ard=ard)
    theta, step = hyperparameters(ard).T, 1e-5
    ours = likelihood(theta, second=not ard)
    for j in range(theta.shape[1]):
        shift = step * np.eye(theta.shape[1])[j]
        ahead, behind = likelihood(theta + shift), likelihood(theta - shift)
        # truncation: step^2; rounding: 1e-16 of a value of 1e3 over the step
        slope = (ahead.value - behind.value) / (2 * step)
        np.testing.assert_allclose(ours.gradient[:, j], slope, rtol=1e-5, atol=1e-5 * 80)
        if not ard:
            slope = (ahead.gradient - behind.gradient) / (2 * step)
            size = np.abs(ours.curvature).max()
            np.testing.assert_allclose(ours.curvature[:, :, j], slope, rtol=0, atol=1e-5 * size)


@pytest.mark.parametrize("ard", [False, True])
@pytest.mark.parametrize("kernel", MATERN)
def test_prediction_and_likelihood_as_a_gpytorch_model(kernel, ard):
    X, y = few()
    model = ExactGP(optimizer="lbfgs", epochs=15, kernel=kernel, ard=ard).fit(X, y)
    held = orbit(1.92, 0.31, 61.0, 1.0, samples=20)
    twin = model.to_gpytorch()
    twin.train()
    with exact_algebra(), torch.no_grad():
        objective = gpytorch.mlls.ExactMarginalLogLikelihood(twin.likelihood, twin)
        nll = -objective(twin(*twin.train_inputs), twin.train_targets).numpy() * len(X)
        twin.eval()
        at = torch.from_numpy(model._scaling.positions(held)).expand(3, -1, -1)
        posterior = twin(at)
        mean = model._scaling.accelerations(posterior.mean.numpy().T)
        variance = posterior.variance.numpy().T * model._scaling.y_scale**2
    # distances of gpytorch by |x|^2 - 2 x.z + |z|^2, see above
    loose = 1e3 if kernel == "matern12" else 1.0
    size = np.abs(y).max()
    np.testing.assert_allclose(model.nll_, nll, rtol=1e-8 * loose)
    np.testing.assert_allclose(model.predict(held), mean, rtol=0, atol=1e-8 * loose * size)
    ours = np.diagonal(model.predict_covariance(held), axis1=1, axis2=2)
    np.testing.assert_allclose(ours, variance, rtol=0, atol=1e-8 * loose * size**2)


@pytest.mark.parametrize("ard", [False, True])
@pytest.mark.parametrize("kernel", KERNELS)
def test_jacobian_is_the_slope_of_the_prediction(kernel, ard):
    X, y = few()
    model = ExactGP(optimizer="lbfgs", epochs=10, kernel=kernel, ard=ard).fit(X, y)
    at = orbit(1.95, 0.32, 62.0, 2.0, samples=15)
    slopes = finite_difference_jacobian(model.predict, at)
    np.testing.assert_allclose(model.jacobian(at), slopes, rtol=0, atol=1e-6 * np.abs(slopes).max())


def test_newton_ends_where_lbfgs_does_with_matern():
    X, y = few(noise=0.1)
    for kernel in MATERN:
        newton, lbfgs = (
            ExactGP(optimizer=name, kernel=kernel).fit(X, y) for name in ("newton", "lbfgs")
        )
        # each stops when less than about 1e-3 is left to gain
        np.testing.assert_allclose(newton.nll_, lbfgs.nll_, rtol=0, atol=2e-3)


def test_an_input_that_does_not_matter_has_a_long_lengthscale():
    rng = np.random.default_rng(1)
    X = rng.normal(size=(120, 3))
    y = np.sin(2 * X[:, :1]) * [1.0, 2.0, 3.0] + 0.01 * rng.normal(size=(120, 3))
    model = ExactGP(optimizer="lbfgs", ard=True).fit(X, y)
    assert model.lengthscale_.shape == (3, 3)
    assert (model.lengthscale_[:, 1:] > 10 * model.lengthscale_[:, :1]).all()
    assert model.facts()["lengthscale_y_x"] == model.lengthscale_[0, 1]
    alike = ExactGP(optimizer="lbfgs").fit(X, y)
    assert (model.nll_ < alike.nll_ - 100).all()


def test_kernel_and_optimizer_that_do_not_go_together():
    X, y = few()
    with pytest.raises(ConfigError, match=r'kernel is "cosine"\. Allowed: rbf, matern12, matern32'):
        ExactGP(kernel="cosine").fit(X, y)
    with pytest.raises(ConfigError, match=r'ard with optimizer "newton"\. Allowed: adam, lbfgs'):
        ExactGP(ard=True, optimizer="newton").fit(X, y)


def test_position_noise_is_noise_through_the_gradient():
    """The noise that is fitted beside it is that of the accelerations; skill and spread gain."""
    X, y, held, truth = samples()
    rng = np.random.default_rng(3)
    seen = X + 0.05 * rng.normal(size=X.shape)
    y = acceleration(X + 0.05 * rng.normal(size=X.shape)) + 0.01 * rng.normal(size=X.shape)
    noise = NoiseLevel(position=0.05, acceleration=0.01)
    plain, aware = (
        ExactGP(optimizer="newton", position_noise=p).fit(seen, y, noise) for p in (False, True)
    )
    assert (aware.nll_ < plain.nll_ - 10).all()
    assert fractional_error(aware.predict(held), truth) < fractional_error(
        plain.predict(held), truth
    )
    assert (aware.noise_std_ < 0.5 * plain.noise_std_).all()
    # without position noise the flag changes nothing
    a, b = (ExactGP(epochs=2, position_noise=p).fit(X, y) for p in (False, True))
    assert np.array_equal(a.predict(held), b.predict(held))
