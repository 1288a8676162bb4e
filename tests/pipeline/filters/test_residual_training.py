"""Training of the network of [Fereoli2024]: axes that do not vary, and the curve of Fig. 10."""

import numpy as np
import pytest

from unmodeled.core.errors import DataError
from unmodeled.pipeline.filters.residual_network import relative_percent, train_residual_network


def samples(count=200):
    x = np.random.default_rng(1).normal(size=(count, 6))
    y = 1e-2 * np.stack([1.0 + 0.2 * x[:, 0], x[:, 1], np.zeros(count)], axis=1)
    return x, y


def test_an_axis_that_does_not_vary_is_answered_with_its_value():
    """An untrained output of size one there would be a hundred times the labels elsewhere."""
    x, y = samples()
    y[:, 2] = 3e-4
    network = train_residual_network(x, y, epochs=300, learning_rate=1e-2)
    said, slope, _ = network.evaluate(x, 0.0)
    np.testing.assert_allclose(said[:, 2], 3e-4, rtol=1e-13)  # rounding of a mean
    assert not slope[:, 2].any()
    assert network.validation_percent < 20.0
    y[:] = 1e-3
    with pytest.raises(DataError, match=r"no label varies\..*Train on estimates"):
        train_residual_network(x, y, epochs=1)


def test_the_curve_ends_where_the_network_is():
    x, y = samples()
    told = []
    network = train_residual_network(x, y, epochs=40, checks=5, tell=told.append)
    assert network.validation[0, 0] == 1.0
    assert network.validation[-1, 0] == 40.0
    assert network.validation[-1, 1] == pytest.approx(network.validation_percent, rel=1e-12)
    assert told[-1] == 1.0
    assert relative_percent(y, y) == 0.0
    assert len(train_residual_network(x, y, epochs=3).validation) == 0
