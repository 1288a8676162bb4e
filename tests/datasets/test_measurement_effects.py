"""What every measurement effect must do, and the names of slips."""

import re
from dataclasses import replace

import erfa
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.datasets.measurement_cases import CASES, EPOCH, TIMES, measurement, orbit

from unmodeled.core.earth_orientation import inertial_from_earth_fixed
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.time import seconds_between, terrestrial_time
from unmodeled.datasets.measurement_effects import (
    MEASUREMENT_EFFECTS,
    FrameRotation,
    LightTime,
    RangeBias,
    StationPosition,
    TimeTag,
)
from unmodeled.datasets.slips import explain_rotation, explain_time_offset

#: A value of each parameter at which the effect is large, and a step about it.
SIZES = {
    "range_bias": (300.0, 10.0),
    "range_rate_bias": (2.0, 0.1),
    "angle_bias": (1e-3, 1e-4),
    "time_tag": (5.0, 0.1),
    "time_tag_drift": (1e-3, 1e-4),
    "clock_drift": (1e-6, 1e-7),
    "station_position": (5e3, 300.0),
    "light_time": (0.3, 0.1),
    "frame_rotation": (0.05, 1e-3),
    "scale": (0.01, 1e-3),
    "antenna_offset": (3e3, 300.0),
    "troposphere": (2.4, 0.1),
    "refraction": (1.1, 0.1),
    "relativistic_delay": (1e3, 10.0),
}
PAIRS = [(e, c) for e in MEASUREMENT_EFFECTS for c in CASES if e().concerns(measurement(c))]


def predicted(m):
    return m.predicted(orbit(m.times)[0])


@pytest.mark.parametrize(("effect", "case"), PAIRS, ids=[f"{e.name}-{c}" for e, c in PAIRS])
def test_contract(effect, case):
    """Zero changes nothing; partials against differences of the exact effect, away from zero."""
    e, m = effect(), measurement(case)
    zero = {p.name: 0.0 for p in e.parameters}
    np.testing.assert_array_equal(predicted(e.applied(m, zero)), predicted(m))
    size, h = SIZES[e.name]
    values = {name: size * (1 - 0.3 * k) for k, name in enumerate(zero)}
    full = e.applied(m, values)
    got = e.partials(full, *orbit(full.times))
    assert got.shape == (*m.values.shape, len(values))
    # Half-way between parameters at which nothing bends: 1e-4 of the largest entry.
    for k, name in enumerate(values):
        up, down = (e.applied(m, values | {name: values[name] + d}) for d in (h, -h))
        expected = (predicted(up) - predicted(down)) / (2 * h)
        largest = np.abs(got[:, :, k]).max(axis=0)
        rounding = 1e-13 * np.abs(m.values).max(axis=0) / h
        assert np.all(np.abs(got[:, :, k] - expected) <= 1e-4 * largest + rounding)
    assert np.abs(predicted(full) - predicted(m)).max() > 0
    assert e.__doc__
    assert "Confused with" in e.__doc__
    assert "Source" in e.__doc__


def test_every_effect_has_a_case_and_names_are_unique():
    assert {e for e, _ in PAIRS} == set(MEASUREMENT_EFFECTS)
    names = [p.name for e in MEASUREMENT_EFFECTS for p in e(of="A").parameters]
    assert len(set(names)) == len(names)
    assert all(name.endswith("[A]") for name in names)
    assert RangeBias().parameters[0].name == "range_bias"


def test_whom_an_effect_concerns():
    m = measurement("range")
    assert RangeBias(of="range").concerns(m)
    assert not RangeBias(of="other").concerns(m)
    assert StationPosition(of="YARL").concerns(m)
    assert not StationPosition(of="range").concerns(m)
    assert not FrameRotation().concerns(m)
    with pytest.raises(ConfigError, match="frame_rotation does not act on range"):
        FrameRotation().applied(m, {})
    with pytest.raises(ConfigError, match=r'parameter "range_bias\[range\]" is missing'):
        RangeBias(of="range").applied(m, {"range_bias": 1.0})


def test_earth_fixed_data_with_a_time_slip_are_turned_with_the_wrong_earth():
    """Positions of a body at rest on the Earth do not move at all."""
    m = measurement("position, ITRF")
    m = replace(m, rotation=(0.0, 0.0, 0.0))
    fixed = np.broadcast_to([7e6, 1e6, 2e6], (len(TIMES), 3))
    slipped = TimeTag().applied(m, {"time_tag": 69.184})
    here, there = (
        np.hstack(inertial_from_earth_fixed(EPOCH, t, fixed, 0 * fixed))
        for t in (TIMES, slipped.times)
    )
    np.testing.assert_allclose(slipped.predicted(there), m.predicted(here), rtol=0, atol=1e-6)
    inertial = replace(m, axes="inertial").shifted(69.184)
    assert np.abs(inertial.predicted(there) - here[:, :3]).max() > 3e4


def test_light_time_looks_like_a_time_tag_of_minus_rho_over_c():
    m = measurement("radec, centre")
    m = replace(m, rotation=(0.0, 0.0, 0.0))
    states, accelerations = orbit(TIMES)
    light = LightTime().partials(m, states, accelerations)[:, :, 0]
    tag = TimeTag().partials(m, states, accelerations)[:, :, 0]
    np.testing.assert_allclose(light, -tag * 8.0e6 / 299_792_458.0, rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize(
    ("dt", "sigma", "text"),
    [
        (-68.2, 0.01, r"-\(TT - UTC\) = -68\.184 s: dates in TT seem to be read as UTC"),
        (68.184, 0.2, r"TT - UTC = 68\.184 s: dates in UTC seem to be read as TT"),
        (17.01, 0.0, r"GPS - UTC = 17 s: dates in UTC seem to be read as GPS"),
        (-19.0, 0.01, r"dates in TAI seem to be read as GPS"),
        (32.2, 0.01, r"dates in TAI seem to be read as TT"),
        (36.0, 0.01, r"dates in UTC seem to be read as TAI"),
        (-1.0, 0.01, "a leap second seems to be missing"),
        (14.0, 0.01, "BDT"),
    ],
)
def test_time_slips_are_named(dt, sigma, text):
    """March 2016: TAI - UTC = 36 s, GPS - UTC = 17 s."""
    assert re.search(text, explain_time_offset(dt, sigma, EPOCH))


def test_what_is_no_time_slip():
    assert explain_time_offset(0.02, 0.001, EPOCH) is None
    assert explain_time_offset(1.0, 0.5, EPOCH) is None  # not significant
    assert explain_time_offset(7.0, 0.1, EPOCH) is None
    with pytest.raises(DataError, match="finite, sigma >= 0"):
        explain_time_offset(float("nan"), 1.0, EPOCH)
    # The sign is that of TimeTag: a date of TT read as UTC names a later instant than was meant.
    wrong = seconds_between("2016-03-13T00:00:00 TT", "2016-03-13T00:00:00 UTC")
    assert explain_time_offset(-wrong, 0.0, EPOCH).endswith("dates in TT seem to be read as UTC.")


def test_frame_slips_are_named():
    """Positions along axes of date, given as inertial, against the effect's own convention."""
    tt = terrestrial_time(EPOCH, 0.0)
    m = measurement("position")
    states, _ = orbit(TIMES)
    for matrix, text in (
        (erfa.pmat06(tt.jd1, tt.jd2), "mean equator and equinox of date read as ICRF"),
        (erfa.pnm06a(tt.jd1, tt.jd2), "true equator and equinox of date read as ICRF"),
        (erfa.bp06(2451545.0, 0.0)[0], "frame bias: EME2000"),
    ):
        of_date = replace(m, values=m.values @ matrix.T)
        theta = np.zeros(3)
        for _ in range(3):  # three unknowns, no orbit: Gauss-Newton
            fit = replace(of_date, rotation=theta)
            columns = fit.rotation_partials(states).reshape(-1, 3)
            step = np.linalg.lstsq(columns, fit.residuals(states).ravel(), rcond=None)[0]
            theta = theta + step
        assert text in explain_rotation(theta, [1e-9] * 3, EPOCH)
        np.testing.assert_allclose(Rotation.from_rotvec(-theta).as_matrix(), matrix, atol=1e-13)
    assert explain_rotation([1e-3, 0, 0], [1e-9] * 3, EPOCH) is None
    assert explain_rotation([1e-9, 0, 0], [1e-9] * 3, EPOCH) is None
