import numpy as np
import pytest
from tests.models.learned.problem import fractional_error, samples

from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned import MLP, NoiseLevel, Residual
from unmodeled.models.learned._plain_training import outputs, train
from unmodeled.models.learned.mlp import _factor

QUICK = {"epochs": 300, "learning_rate": 1e-2}


def test_the_default_is_the_network_of_the_paper():
    X, y, _, _ = samples()
    state = np.column_stack([X, X[:, ::-1]])  # six inputs
    facts = MLP(epochs=5).fit(state, y).facts()
    # [Fereoli2024] Table II has three hidden layers of ten; its text counts 433 numbers, which are
    # those of four
    assert facts["weights"] == 6 * 10 + 10 + 2 * (10 * 10 + 10) + 10 * 3 + 3
    assert MLP(epochs=5, layers=4).fit(state, y).facts()["weights"] == 433


@pytest.mark.parametrize("activation", ["relu", "tanh"])
@pytest.mark.parametrize("weighted", [False, True])
def test_a_step_goes_down_the_slope_of_the_loss(activation, weighted):
    """Adam's first step moves each number by the rate against the sign of its slope."""
    rng = np.random.default_rng(0)
    x, t = rng.normal(size=(40, 3)), rng.normal(size=(40, 3))
    white = rng.normal(size=(40, 3, 3)) if weighted else None
    data = (x, t, white)
    start, end = (
        train([3, 6, 6, 3], [[4]], data, data, activation, epochs, 1e-6, lambda share: None)
        for epochs in (0, 1)
    )

    def loss(weights, biases):
        misfit = outputs(weights, biases, x, activation)[-1][0] - t
        return np.mean((misfit if white is None else (white @ misfit[..., None])[..., 0]) ** 2)

    slopes, steps = [], []
    for k in range(3):
        for i in range(start.weights[k].shape[1]):
            up = [w.copy() for w in start.weights]
            up[k][0, i, 0] += 1e-6
            down = [w.copy() for w in start.weights]
            down[k][0, i, 0] -= 1e-6
            slopes.append((loss(up, start.biases) - loss(down, start.biases)) / 2e-6)
            steps.append(end.weights[k][0, i, 0] - start.weights[k][0, i, 0])
    slopes, steps = np.array(slopes), np.array(steps)
    clear = np.abs(slopes) > 1e-6
    assert clear.sum() > 8
    np.testing.assert_allclose(steps[clear], -1e-6 * np.sign(slopes[clear]), rtol=1e-2)


def test_the_weights_of_the_best_epoch_on_the_held_out_fifth_are_kept():
    X, y, _, _ = samples(noise=1.0)
    fifth = np.random.default_rng([0, 0]).permutation(len(X))[:48]
    errors = []
    for epochs in (20, 300, 1500):
        model = Residual(MLP(epochs=epochs, learning_rate=1e-2, width=40)).fit(X, y).learner_
        rest = Residual(MLP())._rest(X, y)[fifth]
        misfit = rest - model.predict(X[fifth])
        share = np.abs(misfit).sum() / np.abs(rest).sum()  # [Fereoli2024] Eq. 31
        assert np.isclose(model.validation_error_, share)
        assert model.best_epoch_ <= epochs
        errors.append(float((misfit**2).mean()))
    assert errors[0] >= errors[1] >= errors[2]  # more epochs only add candidates


def test_ensemble_mean_spread_and_factor():
    X, y, held, _ = samples()
    model = MLP(members=3, **QUICK).fit(X, y)
    members = []
    for k in range(3):
        one = (
            [w[k : k + 1] for w in model._found.weights],
            [b[k : k + 1] for b in model._found.biases],
        )
        out = outputs(*one, model._scaling.positions(held), "relu")[-1][0]
        members.append(model._scaling.accelerations(out))
    np.testing.assert_allclose(model.predict(held), np.mean(members, axis=0), rtol=1e-12)
    variance = model.spread_factor_ * np.var(members, axis=0, ddof=1).mean(axis=1)
    np.testing.assert_allclose(model.predict_covariance(held), variance[:, None, None] * np.eye(3))
    assert not MLP().has_covariance


def test_factor_of_the_band_finds_what_was_put_in():
    rng = np.random.default_rng(2)
    spread, known = rng.uniform(1, 4, 4000), rng.uniform(0, 2, (4000, 3))
    misfit = np.sqrt(9.0 * spread[:, None] + known) * rng.normal(size=(4000, 3))
    # the grid has steps of 12 %; the quantile of 12000 draws is good to 2 %
    assert 9.0 / 1.15 < _factor(misfit, spread, known) < 9.0 * 1.2
    assert _factor(0 * misfit, spread, known) == 1.0  # never below the spread itself


def test_band_between_the_samples_holds_what_it_says():
    X, y, held, truth = samples(noise=0.1)
    model = Residual(MLP(members=5, **QUICK)).fit(X, y, NoiseLevel(acceleration=0.1))
    sigma = np.sqrt(np.diagonal(model.predict_covariance(held), axis1=1, axis2=2))
    inside = np.abs(model.predict(held) - truth) < 1.96 * sigma
    assert inside.mean() > 0.6
    assert fractional_error(model.predict(held), truth) < 2e-2


def test_bad_hyperparameters_are_refused():
    X, y, _, _ = samples()
    with pytest.raises(
        ConfigError, match=r"validation is 1\.0\. Allowed: more than 0, less than 1"
    ):
        MLP(validation=1.0).fit(X, y)
    with pytest.raises(ConfigError, match=r'activation is "sine"\. Allowed: relu, tanh'):
        MLP(activation="sine").fit(X, y)
    with pytest.raises(ConfigError, match=r"members is 0\. Allowed: > 0"):
        MLP(members=0).fit(X, y)
    with pytest.raises(NumericalError, match=r"not finite\. Lower learning_rate"):
        MLP(epochs=30, learning_rate=1e300).fit(X, y)
