import numpy as np
import pytest

from unmodeled.core.errors import DataError
from unmodeled.core.units import NormalisedUnits
from unmodeled.models.learned import PointMassOnly
from unmodeled.pipeline.learned_field import LearnedField

GM, RADIUS = 4.89, 290.0


@pytest.fixture
def field():
    x = np.random.default_rng(0).normal(size=(10, 3)) + 2.0
    learner = PointMassOnly().fit(x, x)
    return LearnedField(learner, NormalisedUnits.of_body(GM, RADIUS))


def test_the_field_is_in_si(field):
    """A point mass in normalised units is the body's point mass in SI."""
    r = np.array([[500.0, -200.0, 300.0]])
    expected = -GM * r / np.linalg.norm(r) ** 3
    np.testing.assert_allclose(field.acceleration(r), expected, rtol=1e-13)


def test_jacobian_is_in_si(field):
    r = np.array([[500.0, -200.0, 300.0]])
    step = 0.1  # m; truncation of the central difference is (step / r)^2 = 3e-8
    columns = [
        (field.acceleration(r + step * e) - field.acceleration(r - step * e))[0] / (2 * step)
        for e in np.eye(3)
    ]
    jacobian = field.jacobian(r)[0]
    np.testing.assert_allclose(jacobian, np.stack(columns, axis=1), atol=1e-7 * GM / 616.0**3)


def test_save_and_load_keep_units(field, tmp_path):
    path = tmp_path / "f.safetensors"
    field.save(path)
    back = LearnedField.load(path)
    assert back.units == field.units
    assert back.frame == "inertial"
    r = np.array([[500.0, -200.0, 300.0]])
    assert np.array_equal(back.acceleration(r), field.acceleration(r))


def test_a_learner_without_units_is_refused(field, tmp_path):
    path = tmp_path / "f.safetensors"
    field.learner.save(path)
    with pytest.raises(DataError, match="holds a learner without units"):
        LearnedField.load(path)
