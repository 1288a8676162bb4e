import numpy as np
import pytest
from tests.models.learned.problem import samples

from unmodeled.core.errors import DataError
from unmodeled.models.learned.scaling import Standardiser


def test_scaled_samples_have_mean_zero_and_common_variance_one():
    X, y, _, _ = samples()
    scaling = Standardiser.of(X, y)
    for scaled in (scaling.positions(X), scaling.targets(y)):
        np.testing.assert_allclose(scaled.mean(axis=0), 0.0, atol=1e-13)
        assert np.mean(scaled**2) == pytest.approx(1.0, rel=1e-13)


def test_targets_and_accelerations_undo_each_other():
    X, y, _, _ = samples()
    scaling = Standardiser.of(X, y)
    np.testing.assert_allclose(scaling.accelerations(scaling.targets(y)), y, rtol=0, atol=1e-13)


def test_scales_do_not_depend_on_the_frame():
    X, y, _, _ = samples()
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turned = Standardiser.of(X @ rotation.T, y @ rotation.T)
    straight = Standardiser.of(X, y)
    assert turned.x_scale == pytest.approx(straight.x_scale, rel=1e-13)
    assert turned.slope == pytest.approx(straight.slope, rel=1e-13)


def test_equatorial_orbit_and_constant_field_stay_finite():
    X, y, _, _ = samples()
    flat = X * [1.0, 1.0, 0.0]
    scaling = Standardiser.of(flat, y * [1.0, 1.0, 0.0])
    assert np.isfinite(scaling.positions(flat)).all()
    constant = Standardiser.of(X, np.full_like(y, 0.1))
    assert constant.y_scale == 1.0
    np.testing.assert_allclose(constant.targets(np.full_like(y, 0.1)), 0.0, atol=1e-15)


def test_one_repeated_position_is_refused():
    X = np.tile([1.0, 2.0, 3.0], (5, 1))
    with pytest.raises(DataError, match="all 5 training positions are the same point"):
        Standardiser.of(X, np.ones((5, 3)))


def test_restore_gives_the_same_object():
    X, y, _, _ = samples()
    scaling = Standardiser.of(X, y)
    back = Standardiser.restore(scaling.arrays())
    assert np.array_equal(back.positions(X), scaling.positions(X))
    assert np.array_equal(back.accelerations(y), scaling.accelerations(y))
