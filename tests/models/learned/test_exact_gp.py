import numpy as np
import pytest
import torch
from tests.models.learned.problem import acceleration, fractional_error, orbit, samples

from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.models.learned import exact_gp
from unmodeled.models.learned._exact_gp_gpytorch import GpytorchModel, exact_algebra, gpytorch
from unmodeled.models.learned._exact_gp_likelihood import Likelihood
from unmodeled.models.learned._exact_gp_training import adam, best_start
from unmodeled.models.learned._factor import factorise
from unmodeled.models.learned.exact_gp import ExactGP
from unmodeled.models.learned.learner import NoiseLevel


@pytest.fixture(scope="module")
def fitted():
    X, y, _, _ = samples(noise=0.01)
    return ExactGP(epochs=30).fit(X, y)


def dense_kernels(model, X, Z):
    """Signal covariances (3, n, m) in the units of the samples, from public attributes only."""
    square = ((X[:, None] - Z[None]) ** 2).sum(-1)
    return np.stack(
        [
            a**2 * np.exp(-0.5 * square / length**2)
            for a, length in zip(model.amplitude_, model.lengthscale_, strict=True)
        ]
    )


def gpytorch_twin(model, X, y):
    """The same process in gpytorch, in scaled units."""
    scaling = model._scaling
    twin = GpytorchModel(scaling.positions(X), scaling.targets(y), model.noise_floor)
    twin.set_theta(model._theta)
    return twin


def test_posterior_is_that_of_gpytorch(fitted):
    X, y, held, _ = samples(noise=0.01)
    twin = gpytorch_twin(fitted, X, y)
    twin.eval()
    at = torch.from_numpy(fitted._scaling.positions(held)).expand(3, -1, -1)
    with exact_algebra(), torch.no_grad():
        posterior = twin(at)
        mean, variance = posterior.mean.numpy().T, posterior.variance.numpy().T
    y_scale = fitted._scaling.y_scale
    np.testing.assert_allclose(
        fitted.predict(held), fitted._scaling.accelerations(mean), rtol=0, atol=1e-8 * y_scale
    )
    ours = np.diagonal(fitted.predict_covariance(held), axis1=1, axis2=2)
    np.testing.assert_allclose(ours, variance * y_scale**2, rtol=0, atol=1e-8 * y_scale**2)


@pytest.mark.parametrize("count", [60, pytest.param(900, id="900: past gpytorch's change to CG")])
def test_likelihood_and_prediction_are_dense_algebra(count):
    X = orbit(1.9, 0.3, 60.0, 0.0, samples=count)
    y = acceleration(X) + 0.05 * np.random.default_rng(0).normal(size=X.shape)
    model = ExactGP(epochs=1).fit(X, y)
    at = orbit(2.0, 0.2, 70.0, 10.0, samples=25)
    mean = model._scaling.accelerations(model._theta[3])
    signal, cross = dense_kernels(model, X, X), dense_kernels(model, at, X)
    with exact_algebra(), torch.no_grad():
        twin = gpytorch_twin(model, X, y)
        objective = gpytorch.mlls.ExactMarginalLogLikelihood(twin.likelihood, twin)
        trained_on = -objective(twin(*twin.train_inputs), twin.train_targets).numpy()
    for i in range(3):
        K = signal[i] + model.noise_std_[i] ** 2 * np.eye(count)
        rest = y[:, i] - mean[i]
        weights = np.linalg.solve(K, rest)
        np.testing.assert_allclose(
            model.predict(at)[:, i], mean[i] + cross[i] @ weights, rtol=0, atol=1e-8
        )
        variance = model.amplitude_[i] ** 2 - np.einsum(
            "ij,ji->i", cross[i], np.linalg.solve(K, cross[i].T)
        )
        np.testing.assert_allclose(
            model.predict_covariance(at)[:, i, i], variance, rtol=0, atol=1e-8
        )
        nll = 0.5 * (rest @ weights + np.linalg.slogdet(K)[1] + count * np.log(2 * np.pi))
        # nll_ is that of scaled targets: a change of variables
        scaled = nll - count * np.log(model._scaling.y_scale)
        assert model.nll_[i] == pytest.approx(scaled, rel=1e-9)
        # What Adam minimises is exact as well; gpytorch divides it by the number of samples.
        assert trained_on[i] * count == pytest.approx(scaled, rel=1e-9)


def test_clean_data_are_not_explained_as_noise():
    X, y, held, truth = samples()
    model = ExactGP().fit(X, y)
    # gpytorch's default noise floor of 1e-4 ends at 2e-4 here; the floor of 1e-8 at 1e-5
    assert fractional_error(model.predict(held), truth) < 5e-5
    assert model.noise_std_.max() < 1e-3 * model.amplitude_.min()
    assert model.jitter_ == 0.0


def test_noise_is_found():
    X, y, held, truth = samples(noise=0.2)
    model = ExactGP().fit(X, y)
    # standard error of a standard deviation from n samples: 1 / sqrt(2 n); six of them
    np.testing.assert_allclose(model.noise_std_, 0.2, rtol=6 / np.sqrt(2 * len(X)))
    spread = np.sqrt(np.diagonal(model.predict_covariance(held), axis1=1, axis2=2))
    assert (np.abs(model.predict(held) - truth) < 6 * spread).all()


def test_known_noise_is_the_start_and_not_the_value():
    X, y, _, _ = samples(noise=0.2)
    far_off = ExactGP(epochs=1).fit(X, y, NoiseLevel(acceleration=1.0))
    np.testing.assert_allclose(far_off.noise_std_, 1.0, rtol=0.1)
    np.testing.assert_allclose(
        ExactGP(epochs=100).fit(X, y, NoiseLevel(acceleration=1.0)).noise_std_, 0.2, rtol=0.3
    )


def test_training_never_ends_less_likely_than_it_began():
    X, y, _, _ = samples(noise=0.01)
    start = ExactGP(epochs=1, learning_rate=1e-12).fit(X, y)
    assert (ExactGP(epochs=60).fit(X, y).nll_ < start.nll_).all()
    wild = ExactGP(epochs=10, learning_rate=50.0).fit(X, y)
    assert np.isfinite(wild.predict(X)).all()
    # both keep the start; its likelihood rounds to 1e-16 times a condition number near 1e11
    assert (wild.nll_ <= start.nll_ + 1e-4).all()


def test_far_away_the_variance_is_the_prior_and_the_mean_is_constant(fitted):
    far = np.array([[100.0, 0.0, 0.0]])
    covariance = fitted.predict_covariance(far)[0]
    np.testing.assert_allclose(np.diag(covariance), fitted.amplitude_**2, rtol=1e-12)
    np.testing.assert_array_equal(covariance - np.diag(np.diag(covariance)), 0.0)
    np.testing.assert_allclose(fitted.jacobian(far), 0.0, atol=1e-200)


def test_repeated_positions_and_equatorial_orbits_are_harmless():
    X = orbit(1.9, 0.3, 0.0, 0.0, samples=100, drift=0.0)  # four times the same 25 points
    assert not X[:, 2].any()
    model = ExactGP(epochs=20).fit(X, acceleration(X) * [1.0, 1.0, 0.0])
    assert np.isfinite(model.predict(X)).all()
    np.testing.assert_allclose(model.predict(X)[:, 2], 0.0, atol=1e-12)


def test_jitter_is_reported():
    singular = np.ones((3, 3))
    singular[0, 1] = singular[1, 0] = 1.0 + 1e-9
    _, jitter = factorise(ExactGP.name, singular)
    assert jitter == pytest.approx(1e-8)
    with pytest.raises(NumericalError, match="not positive definite even with 1e-04"):
        factorise(ExactGP.name, np.array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(NumericalError, match="Raise noise_floor"):
        factorise(ExactGP.name, np.full((2, 2), np.nan))


def test_facts_name_the_fit(fitted):
    facts = fitted.facts()
    assert facts["jitter"] == 0.0
    assert facts["lengthscale_x"] == fitted.lengthscale_[0]
    assert facts["negative_log_likelihood_z"] == fitted.nll_[2]
    scaled = fitted._scaling.positions(samples()[0])
    square = ((scaled[:, None] - scaled[None]) ** 2).sum(-1)
    length, signal, noise, _ = fitted._theta
    worst = max(
        np.linalg.cond(s * np.exp(-0.5 * square / q**2) + n * np.eye(len(scaled)), 1)
        for q, s, n in zip(length, signal, noise, strict=True)
    )
    # LAPACK's estimate is a lower bound, rarely off by more than a factor of 3
    assert worst / 3 < facts["condition_number"] < worst * (1 + 1e-6)


def test_gpytorch_settings_are_as_before():
    before = (
        gpytorch.settings.max_cholesky_size.value(),
        gpytorch.settings.fast_computations.log_prob.on(),
        gpytorch.settings.cholesky_jitter.value(torch.float64),
        torch.get_default_dtype(),
    )
    X, y, _, _ = samples()
    ExactGP(epochs=2).fit(X, y)
    assert before == (
        gpytorch.settings.max_cholesky_size.value(),
        gpytorch.settings.fast_computations.log_prob.on(),
        gpytorch.settings.cholesky_jitter.value(torch.float64),
        torch.get_default_dtype(),
    )


@pytest.mark.parametrize("key", ["epochs", "learning_rate", "noise_floor"])
def test_hyperparameters_out_of_range(key):
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match=f"exact_gp: {key} is 0. Allowed: > 0"):
        ExactGP(**{key: 0}).fit(X, y)


def test_closed_form_gradient_is_that_of_gpytorch():
    """Value and gradient at hyperparameters far from the optimum, against autograd."""
    X, y, _, _ = samples(noise=0.01)
    model = ExactGP(epochs=1).fit(X, y)
    x, t = model._scaling.positions(X), model._scaling.targets(y)
    log_theta = np.log([[0.8, 1.7, 1.1], [2.0, 0.5, 1.0], [1e-3, 3e-3, 1e-2]])
    ours = Likelihood([x], [t])(log_theta.T)
    twin = GpytorchModel(x, t, 1e-8)
    twin.set_theta(np.vstack([np.exp(log_theta), ours.mean]))
    twin.train()
    with exact_algebra():
        objective = gpytorch.mlls.ExactMarginalLogLikelihood(twin.likelihood, twin)
        loss = -objective(twin(*twin.train_inputs), twin.train_targets) * len(x)
        loss.sum().backward()
    # gpytorch differentiates by its raw parameters: softplus plus the noise floor.
    raw = [
        (twin.covar_module.base_kernel.raw_lengthscale, 0.0),
        (twin.covar_module.raw_outputscale, 0.0),
        (twin.likelihood.noise_covar.raw_noise, 1e-8),
    ]
    for row, (parameter, floor) in enumerate(raw):
        value = torch.nn.functional.softplus(parameter.detach()) + floor
        slope = parameter.grad / torch.sigmoid(parameter.detach()) * value
        theirs = slope.numpy().reshape(3)
        np.testing.assert_allclose(ours.gradient[:, row], theirs, rtol=1e-7)
    np.testing.assert_allclose(ours.value, loss.detach().numpy(), rtol=1e-10)


@pytest.mark.parametrize("single", [0.0, 1e-2])
def test_second_derivatives_are_the_slope_of_the_gradient(single):
    X, y, _, _ = samples(noise=0.05)
    model = ExactGP(epochs=1).fit(X, y)
    own = single * np.random.default_rng(1).uniform(size=y.shape)
    x, t = model._scaling.positions(X), model._scaling.targets(y)
    likelihood = Likelihood([x], [t], own=[own])
    theta = np.log([[0.8, 2.0, 1e-3], [1.7, 0.5, 3e-3], [1.1, 1.0, 1e-2]])
    ours = likelihood(theta, second=True).curvature
    step = 1e-5
    for j in range(3):
        shift = step * np.eye(3)[j]
        ahead, behind = likelihood(theta + shift), likelihood(theta - shift)
        # and the gradient is the slope of the value, whose rounding over the step is 1e-7
        np.testing.assert_allclose(
            likelihood(theta).gradient[:, j],
            (ahead.value - behind.value) / (2 * step),
            rtol=1e-5,
            atol=1e-4,
        )
        slope = (ahead.gradient - behind.gradient) / (2 * step)
        # truncation: step^2 times third derivatives of the size of the second; rounding:
        # 1e-16 times a condition number of 1e5, over the step
        np.testing.assert_allclose(ours[:, :, j], slope, rtol=0, atol=1e-5 * np.abs(ours).max())


def test_derivative_by_a_given_mean():
    X, y, _, _ = samples(noise=0.05)
    model = ExactGP(epochs=1).fit(X, y)
    likelihood = Likelihood([model._scaling.positions(X)], [model._scaling.targets(y)])
    theta, mean, step = np.log([[0.8, 2.0, 1e-3]] * 3), np.array([0.1, -0.2, 0.3]), 1e-4
    slope = (likelihood(theta, mean + step).value - likelihood(theta, mean - step).value) / 2 / step
    # the value is quadratic in the mean: rounding only
    np.testing.assert_allclose(likelihood(theta, mean).mean_gradient, slope, rtol=1e-6)
    assert not likelihood(theta).mean_gradient.any()


def test_adam_takes_the_course_of_gpytorch():
    """The paper's optimiser, step by step as the library takes it."""
    X, y, _, _ = samples(noise=0.05)
    x = ExactGP(epochs=1).fit(X, y)
    inputs, targets = x._scaling.positions(X), x._scaling.targets(y)
    start = best_start(inputs, targets, 1e-8, 0.0)
    twin = GpytorchModel(inputs, targets, 1e-8)
    twin.set_theta(start)
    twin.train()
    objective = gpytorch.mlls.ExactMarginalLogLikelihood(twin.likelihood, twin)
    steps = torch.optim.Adam(twin.parameters(), lr=0.1)
    best, theirs = np.full(3, np.inf), start
    with exact_algebra():
        for _ in range(20):
            steps.zero_grad()
            loss = -objective(twin(*twin.train_inputs), twin.train_targets)
            better = loss.detach().numpy() < best
            theirs = np.where(better, twin.theta(), theirs)
            best = np.where(better, loss.detach().numpy(), best)
            loss.sum().backward()
            steps.step()
    ours = adam(Likelihood([inputs], [targets]), [start], 1e-8, 19, 0.1, lambda share: None)[0]
    # rounding of a gradient, 1e-16 times a condition number of 1e5, amplified by Adam's quotient
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("optimizer", ["lbfgs", "newton"])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_the_optimum_is_at_least_as_likely_as_adam(noise, optimizer):
    X, y, held, truth = samples(noise=noise)
    adam, best = (ExactGP(optimizer=name).fit(X, y) for name in ("adam", optimizer))
    assert np.all(best.nll_ <= adam.nll_ + 1e-3)
    ours, theirs = (fractional_error(m.predict(held), truth) for m in (best, adam))
    assert ours < 2 * theirs


def test_newton_and_lbfgs_end_at_the_same_optimum():
    X, y, _, _ = samples(noise=0.1)
    newton, lbfgs = (ExactGP(optimizer=name).fit(X, y) for name in ("newton", "lbfgs"))
    # each stops when less than about 1e-3 is left to gain
    np.testing.assert_allclose(newton.nll_, lbfgs.nll_, rtol=0, atol=1e-3)
    np.testing.assert_allclose(newton.noise_std_, lbfgs.noise_std_, rtol=1e-2)


def test_large_factors_are_not_kept(monkeypatch):
    X, y, held, _ = samples(noise=0.05)
    kept = ExactGP(epochs=1).fit(X, y)
    monkeypatch.setattr(exact_gp, "_KEEP", 100)
    dropped = ExactGP(epochs=1).fit(X, y)
    assert kept._kept_factors is not None
    assert dropped._kept_factors is None
    assert np.array_equal(kept.predict_covariance(held), dropped.predict_covariance(held))


def test_as_a_gpytorch_model(fitted):
    held = samples()[2]
    twin = fitted.to_gpytorch().eval()
    with exact_algebra(), torch.no_grad():
        at = torch.from_numpy(fitted._scaling.positions(held)).expand(3, -1, -1)
        mean = fitted._scaling.accelerations(twin(at).mean.numpy().T)
    np.testing.assert_allclose(
        fitted.predict(held), mean, rtol=0, atol=1e-8 * fitted._scaling.y_scale
    )


@pytest.mark.parametrize("optimizer", ["lbfgs", "newton"])
def test_the_mean_at_the_optimum_is_optimal(optimizer):
    X, y, _, _ = samples(noise=0.05)
    model = ExactGP(optimizer=optimizer).fit(X, y)
    best = model.nll_.copy()
    t = model._scaling.targets(y)
    for shift in (-1e-2, 1e-2):
        model._theta[3] += shift
        model._condition(t)
        assert np.all(model.nll_ > best)
        model._theta[3] -= shift


def test_unknown_optimizer():
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match=r'optimizer is "sgd"\. Allowed: adam, lbfgs, newton'):
        ExactGP(optimizer="sgd").fit(X, y)


@pytest.mark.parametrize("optimizer", ["adam", "lbfgs", "newton"])
def test_noise_of_single_samples_is_that_of_dense_algebra(tmp_path, optimizer):
    rng = np.random.default_rng(4)
    X = rng.normal(size=(30, 3))
    y = np.sin(X) + 0.0
    own = rng.uniform(0.0, 0.3, size=(30, 3))
    own[3] = 50.0
    y[3] += 40.0  # an outlier that says so itself
    gp = ExactGP(optimizer=optimizer).fit(X, y, NoiseLevel(samples=own))
    at = rng.normal(size=(5, 3))
    for i in range(3):
        length, amplitude, noise = gp.lengthscale_[i], gp.amplitude_[i], gp.noise_std_[i]

        def kernel(a, b, length=length, amplitude=amplitude):
            d2 = np.sum((a[:, None] - b[None]) ** 2, axis=2)
            return amplitude**2 * np.exp(-0.5 * d2 / length**2)

        K = kernel(X, X) + np.diag(noise**2 + own[:, i] ** 2)
        one = np.linalg.solve(K, np.ones(30))
        mean = one @ y[:, i] / one.sum()
        # Adam's mean is a parameter of its own; the others' is the most likely
        mean = gp._scaling.accelerations(gp._theta[3])[i] if optimizer == "adam" else mean
        wanted = mean + kernel(at, X) @ np.linalg.solve(K, y[:, i] - mean)
        np.testing.assert_allclose(gp.predict(at)[:, i], wanted, rtol=1e-6, atol=1e-8)
    gp.save(tmp_path / "gp.safetensors")
    np.testing.assert_array_equal(
        ExactGP.load(tmp_path / "gp.safetensors").predict(at), gp.predict(at)
    )
    with pytest.raises(ConfigError, match="noise of single samples in gpytorch"):
        gp.to_gpytorch()
    with pytest.raises(DataError, match="30 samples and their noise has 2"):
        gp.fit(X, y, NoiseLevel(samples=own[:2]))
