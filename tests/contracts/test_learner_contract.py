"""What every learner must do; the learners are listed in `learner_factories`."""

import errno
import inspect
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch
from tests.contracts.learner_factories import LEARNER_FACTORIES
from tests.models.learned.problem import finite_difference_jacobian, samples

from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.models.learned.learner import (
    NoiseLevel,
    learner_class,
    learner_names,
    load_learner,
)

pytestmark = pytest.mark.parametrize("key", LEARNER_FACTORIES)

_FITTED = {}


def fitted(key):
    if key not in _FITTED:
        X, y, _, _ = samples()
        _FITTED[key] = LEARNER_FACTORIES[key].make().fit(X, y)
    return _FITTED[key]


def test_name_is_registered_and_init_only_stores(key):
    learner = LEARNER_FACTORIES[key].make()
    assert learner.name in learner_names()
    assert learner_class(learner.name) is type(learner)
    parameters = inspect.signature(type(learner)).parameters
    sentinels = {name: getattr(learner, name) for name in parameters}
    again = type(learner)(**sentinels)
    assert all(again.get_params()[name] is value for name, value in sentinels.items())
    assert not [name for name in vars(again) if name.endswith("_")]


def test_fit_returns_self_and_leaves_parameters_and_data_alone(key):
    X, y, _, _ = samples()
    X.flags.writeable = y.flags.writeable = False
    learner = LEARNER_FACTORIES[key].make()
    before = repr(learner)
    assert learner.fit(X, y) is learner
    assert repr(learner) == before
    assert learner.n_samples_ == len(X)


def test_shapes_and_dtypes(key):
    learner = fitted(key)
    for n in (0, 1, 7):
        X = samples()[2][:n]
        assert learner.predict(X).shape == (n, 3)
        assert learner.jacobian(X).shape == (n, 3, 3)
        assert learner.predict(X).dtype == learner.jacobian(X).dtype == np.float64
    integers = learner.predict([[2, 0, 1]])
    assert integers.dtype == np.float64


def test_covariance_is_symmetric_and_positive_or_refused(key):
    learner, away = fitted(key), LEARNER_FACTORIES[key].uncertain_at * np.eye(3)
    X = np.concatenate([samples()[2], samples()[0][:20], away])
    if not learner.has_covariance:
        with pytest.raises(InputError, match="gives no covariance"):
            learner.predict_covariance(X)
        return
    covariance = learner.predict_covariance(X)
    assert covariance.shape == (len(X), 3, 3)
    assert covariance.dtype == np.float64
    assert np.array_equal(covariance, np.swapaxes(covariance, 1, 2))
    assert (np.linalg.eigvalsh(covariance) >= 0.0).all()
    # uncertainty grows away from the samples
    assert np.trace(covariance[-1]) > np.trace(covariance[0])


def test_bad_data_are_refused_with_a_reason(key):
    X, y, _, _ = samples()
    make = LEARNER_FACTORIES[key].make
    with pytest.raises(DataError, match=r"X has shape \(238, 2\). Allowed: shape \(n, 3\)"):
        make().fit(X[:, :2], y)
    with pytest.raises(DataError, match=r"y has shape \(238,\). Allowed: shape \(n, 3\)"):
        make().fit(X, y[:, 0])
    with pytest.raises(DataError, match="X has 238 samples and y has 237"):
        make().fit(X, y[:-1])
    broken = y.copy()
    broken[5, 1] = np.nan
    with pytest.raises(DataError, match=r"y has 1 value\(s\) that are not finite.*\(5, 1\)"):
        make().fit(X, broken)
    few = make().min_samples - 1
    with pytest.raises(DataError, match=f"was given {few} training samples. Allowed: at least"):
        make().fit(X[:few], y[:few])
    for method in ("predict", "jacobian"):
        with pytest.raises(DataError, match="X has 3 value"):
            getattr(fitted(key), method)(np.full((1, 3), np.inf))


def test_fewest_samples_are_enough(key):
    X, y, held, _ = samples()
    learner = LEARNER_FACTORIES[key].make()
    few = slice(0, 3 * learner.min_samples, 3)
    learner.fit(X[few], y[few])
    assert np.isfinite(learner.predict(held)).all()


def test_not_fitted(key, tmp_path):
    learner = LEARNER_FACTORIES[key].make()
    for call in (
        lambda: learner.predict(np.zeros((1, 3))),
        lambda: learner.jacobian(np.zeros((1, 3))),
        lambda: learner.save(tmp_path / "x.safetensors"),
    ):
        with pytest.raises(InputError, match=r"is not fitted. Call fit\(X, y\) first"):
            call()


def test_jacobian_is_the_slope_of_the_prediction(key):
    learner = fitted(key)
    X = samples()[2]
    if not LEARNER_FACTORIES[key].continuous:
        X = samples()[0][:30] + 1e-3  # off the faces between cells
    step = 1e-5
    slopes = finite_difference_jacobian(learner.predict, X, step)
    # truncation is of order step^2 = 1e-10, rounding of 1e-16 * 1e4 (weights) / step = 1e-7
    size = np.abs(slopes).max()
    np.testing.assert_allclose(learner.jacobian(X), slopes, rtol=0, atol=1e-6 * size)


def test_a_file_gives_the_same_predictions_bit_by_bit(key, tmp_path):
    learner, path = fitted(key), tmp_path / "learner.safetensors"
    learner.save(path)
    X = samples()[2]
    for back in (load_learner(path), type(learner).load(path)):
        assert type(back) is type(learner)
        assert repr(back) == repr(learner)
        assert back.n_samples_ == learner.n_samples_
        assert np.array_equal(back.predict(X), learner.predict(X))
        assert np.array_equal(back.jacobian(X), learner.jacobian(X))
        assert back.facts() == learner.facts()
        if learner.has_covariance:
            assert np.array_equal(back.predict_covariance(X), learner.predict_covariance(X))


def test_a_file_holds_numbers_and_text_only(key, tmp_path):
    path = tmp_path / "learner.safetensors"
    fitted(key).save(path)
    content = path.read_bytes()
    length = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + length])
    metadata = header.pop("__metadata__")
    assert json.loads(metadata["unmodeled"])["name"] == fitted(key).name
    assert {entry["dtype"] for entry in header.values()} == {"F64"}
    # the numbers fill the rest to the last byte: nothing else can hide there
    ends = sorted(tuple(entry["data_offsets"]) for entry in header.values())
    assert ends[0][0] == 0
    assert all(a[1] == b[0] for a, b in pairwise(ends))
    assert 8 + length + ends[-1][1] == len(content)


def test_bad_files_are_refused_with_a_reason(key, tmp_path):
    path = tmp_path / "learner.safetensors"
    fitted(key).save(path)
    content = path.read_bytes()
    for size in (0, 4, 100, len(content) - 8):
        path.write_bytes(content[:size])
        with pytest.raises(DataError, match=r"cannot be read as a saved learner.*Train again"):
            load_learner(path)
    path.write_text("not a learner", encoding="utf-8")
    with pytest.raises(DataError, match="cannot be read as a saved learner"):
        load_learner(path)
    with pytest.raises(DataError, match=r"no file .*missing"):
        load_learner(tmp_path / "missing")


def test_file_of_another_kind_of_learner(key, tmp_path):
    path = tmp_path / "learner.safetensors"
    fitted(key).save(path)
    other = next(n for n in learner_names() if n != fitted(key).name)
    with pytest.raises(DataError, match=f"holds a learner named {fitted(key).name}"):
        learner_class(other).load(path)


def test_same_data_same_seed_same_predictions(key):
    X, y, held, _ = samples()
    again = LEARNER_FACTORIES[key].make().fit(X, y)
    assert np.array_equal(again.predict(held), fitted(key).predict(held))
    # a second fit forgets the first
    again.fit(X[::2], y[::2])
    again.fit(X, y)
    assert np.array_equal(again.predict(held), fitted(key).predict(held))


def test_a_prediction_does_not_depend_on_its_batch(key):
    learner = fitted(key)
    X = np.concatenate([samples()[0], samples()[2], 1.1 * samples()[0]])  # more than one chunk
    together, size = learner.predict(X), np.abs(samples()[1]).max()
    slopes = learner.jacobian(X)
    for k in (0, 3, 237, 300, len(X) - 1):
        np.testing.assert_allclose(learner.predict(X[k : k + 1])[0], together[k], atol=1e-12 * size)
        alone = learner.jacobian(X[k : k + 1])[0]
        np.testing.assert_allclose(alone, slopes[k], atol=1e-12 * np.abs(slopes).max())


def test_global_random_state_and_dtype_are_left_alone(key):
    X, y, _, _ = samples()
    torch_state, numpy_state = torch.get_rng_state(), np.random.get_state()[1].copy()  # noqa: NPY002
    LEARNER_FACTORIES[key].make().fit(X[:50], y[:50])
    assert torch.equal(torch.get_rng_state(), torch_state)
    assert np.array_equal(np.random.get_state()[1], numpy_state)  # noqa: NPY002
    assert torch.get_default_dtype() == torch.float32


def test_it_learns(key):
    _, y, held, truth = samples()
    error = np.sqrt(np.mean((fitted(key).predict(held) - truth) ** 2))
    trivial = np.sqrt(np.mean((y.mean(axis=0) - truth) ** 2))
    assert error < LEARNER_FACTORIES[key].score * trivial


def test_noise_level_is_accepted_and_progress_ends_at_one(key):
    X, y, held, _ = samples(noise=0.05)
    told = []
    learner = LEARNER_FACTORIES[key].make()
    learner.fit(X, y, NoiseLevel(position=0.01, acceleration=0.05), progress=told.append)
    assert np.isfinite(learner.predict(held)).all()
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_facts_are_plain_and_finite(key):
    facts = fitted(key).facts()
    assert all(type(v) in (float, str) for v in facts.values())
    assert all(np.isfinite(v) for v in facts.values() if isinstance(v, float))


def test_unknown_name_suggests_the_nearest(key):
    name = LEARNER_FACTORIES[key].make().name
    with pytest.raises(ConfigError, match=f'Did you mean "{name}"'):
        learner_class(name[:-1])


def test_a_full_disk_is_the_systems_own_error(key):
    """The command line turns it into one sentence; a library's wrapper would hide the cause."""
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full to write to")
    with pytest.raises(OSError, match="No space left on device") as caught:
        fitted(key).save("/dev/full")
    assert caught.value.errno == errno.ENOSPC
