import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.frames import body_fixed_from_inertial
from unmodeled.models.learned import InputFeatures
from unmodeled.models.learned.input_features import FEATURES

ALL = ("position", "velocity", "velocity_rtn", "sun_direction", "sun_cosine", "phase", "time")


def given(count=6):
    rng = np.random.default_rng(0)
    return {
        "positions": rng.normal(size=(count, 3)),
        "velocities": rng.normal(size=(count, 3)),
        "times": rng.uniform(0, 50, count),
        "sun_directions": 7.0 * rng.normal(size=(count, 3)),
    }


def test_columns_have_names_and_units():
    assert set(ALL) == set(FEATURES)
    features = InputFeatures(ALL, period=10.0)
    made = features.of(**given())
    assert made.shape == (6, len(features.columns)) == (6, len(features.units))
    assert len(set(features.columns)) == len(features.columns)
    assert set(features.units) == {"length", "time", "length/time", "1"}
    assert InputFeatures.from_dict(features.as_dict()) == features
    assert InputFeatures().of(given()["positions"]).shape == (6, 3)


def test_values_are_those_of_their_definitions():
    g = given()
    features = InputFeatures(ALL, period=10.0)
    columns = dict(zip(features.columns, features.of(**g).T, strict=True))
    x, v, sun = g["positions"], g["velocities"], g["sun_directions"]
    r = np.linalg.norm(x, axis=1)
    np.testing.assert_array_equal(columns["z"], x[:, 2])
    np.testing.assert_array_equal(columns["vy"], v[:, 1])
    radial = (x * v).sum(axis=1) / r
    np.testing.assert_allclose(columns["v_radial"], radial, rtol=1e-12)
    # what is left of the speed; the transverse component is positive by definition
    left = np.sqrt((v**2).sum(axis=1) - radial**2)
    np.testing.assert_allclose(columns["v_transverse"], left, rtol=1e-12)
    length = np.linalg.norm(sun, axis=1)
    np.testing.assert_allclose(columns["sun_x"], sun[:, 0] / length, rtol=1e-15)
    cosine = (x * sun).sum(axis=1) / (r * length)
    np.testing.assert_allclose(columns["sun_cosine"], cosine, rtol=1e-12)
    angle = 2 * np.pi * g["times"] / 10.0
    np.testing.assert_allclose(columns["phase_sin"], np.sin(angle), atol=1e-14)
    np.testing.assert_allclose(columns["phase_cos"], np.cos(angle), atol=1e-14)
    np.testing.assert_array_equal(columns["time"], g["times"])


def test_body_axes_turn_vectors_and_leave_scalars():
    g = given()
    axes = body_fixed_from_inertial(g["times"], 0.3, 0.1)
    features = InputFeatures(ALL, period=10.0)
    still = dict(zip(features.columns, features.of(**g).T, strict=True))
    turned = dict(zip(features.columns, features.of(**g, axes=axes).T, strict=True))
    for name in ("v_radial", "v_transverse", "sun_cosine", "phase_sin", "time"):
        np.testing.assert_array_equal(turned[name], still[name])
    for a in (("x", "y", "z"), ("vx", "vy", "vz"), ("sun_x", "sun_y", "sun_z")):
        before, after = (np.stack([d[c] for c in a], axis=1) for d in (still, turned))
        np.testing.assert_allclose(after, np.einsum("nij,nj->ni", axes, before), atol=1e-14)


def test_what_is_wrong_is_said():
    with pytest.raises(ConfigError, match=r'unknown input "sun_directoin".*"sun_direction"'):
        InputFeatures(("position", "sun_directoin"))
    with pytest.raises(ConfigError, match="position first, then the others"):
        InputFeatures(("velocity", "position"))
    with pytest.raises(ConfigError, match='input "time" is declared twice'):
        InputFeatures(("position", "time", "time"))
    with pytest.raises(ConfigError, match=r"phase with a period of None\. Allowed: a period > 0"):
        InputFeatures(("position", "phase"))
    with pytest.raises(ConfigError, match=r"period of 3 without the input phase"):
        InputFeatures(("position",), period=3)
    g = given()
    with pytest.raises(DataError, match=r"input velocity without velocities\. Give velocities too"):
        InputFeatures(("position", "velocity")).of(g["positions"])
    with pytest.raises(DataError, match=r"times has shape \(5,\)\. Allowed: shape \(6,\)"):
        InputFeatures(("position", "time")).of(g["positions"], times=g["times"][:5])
    g["sun_directions"][2] = 0.0
    with pytest.raises(DataError, match="sun_directions has length zero at sample 2"):
        InputFeatures(("position", "sun_cosine")).of(
            g["positions"], sun_directions=g["sun_directions"]
        )
