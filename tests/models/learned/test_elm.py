import numpy as np
import pytest
from tests.models.learned.problem import (
    GM,
    acceleration,
    finite_difference_jacobian,
    fractional_error,
    orbit,
    samples,
)

from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.models.learned import ELM, NoiseLevel, load_learner


def design(model, X):
    """Hidden values with the constant, from the fitted numbers, by another route than the model."""
    x = (X - model._scaling.x_mean) / model._scaling.x_scale
    return np.column_stack([np.ones(len(x)), np.tanh(x @ model._hidden.T + model._offset)])


def ridge_by_normal_equations(model, X, y, weight=1.0):
    """Predictor of the penalised least squares with the model's nodes, scale and ridge."""
    H = design(model, X) * np.reshape(weight, (-1, 1))
    t = model._scaling.targets(y) * np.reshape(weight, (-1, 1))
    q = H[:, :1] / np.linalg.norm(H[:, 0])
    top = np.linalg.norm(H[:, 1:] - q @ (q.T @ H[:, 1:]), 2) ** 2
    penalty = model.ridge_ * top * np.diag([0.0] + [1.0] * (H.shape[1] - 1))
    solution = np.linalg.solve(H.T @ H + penalty, H.T @ t)
    return lambda at: model._scaling.accelerations(design(model, at) @ solution)


def test_weights_are_those_of_ridge_regression():
    X, y, held, _ = samples(noise=0.1)
    model = ELM(nodes=60).fit(X, y)
    wanted = ridge_by_normal_equations(model, X, y)(held)
    # condition 1 / ridge of 1e6 in the normal equations: 1e-10 of 40
    np.testing.assert_allclose(model.predict(held), wanted, rtol=0, atol=1e-7)


def test_the_ridge_minimises_generalised_cross_validation():
    """By the hat matrix, written out."""
    X, y, _, _ = samples(noise=0.1)
    model = ELM(nodes=40).fit(X, y)
    t, n = model._scaling.targets(y), len(X)
    H = design(model, X)[:, 1:]
    H, t = H - H.mean(axis=0), t - t.mean(axis=0)
    top = np.linalg.norm(H, 2) ** 2

    def score(ridge):
        hat = H @ np.linalg.solve(H.T @ H + ridge * top * np.eye(H.shape[1]), H.T)
        return n * ((t - hat @ t) ** 2).sum() / (n - 1 - np.trace(hat)) ** 2

    best = score(model.ridge_)
    assert all(score(model.ridge_ * f) >= best for f in (0.1, 0.5, 2.0, 10.0))
    hat = H @ np.linalg.solve(H.T @ H + model.ridge_ * top * np.eye(H.shape[1]), H.T)
    assert model.freedom_ == pytest.approx(1 + np.trace(hat), rel=1e-6)


@pytest.mark.parametrize("noise", [None, NoiseLevel(acceleration=0.1)])
def test_sequential_updates_are_the_batch_solution(noise):
    X, y, held, _ = samples(noise=0.1)
    cuts = [slice(0, 80), slice(80, 81), slice(81, 200), slice(200, None)]
    model = ELM(nodes=60).fit(X[cuts[0]], y[cuts[0]], noise)
    for cut in cuts[1:]:
        assert model.update(X[cut], y[cut], noise) is model
    assert model.n_samples_ == len(X)
    wanted = ridge_by_normal_equations(model, X, y)(held)
    np.testing.assert_allclose(model.predict(held), wanted, rtol=0, atol=1e-7)
    # and the ridge too is that of all samples: one block, same scale, same nodes
    batch = ELM(nodes=60).fit(X[cuts[0]], y[cuts[0]], noise)
    batch.update(X[80:], y[80:], noise)
    assert batch.ridge_ == model.ridge_
    np.testing.assert_allclose(model.predict(held), batch.predict(held), rtol=0, atol=1e-8)


def test_sequential_updates_of_samples_with_own_noise_are_the_batch_solution():
    X, y, held, _ = samples(noise=0.1)
    own = np.random.default_rng(1).uniform(0.05, 1.0, size=y.shape)
    model = ELM(nodes=60).fit(X[:100], y[:100], NoiseLevel(samples=own[:100]))
    model.update(X[100:], y[100:], NoiseLevel(samples=own[100:]))
    size = np.sqrt((own**2).mean(axis=1))
    wanted = ridge_by_normal_equations(model, X, y, size[:100].min() / size)(held)
    np.testing.assert_allclose(model.predict(held), wanted, rtol=0, atol=1e-7)


def test_updates_do_not_diverge_with_the_number_of_samples():
    """GravNN's sequential ELM goes from 0.34 to 7.0 in this setting (GRAVITY.md 3.2)."""
    rng = np.random.default_rng(4)
    X = rng.normal(size=(5000, 3))
    X *= (rng.uniform(1.0, 10.0, 5000) / np.linalg.norm(X, axis=1))[:, None]
    y = -GM * X / np.linalg.norm(X, axis=1, keepdims=True) ** 3
    model = ELM(nodes=200).fit(X[:1000], y[:1000])
    first = fractional_error(model.predict(X), y)
    for k in range(1000, 5000, 1000):
        model.update(X[k : k + 1000], y[k : k + 1000])
    batch = ELM(nodes=200).fit(X, y)
    assert fractional_error(model.predict(X), y) < 1.1 * first
    assert fractional_error(model.predict(X), y) < 1.5 * fractional_error(batch.predict(X), y)


def test_an_update_after_loading_goes_on(tmp_path):
    X, y, held, _ = samples(noise=0.1)
    model = ELM(nodes=30).fit(X[:100], y[:100])
    model.save(tmp_path / "elm.safetensors")
    back = load_learner(tmp_path / "elm.safetensors")
    back.update(X[100:], y[100:])
    model.update(X[100:], y[100:])
    assert np.array_equal(back.predict(held), model.predict(held))


def test_updates_are_refused_with_a_reason():
    X, y, _, _ = samples()
    with pytest.raises(InputError, match="elm is not fitted"):
        ELM().update(X, y)
    plain, noisy = ELM(nodes=20).fit(X, y), ELM(nodes=20).fit(X, y, NoiseLevel(acceleration=0.1))
    with pytest.raises(InputError, match="new samples is known, that of the first ones is not"):
        plain.update(X, y, NoiseLevel(acceleration=0.1))
    with pytest.raises(InputError, match=r"new samples is not known.*to both fit and update"):
        noisy.update(X, y)
    with pytest.raises(DataError, match="X has 238 samples and y has 3"):
        plain.update(X, y[:3])


def test_position_noise_weighs_the_samples():
    """On eccentric orbits, whose gradients at apoapsis and periapsis differ forty times."""
    X = orbit(2.6, 0.55, 60.0, 0.0)
    truth = acceleration(X)
    errors = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        seen = X + 0.02 * rng.normal(size=X.shape)
        y = acceleration(X + 0.02 * rng.normal(size=X.shape))
        models = [
            ELM(position_noise=p, random_state=seed).fit(seen, y, NoiseLevel(position=0.02))
            for p in (False, True)
        ]
        errors.append([fractional_error(m.predict(X), truth) for m in models])
    plain, aware = np.median(errors, axis=0)
    assert aware < 0.8 * plain


def test_jacobian_is_the_slope_of_the_prediction_with_a_fixed_ridge():
    X, y, held, _ = samples(noise=0.1)
    model = ELM(ridge=1e-4).fit(X, y)
    assert model.ridge_ == 1e-4
    slopes = finite_difference_jacobian(model.predict, held)
    # truncation step^2 = 1e-10 times third derivatives, rounding 1e-16 * 40 / 1e-5
    np.testing.assert_allclose(model.jacobian(held), slopes, rtol=0, atol=1e-7)


def test_bad_hyperparameters():
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match=r"elm: nodes is 0\. Allowed: > 0"):
        ELM(nodes=0).fit(X, y)
    with pytest.raises(ConfigError, match=r"elm: ridge is -1\. Allowed: a number >= 0"):
        ELM(ridge=-1).fit(X, y)
