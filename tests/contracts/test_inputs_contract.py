"""Inputs beyond the position: general learners take them, gravity fields refuse."""

import numpy as np
import pytest
from tests.contracts.learner_factories import LEARNER_FACTORIES

from unmodeled.core.errors import DataError
from unmodeled.models.learned import NoiseLevel, fit_batch, load_learner

pytestmark = pytest.mark.parametrize("key", LEARNER_FACTORIES)

TAKERS = {
    key
    for key in LEARNER_FACTORIES
    if key.split("(")[0]
    in (
        *("exact_gp", "sparse_gp", "elm", "rbf_network"),
        *("mlp", "spectral_mlp", "nearest_neighbour"),
    )
} | {key for key in LEARNER_FACTORIES if key.startswith("residual(")}


def field(X):
    """Smooth, and dependent on the fourth input most; the fifth has another unit."""
    slow = np.sin(X[:, :3]) + np.cos(X[:, 3:4] * [1.0, 2.0, 3.0])
    return slow + 1e-3 * X[:, 4:] * [1.0, 0.0, -1.0]


def inputs(count=150, seed=1):
    rng = np.random.default_rng(seed)
    X = rng.uniform(1.0, 2.0, size=(count, 5)) * [1, 1, 1, 1.5, 1e3]
    return X, field(X)


def fitted(key):
    X, y = inputs()
    # noise, so that weights stay small and finite differences true
    return LEARNER_FACTORIES[key].make().fit(X, y, NoiseLevel(position=1e-4, acceleration=1e-3))


def test_who_takes_them(key):
    learner = LEARNER_FACTORIES[key].make()
    assert learner.takes_features == (key in TAKERS)
    if key in TAKERS:
        return
    X, y = inputs()
    text = (
        r"X has shape \(150, 5\), and \w+ learns from the position alone\. Allowed: shape \(n, 3\)"
    )
    with pytest.raises(DataError, match=text + r"\. Use a general learner, e\.g\. exact_gp or elm"):
        learner.fit(X, y)


def test_jacobian_files_and_batches(key, tmp_path):
    if key not in TAKERS:
        pytest.skip("learns from the position alone")
    learner = fitted(key)
    held, _ = inputs(30, 2)
    jacobian = learner.jacobian(held)
    assert jacobian.shape == (30, 3, 5)
    assert learner.jacobian(held[:0]).shape == (0, 3, 5)
    slopes = np.empty_like(jacobian)
    for j, step in enumerate([1e-5, 1e-5, 1e-5, 1e-5, 1e-2]):
        move = step * np.eye(5)[j]
        slopes[:, :, j] = (learner.predict(held + move) - learner.predict(held - move)) / (2 * step)
    # the fifth input in units of a thousand, so that all columns are of one size
    size = np.array([1, 1, 1, 1, 1e3])
    largest = np.abs(slopes * size).max()
    if LEARNER_FACTORIES[key].continuous:
        np.testing.assert_allclose(jacobian * size, slopes * size, rtol=0, atol=1e-5 * largest)
    learner.save(tmp_path / "learner.safetensors")
    back = load_learner(tmp_path / "learner.safetensors")
    assert back.n_inputs_ == 5
    assert np.array_equal(back.predict(held), learner.predict(held))
    with pytest.raises(DataError, match=r"X has shape \(30, 3\)\. Allowed: shape \(n, 5\)"):
        back.predict(held[:, :3])
    X, y = inputs()
    noise = NoiseLevel(position=1e-4, acceleration=1e-3)
    (member,) = fit_batch(LEARNER_FACTORIES[key].make(), [X], [y], [noise])
    assert np.array_equal(member.predict(held), learner.predict(held))
    assert member.n_inputs_ == 5


def test_they_are_used(key):
    if key not in TAKERS:
        pytest.skip("learns from the position alone")
    held, truth = inputs(30, 2)
    X, y = inputs()
    with_them = np.mean((fitted(key).predict(held) - truth) ** 2)
    alone = LEARNER_FACTORIES[key].make().fit(X[:, :3], y, NoiseLevel(acceleration=1.0))
    assert with_them < 0.7 * np.mean((alone.predict(held[:, :3]) - truth) ** 2)
