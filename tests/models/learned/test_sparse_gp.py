import numpy as np
import pytest
import torch
from tests.models.learned.problem import acceleration, fractional_error, orbit, samples

from unmodeled.core.errors import ConfigError
from unmodeled.models.learned import ExactGP, NoiseLevel, SparseGP
from unmodeled.models.learned._exact_gp_gpytorch import exact_algebra, gpytorch
from unmodeled.models.learned._exact_gp_likelihood import Likelihood
from unmodeled.models.learned._inducing import greedy_points, kmeans_points
from unmodeled.models.learned._sparse_bound import JITTER, SparseBound
from unmodeled.models.learned.scaling import Standardiser

ALL = np.arange(3)


def scaled(noise=0.05):
    X, y, _, _ = samples(noise)
    scaling = Standardiser.of(X, y)
    return scaling.positions(X), scaling.targets(y)


def hyperparameters(ard=False):
    lengths = [0.8, 1.1, 0.9] if ard else [0.8]
    return np.log([[*lengths, 2.0, 1e-3], [*lengths, 0.5, 3e-3], [*lengths, 1.0, 1e-2]])


@pytest.mark.parametrize("ard", [False, True])
@pytest.mark.parametrize("kernel", ["rbf", "matern12", "matern52"])
def test_gradient_is_the_slope_of_the_bound(kernel, ard):
    x, t = scaled()
    own = np.random.default_rng(1).uniform(0, 1e-2, size=t.shape)
    # few points: more RBF points than the field needs would leave rounding in the differences
    bound = SparseBound(x, t, own, x[1:25:2], kernel)
    theta, step = hyperparameters(ard), 1e-5
    ours = bound(theta, which=ALL)
    for j in range(theta.shape[1]):
        shift = step * np.eye(theta.shape[1])[j]
        ahead, behind = bound(theta + shift, which=ALL), bound(theta - shift, which=ALL)
        slope = (ahead.value - behind.value) / (2 * step)
        # truncation step^2 and rounding 1e-16 of values of 1e4, times a condition of 1e5, over it
        size = np.abs(ours.gradient).max()
        np.testing.assert_allclose(ours.gradient[:, j], slope, rtol=0, atol=1e-6 * size)


@pytest.mark.parametrize("kernel", ["rbf", "matern32"])
def test_with_a_point_on_every_sample_it_is_the_exact_likelihood(kernel):
    x, t = scaled()
    own = np.random.default_rng(1).uniform(0, 1e-2, size=t.shape)
    for ard in (False, True):
        theta = hyperparameters(ard)
        exact = Likelihood([x], [t], own=[own], kernel=kernel, ard=ard)(theta)
        ours = SparseBound(x, t, own, x, kernel)(theta, which=ALL)
        # the jitter on the points, as a share of the noise, for each sample
        limit = len(x) * JITTER * 2.0 / 1e-3
        np.testing.assert_allclose(ours.value, exact.value, rtol=0, atol=limit)
        np.testing.assert_allclose(ours.gradient, exact.gradient, rtol=0, atol=10 * limit)


def test_it_is_a_bound_that_rises_with_the_points():
    x, t = scaled()
    theta = hyperparameters()
    exact = Likelihood([x], [t])(theta).value
    values = [
        SparseBound(x, t, np.zeros_like(t), greedy_points(x, m, "rbf", np.array([0.8])), "rbf")(
            theta, which=ALL
        ).value
        for m in (20, 40, 80)
    ]
    assert (values[0] > values[1]).all()
    assert (values[1] > values[2]).all()
    assert (values[2] > exact - 1e-3).all()


def test_the_bound_is_that_of_gpytorch():
    x, t = scaled()
    z, theta = x[::6], hyperparameters()[0]
    ours = SparseBound(x, t, np.zeros_like(t), z, "matern32")(theta[None], which=np.array([0]))

    class Twin(gpytorch.models.ExactGP):
        def __init__(self, likelihood):
            super().__init__(torch.from_numpy(x), torch.from_numpy(t[:, 0].copy()), likelihood)
            self.mean_module = gpytorch.means.ConstantMean()
            self.base = gpytorch.kernels.ScaleKernel(gpytorch.kernels.MaternKernel(nu=1.5))
            self.covar_module = gpytorch.kernels.InducingPointKernel(
                self.base, torch.from_numpy(z.copy()), likelihood
            )
            self.double()

        def forward(self, x):
            return gpytorch.distributions.MultivariateNormal(
                self.mean_module(x), self.covar_module(x)
            )

    twin = Twin(gpytorch.likelihoods.GaussianLikelihood())
    length, signal, noise = torch.from_numpy(np.exp(theta))
    twin.base.base_kernel.lengthscale, twin.base.outputscale = length, signal
    twin.likelihood.noise = noise
    twin.mean_module.constant = torch.from_numpy(ours.mean)[0]
    twin.train()
    objective = gpytorch.mlls.ExactMarginalLogLikelihood(twin.likelihood, twin)
    with exact_algebra(), torch.no_grad():
        value = -objective(twin(*twin.train_inputs), twin.train_targets).numpy() * len(x)
    # jitters of 1e-10 (ours) and 1e-8 (gpytorch's) of a signal of 2 over a noise of 1e-3
    np.testing.assert_allclose(ours.value, value, rtol=0, atol=len(x) * 1e-8 * 2 / 1e-3)


@pytest.mark.parametrize("ard", [False, True])
def test_with_a_point_on_every_sample_it_is_exact_gp(ard):
    X, y, held, _ = samples(noise=0.05)
    exact = ExactGP(optimizer="lbfgs", ard=ard).fit(X, y)
    sparse = SparseGP(inducing=len(X), ard=ard).fit(X, y)
    # each stops where less than 1e-3 of the likelihood is left to gain: 1e-3 of the noise or so
    np.testing.assert_allclose(sparse.bound_, exact.nll_, rtol=0, atol=1e-2)
    np.testing.assert_allclose(sparse.predict(held), exact.predict(held), rtol=0, atol=1e-3)
    variances = [np.diagonal(m.predict_covariance(held), axis1=1, axis2=2) for m in (sparse, exact)]
    np.testing.assert_allclose(*variances, rtol=0.05)


def test_far_fewer_points_than_samples_are_enough():
    X = orbit(1.9, 0.3, 60.0, 0.0, samples=3000, drift=0.1)
    truth = acceleration(X)
    y = truth + 0.05 * np.random.default_rng(0).normal(size=X.shape)
    model = SparseGP(inducing=100, evidence_samples=600).fit(X[::2], y[::2])
    assert model.inducing_.shape == (100, 3)
    # closer to the truth than a sample is
    assert fractional_error(model.predict(X[1::2]), truth[1::2]) < fractional_error(y, truth)
    # what the points cannot carry is called noise, never less than there is
    assert (model.noise_std_ > 0.045).all()
    assert (model.noise_std_ < 0.1).all()
    again = SparseGP(inducing=100, evidence_samples=600).fit(X[::2], y[::2])
    assert np.array_equal(model.predict(X[1::2]), again.predict(X[1::2]))


def test_clean_data_and_few_points_do_not_end_as_all_noise():
    X, y, held, truth = samples()
    model = SparseGP(inducing=60).fit(X, y)
    assert fractional_error(model.predict(held), truth) < 1e-3


def test_greedy_points_are_the_least_known_and_kmeans_the_means():
    x, _ = scaled()
    length = np.array([0.8])
    chosen = greedy_points(x, 10, "rbf", length)
    assert chosen.shape == (10, 3)
    # by dense algebra: each is the sample of the largest conditional variance
    for k in range(1, 10):
        K = np.exp(-0.5 * ((chosen[:k, None] - chosen[None, :k]) ** 2).sum(-1) / 0.64)
        c = np.exp(-0.5 * ((x[:, None] - chosen[None, :k]) ** 2).sum(-1) / 0.64)
        variance = 1 - np.einsum("ij,ji->i", c, np.linalg.solve(K, c.T))
        assert (x[np.argmax(variance)] == chosen[k]).all()
    # a long lengthscale knows everything from a few
    assert len(greedy_points(x, 200, "rbf", np.array([100.0]))) < 20
    means = kmeans_points(x, 12, 3)
    assert means.shape == (12, 3)
    assert np.array_equal(means, kmeans_points(x, 12, 3))
    label = ((x[:, None] - means[None]) ** 2).sum(-1).argmin(axis=1)
    spread = ((x - means[label]) ** 2).sum() / ((x - x.mean(axis=0)) ** 2).sum()
    assert spread < 0.1


def test_position_noise_is_noise_through_the_gradient():
    X, _, held, truth = samples()
    rng = np.random.default_rng(3)
    seen = X + 0.05 * rng.normal(size=X.shape)
    y = acceleration(X + 0.05 * rng.normal(size=X.shape)) + 0.01 * rng.normal(size=X.shape)
    noise = NoiseLevel(position=0.05, acceleration=0.01)
    plain, aware = (
        SparseGP(inducing=100, position_noise=p).fit(seen, y, noise) for p in (False, True)
    )
    errors = [fractional_error(m.predict(held), truth) for m in (plain, aware)]
    assert errors[1] < errors[0]
    assert (aware.noise_std_ < 0.5 * plain.noise_std_).all()


def test_bad_hyperparameters():
    X, y, _, _ = samples()
    for key in ("inducing", "evidence_samples", "iterations", "noise_floor"):
        with pytest.raises(ConfigError, match=rf"sparse_gp: {key} is 0\. Allowed: > 0"):
            SparseGP(**{key: 0}).fit(X, y)
    with pytest.raises(ConfigError, match=r'placement is "grid"\. Allowed: greedy, kmeans'):
        SparseGP(placement="grid").fit(X, y)
    with pytest.raises(ConfigError, match=r'sparse_gp: kernel is "cosine"'):
        SparseGP(kernel="cosine").fit(X, y)
