import numpy as np
from tests.models.learned.problem import samples

from unmodeled.models.learned.nearest_neighbour import NearestNeighbour


def test_prediction_is_the_sample_of_least_distance():
    X, y, held, _ = samples()
    nearest = np.argmin(((held[:, None] - X[None]) ** 2).sum(-1), axis=1)
    model = NearestNeighbour().fit(X, y)
    assert np.array_equal(model.predict(held), y[nearest])
    assert np.array_equal(model.predict(X), y)


def test_later_changes_of_the_callers_arrays_do_not_reach_the_model():
    X, y, _, _ = samples()
    at, before = X.copy(), y.copy()
    model = NearestNeighbour().fit(X, y)
    X[:], y[:] = 0.0, 0.0
    assert np.array_equal(model.predict(at), before)


def test_jacobian_is_zero():
    X, y, held, _ = samples()
    assert not NearestNeighbour().fit(X, y).jacobian(held).any()
