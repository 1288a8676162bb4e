import math

import numpy as np
import pytest
from tests.models.physics.orbits import kepler_orbit

from unmodeled.core.errors import ConfigError, DataError, OrbitError
from unmodeled.datasets.revolutions import first_revolutions, split_revolutions, thin
from unmodeled.datasets.trajectory import Trajectory

GM = 4 * math.pi**2
START = [1.0, 0, 0, 0, 2 * math.pi, 0]  # period 1 s


def circle(periods, per_period=20, first=100.0):
    times = first + np.arange(round(periods * per_period)) / per_period
    states = kepler_orbit(START, GM, times)
    return Trajectory(times, states[:, :3], states[:, 3:], source="a.csv")


def test_thinning():
    t = circle(2)
    assert len(thin(t, 0.01)) == 40
    assert np.array_equal(thin(t, 0.1).times, t.times[::2])
    assert np.array_equal(thin(t, 0.15).times, t.times[::3])
    # rounded time tags: still every second one
    jitter = 1e-4 * np.random.default_rng(0).uniform(-1, 1, 40)
    shaken = Trajectory(t.times + jitter, t.positions, t.velocities)
    assert np.array_equal(thin(shaken, 0.1).positions, t.positions[::2])
    with pytest.raises(DataError, match=r"a\.csv has 2 samples"):
        thin(t, 1.0)


def test_default_split_is_70_to_30():
    first, second, period = split_revolutions(circle(10), GM)
    assert period == pytest.approx(1.0, rel=1e-12)
    # 199 intervals of 1/20: 70 % of 9.95 periods are 139.3 intervals
    assert (len(first), len(second)) == (140, 60)
    assert first.times[-1] < second.times[0]


def test_whole_numbers_of_periods():
    first, second, _ = split_revolutions(
        circle(10), GM, train_periods=6, extrapolation_periods=4, samples_per_period=10
    )
    assert len(first) == 60
    assert len(second) == 40
    assert first.times[0] == 100.0
    assert second.times[0] == pytest.approx(106.0, abs=1e-9)
    first, second, _ = split_revolutions(circle(10), GM, train_periods=6, extrapolation_periods=2)
    assert len(first) == 120
    assert 40 <= len(second) <= 42  # the last sample within one step of the end counts


def test_file_too_short():
    with pytest.raises(DataError) as caught:
        split_revolutions(circle(10), GM, train_periods=8, extrapolation_periods=3)
    assert str(caught.value) == (
        "a.csv covers 9.95 periods of 1 s; 8.00 for training and 3.00 for extrapolation are "
        "asked for. Lower data.train_periods and data.extrapolation_periods, or give more data."
    )
    with pytest.raises(DataError, match=r"12\.00 for training and 0\.00 for extrapolation"):
        split_revolutions(circle(10), GM, train_periods=12)


def test_too_few_samples():
    with pytest.raises(DataError) as caught:
        split_revolutions(circle(10), GM, train_periods=9.9, extrapolation_periods=0.1)
    assert str(caught.value) == (
        "a.csv: 2 samples are left for extrapolation. Allowed: at least 4. "
        "Use more periods or a higher data.samples_per_period."
    )
    with pytest.raises(DataError, match=r"a\.csv: 2 samples are left for training"):
        split_revolutions(circle(10), GM, train_periods=0.1)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_bad_periods(value):
    for name in ("train", "extrapolation"):
        with pytest.raises(ConfigError) as caught:
            split_revolutions(circle(10), GM, **{f"{name}_periods": value})
        assert str(caught.value) == f"{name}_periods is {value}. Allowed: a number > 0."


def test_first_revolutions():
    whole, period = first_revolutions(circle(10), GM)
    assert len(whole) == 200
    assert period == pytest.approx(1.0, rel=1e-12)
    assert len(first_revolutions(circle(10), GM, 3)[0]) == 60
    assert len(first_revolutions(circle(10), GM, 10, 10)[0]) == 100
    with pytest.raises(DataError) as caught:
        first_revolutions(circle(10), GM, 11)
    assert str(caught.value) == (
        "a.csv covers 9.95 periods of 1 s; 11.00 are asked for. "
        "Lower the number of periods, or give more data."
    )
    with pytest.raises(DataError) as caught:
        first_revolutions(circle(10), GM, 0.1)
    assert str(caught.value) == (
        "a.csv: 2 samples are left. Allowed: at least 4. "
        "Use more periods or a higher data.samples_per_period."
    )


def test_unbound():
    t = circle(1)
    fast = Trajectory(t.times, t.positions, 2 * t.velocities, source="a.csv")
    for call in (split_revolutions, first_revolutions):
        with pytest.raises(OrbitError, match=r"a\.csv is not bound"):
            call(fast, GM)
