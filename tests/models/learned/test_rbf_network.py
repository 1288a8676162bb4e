import numpy as np
import pytest
from tests.models.learned.problem import fractional_error, samples

from unmodeled.core.errors import ConfigError
from unmodeled.models.learned.rbf_network import RBFNetwork


@pytest.fixture(scope="module")
def fitted():
    X, y, _, _ = samples()
    return RBFNetwork().fit(X, y)


def test_softmax_is_the_quotient_of_gaussians():
    X, y, held, _ = samples()
    model = RBFNetwork(centres=10, width_factor=1.0).fit(X, y)  # few and narrow: well conditioned

    def quotient(at):
        square = ((at[:, None] - model.centres_[None]) ** 2).sum(-1)
        gaussians = np.exp(-0.5 * square / model.width_**2)
        return gaussians / gaussians.sum(axis=1, keepdims=True)

    weights = np.linalg.lstsq(quotient(X), y, rcond=None)[0]
    np.testing.assert_allclose(model.predict(held), quotient(held) @ weights, rtol=1e-9)


def test_far_away_is_finite_where_the_quotient_is_not(fitted):
    far = 1e3 * np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [0.0, 0.0, -1.0]])
    square = ((far[:, None] - fitted.centres_[None]) ** 2).sum(-1)
    assert not np.exp(-0.5 * square / fitted.width_**2).any()  # 0/0 in the plain form
    assert np.isfinite(fitted.predict(far)).all()
    # one centre has all the weight, so the field is constant
    np.testing.assert_allclose(fitted.predict(far), fitted.predict(1.001 * far), rtol=1e-9)
    np.testing.assert_allclose(fitted.jacobian(far), 0.0, atol=1e-9)


def test_constant_field_is_reproduced_because_shares_sum_to_one():
    X, _, held, _ = samples()
    constant = np.tile([1.0, -2.0, 3.0], (len(X), 1))
    model = RBFNetwork(centres=7).fit(X, constant)
    np.testing.assert_allclose(model.predict(held), constant[: len(held)], atol=1e-12)


def test_interpolation(fitted):
    _, _, held, truth = samples()
    assert fractional_error(fitted.predict(held), truth) < 1e-3


def test_centres_are_distinct_samples_far_apart(fitted):
    X, _, _, _ = samples()
    distances = np.sqrt(((fitted.centres_[:, None] - X[None]) ** 2).sum(-1))
    assert distances.min(axis=1).max() < 1e-12
    between = np.sqrt(((fitted.centres_[:, None] - fitted.centres_[None]) ** 2).sum(-1))
    # farthest-point traversal: no sample is farther from the centres than they from each other
    assert distances.min(axis=0).max() <= between[np.triu_indices(60, 1)].min() + 1e-12


def test_fewer_distinct_samples_than_centres():
    X, y, _, _ = samples()
    few, values = np.repeat(X[:5], 4, axis=0), np.repeat(y[:5], 4, axis=0)
    model = RBFNetwork(width_factor=1.0).fit(few, values)
    assert model.facts()["centres"] == 5.0
    assert model.facts()["rank"] == 5.0
    np.testing.assert_allclose(model.predict(X[:5]), y[:5], atol=1e-9)


@pytest.mark.parametrize("key", ["centres", "width_factor", "rcond"])
def test_hyperparameters_out_of_range(key):
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match=f"rbf_network: {key} is 0. Allowed: > 0"):
        RBFNetwork(**{key: 0}).fit(X, y)
