import math

import numpy as np
import pytest
from tests.models.learned.problem import (
    GM,
    acceleration,
    finite_difference_jacobian,
    fractional_error,
    other_orbit,
    samples,
)

from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.models.learned import PointMassOnly, load_learner
from unmodeled.models.physics import Dynamics, PointMass


def fitted(gm=GM):
    return PointMassOnly(gm).fit(*samples()[:2])


def test_it_is_the_physics_point_mass():
    X = other_orbit()[0]
    expected = Dynamics([PointMass()], {"GM": GM})
    # a few roundings
    np.testing.assert_allclose(fitted().predict(X), expected.acceleration(X), rtol=1e-14)
    np.testing.assert_allclose(
        fitted().jacobian(X), expected.state_partials(X)[:, :, :3], rtol=0, atol=1e-13 * GM
    )


def test_it_learns_nothing():
    X, y, held, _ = samples()
    assert np.array_equal(
        PointMassOnly().fit(X, 7 * y).predict(held), PointMassOnly().fit(X, y).predict(held)
    )
    assert not fitted().has_covariance


def test_it_misses_the_flattening_only():
    # Leading term: 3/2 J2 / r^2 of the attraction at most, at the lowest radius of the orbit
    X, _ = other_orbit()
    error = fractional_error(fitted().predict(X), acceleration(X))
    assert 1e-4 < error < 3 * 1.93e-2 / np.linalg.norm(X, axis=1).min() ** 2


def test_jacobian_against_differences():
    held = samples()[2]
    slopes = finite_difference_jacobian(fitted().predict, held, 1e-4)
    # truncation: step^2 / 6 times a third derivative of up to 60 gm / r^5
    np.testing.assert_allclose(fitted().jacobian(held), slopes, rtol=0, atol=1e-7 * GM)


def test_file(tmp_path):
    path = tmp_path / "a.safetensors"
    fitted(3.0).save(path)
    back = load_learner(path)
    assert repr(back) == "PointMassOnly(gm=3.0)"
    assert np.array_equal(back.predict(samples()[2]), fitted(3.0).predict(samples()[2]))


@pytest.mark.parametrize("gm", [0.0, -1.0, math.nan, math.inf])
def test_bad_gm(gm):
    with pytest.raises(ConfigError) as caught:
        fitted(gm)
    assert str(caught.value) == f"point_mass: gm is {gm}. Allowed: a number > 0."


def test_origin():
    X = np.array([[1.0, 0, 0], [0, 0, 0]])
    for call in (fitted().predict, fitted().jacobian):
        with pytest.raises(DataError) as caught:
            call(X)
        assert str(caught.value) == (
            "position 1 is the origin, where a point mass has no acceleration. "
            "Allowed: positions away from the origin."
        )


def test_not_fitted():
    with pytest.raises(InputError, match="point_mass is not fitted"):
        PointMassOnly().predict(np.ones((1, 3)))
