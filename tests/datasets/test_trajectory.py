import dataclasses

import numpy as np
import pytest

from unmodeled.core.errors import DataError
from unmodeled.datasets.trajectory import Trajectory


def columns(n=6):
    t = np.arange(n, dtype=float)
    x = np.stack([1 + t, t, -t], axis=1)
    return {"times": t, "positions": x, "velocities": 2 * x, "accelerations": 3 * x}


def changed(name, index, value):
    given = columns()
    given[name] = given[name].copy()
    given[name][index] = value
    return given


def text_of(given):
    with pytest.raises(DataError) as caught:
        Trajectory(**given)
    return str(caught.value)


def test_columns_are_kept_as_float64():
    t = Trajectory([0, 1, 2, 3], np.ones((4, 3), dtype=int), np.zeros((4, 3), dtype=np.float32))
    assert t.times.dtype == t.positions.dtype == t.velocities.dtype == np.float64
    assert t.accelerations is None
    assert len(t) == 4
    assert np.array_equal(t.states, [[1, 1, 1, 0, 0, 0]] * 4)
    assert t.radii == pytest.approx(np.sqrt(3) * np.ones(4))


@pytest.mark.parametrize("name", ["times", "positions", "velocities", "accelerations"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite(name, value):
    index = 2 if name == "times" else (2, 1)
    where = "(2,)" if name == "times" else "(2, 1)"
    assert text_of(changed(name, index, value)) == (
        f"trajectory: {name} has 1 value(s) that are not finite, the first ({value}) at index "
        f"{where}. Allowed: finite numbers. Remove or repair these samples."
    )


def test_times_that_repeat_or_go_back():
    rest = " Allowed: strictly increasing times. Sort the samples and remove duplicates."
    assert text_of(changed("times", 3, 2.0)) == (
        "trajectory: time repeats at sample 3: 2.000000 s is followed by 2.000000 s." + rest
    )
    assert text_of(changed("times", 3, -1.0) | {"source": "a.csv"}) == (
        "a.csv: time goes back at sample 3: 2.000000 s is followed by -1.000000 s." + rest
    )


@pytest.mark.parametrize("n", [0, 3])
def test_too_few(n):
    assert text_of(columns(n) | {"source": "a.csv"}) == (
        f"a.csv has {n} samples. Allowed: at least 4. Give a longer trajectory."
    )


@pytest.mark.parametrize("name", ["times", "positions", "velocities", "accelerations"])
def test_columns_of_different_length(name):
    given = columns()
    given[name] = given[name][:-1]
    assert text_of(given) == "trajectory: columns have different lengths [5, 6]."


def test_wrong_shapes():
    given = columns() | {"positions": np.ones((6, 2))}
    assert text_of(given) == "trajectory: positions has shape (6, 2). Allowed: shape (n, 3)."
    given = columns() | {"times": np.ones((6, 1))}
    assert text_of(given) == "trajectory: times has shape (6, 1). Allowed: shape (n,)."


def test_centre_and_frame():
    assert text_of(changed("positions", 4, 0.0)) == (
        "trajectory: a position lies at the body's centre."
    )
    assert text_of(columns() | {"frame": "rotating"}) == (
        "trajectory: frame is 'rotating'. Allowed: inertial, body_fixed."
    )


def test_selection():
    t = Trajectory(**columns(), source="a.csv", epoch="2000", notes={"a": 1})
    for index in (slice(1, 6), np.array([1, 2, 4, 5]), t.times > 1.5):
        part = t[index]
        assert np.array_equal(part.times, t.times[index])
        assert np.array_equal(part.accelerations, t.accelerations[index])
        assert (part.source, part.epoch, part.notes) == ("a.csv", "2000", {"a": 1})
    with pytest.raises(DataError, match=r"a\.csv has 2 samples"):
        t[:2]
    with pytest.raises(dataclasses.FrozenInstanceError):
        t.source = "b"
