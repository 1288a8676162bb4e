"""Measurements: partials against differences, great circles, light time, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from tests.datasets.measurement_cases import CASES, EPOCH, GM, STATION, TIMES, measurement, orbit

from unmodeled.core.errors import DataError
from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.station import Station

C = 299_792_458.0


@pytest.mark.parametrize("name", CASES)
def test_partials_against_central_differences(name):
    m, (states, _) = measurement(name), orbit(TIMES)
    got = m.partials(states)
    assert got.shape == (*m.values.shape, 6)
    assert np.abs(m.residuals(states) / m.sigmas).max() < 1e-3
    np.testing.assert_allclose(m.predicted(states), m.values, rtol=1e-12)
    # A step of 10 km or 10 m/s: truncation (h/rho)^2 / 6 and rounding 1e-16 rho/h are below 1e-6.
    for axis, step in enumerate([1e4] * 3 + [10.0] * 3):
        h = np.zeros(6)
        h[axis] = step
        expected = (m.predicted(states + h) - m.predicted(states - h)) / (2 * step)
        size = np.abs(got).max(axis=(0, 2))[None]
        tolerance = 2e-5 * size + 1e-15 * np.abs(m.values).max(axis=0) / step
        assert np.all(np.abs(got[:, :, axis] - expected) <= tolerance), axis


@pytest.mark.parametrize("name", CASES)
def test_rate_in_time_against_shifted_copies(name):
    m = measurement(name)
    got = m.time_derivative(*orbit(m.times))
    h = 0.5
    later, earlier = m.shifted(h), m.shifted(-h)
    a, b = (x.predicted(orbit(x.times)[0]) for x in (later, earlier))
    size = np.abs(got).max(axis=0)
    # Truncation h^2/6 times the square of the fastest angular rate, (v/rho)^2 = 1e-5: 1e-6.
    assert np.all(np.abs(got - (a - b) / (2 * h)) <= 2e-5 * size)
    if m.earth_fixed:  # v - omega x r
        assert np.abs(got[:, :3] - orbit(m.times)[0][:, 3:]).max() > 100


def test_angles_are_compared_along_the_great_circle():
    states, _ = orbit(TIMES)
    m = replace(measurement("radec, centre"), rotation=(0.0, 0.0, 0.0))
    m = replace(m, values=m.observed(states))
    r, dec = states[:, :3], np.arcsin(states[:, 2] / np.linalg.norm(states[:, :3], axis=1))
    np.testing.assert_allclose(m.values[:, 1], dec, atol=1e-14)
    turn = 1e-6  # of the right ascension
    moved = states.copy()
    moved[:, :3] += turn * np.cross([0, 0, 1], r)
    np.testing.assert_allclose(-m.residuals(moved)[:, 0], turn * np.cos(dec), atol=1e-11)
    around = replace(m, values=m.values + np.array([2 * np.pi, 0]))
    np.testing.assert_allclose(around.residuals(moved), m.residuals(moved), atol=1e-14)
    np.testing.assert_allclose(around.values - around.predicted(moved), around.residuals(moved))


@pytest.mark.parametrize("ways", [1, 2])
def test_light_time_is_that_of_the_signal(ways):
    """Emission (or both legs) solved on the true orbit and the true station."""
    m = replace(measurement("range, light"), ways=ways, scale=1.0)
    here, _ = STATION.inertial(EPOCH, TIMES)
    tau, up = np.zeros(7), np.zeros(7)
    for _ in range(20):
        place = orbit(TIMES - tau)[0][:, :3]
        tau = np.linalg.norm(place - here, axis=1) / C
        sent, _ = STATION.inertial(EPOCH, TIMES - tau - up)
        up = np.linalg.norm(place - sent, axis=1) / C
    expected = C * (tau if ways == 1 else (tau + up) / 2)
    got = m.observed(orbit(TIMES)[0])[:, 0]
    # One way: jerk tau^3/6 = 1e-7 m; two ways: v_s tau rho'/c = 5e-5 m.
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6 if ways == 1 else 1e-4)
    straight = replace(m, gm=0.0).observed(orbit(TIMES)[0])[:, 0]
    bend = 0.5 * GM / 8.0e6**2 * tau**2
    assert np.all(np.abs(straight - expected) <= bend + 1e-4)
    without = replace(m, light_time=False).observed(orbit(TIMES)[0])[:, 0]
    assert np.abs(without - expected).max() > 10
    # The range rate is the range's rate.
    rate = replace(measurement("rate, light"), ways=ways)
    np.testing.assert_allclose(
        rate.observed(orbit(TIMES)[0]), m.time_derivative(*orbit(TIMES)), rtol=0, atol=2e-6
    )


def test_biases_grow_from_the_first_tag_and_survive_a_subset():
    m = replace(measurement("range"), bias=[5.0], bias_rate=[0.1])
    states, _ = orbit(TIMES)
    expected = -5.0 - 0.1 * (TIMES - TIMES[0])
    np.testing.assert_allclose(m.residuals(states)[:, 0], expected, atol=1e-8)
    late = m.subset(TIMES > 400)
    np.testing.assert_allclose(
        late.residuals(states[TIMES > 400])[:, 0], expected[TIMES > 400], atol=1e-8
    )
    np.testing.assert_array_equal(m.shifted(3.0).tags, TIMES)
    angles = replace(measurement("azel"), bias=[1e-3, 2e-3])
    simulated = replace(angles, values=angles.observed(states))
    # Second order: the cosine is that of the reading.
    np.testing.assert_allclose(simulated.residuals(states), 0, atol=1e-5)


def test_the_horizon():
    """Azimuth runs from north through east; the axes are orthonormal."""
    place = np.asarray(STATION.track(EPOCH, TIMES).positions)
    up = STATION.track(EPOCH, TIMES).north_east_up
    states = np.zeros((7, 6))
    m = measurement("azel")
    for azimuth in (0.1, np.pi / 2):
        level = np.cos(azimuth) * up[:, 0] + np.sin(azimuth) * up[:, 1]
        states[:, :3] = place + 1e5 * (level + up[:, 2])
        np.testing.assert_allclose(m.observed(states), [[azimuth, np.pi / 4]] * 7, atol=1e-9)
    assert m.below_horizon == int(np.sum(m.values[:, 1] < 0))
    np.testing.assert_allclose(up @ np.swapaxes(up, 1, 2), [np.eye(3)] * 7, atol=1e-14)


def make(kind="range", **changes):
    count = {"position": 3, "azimuth_elevation": 2}.get(kind, 1)
    settings = {"times": [0.0, 1.0], "values": np.ones((2, count)), "sigma": 1.0, "label": "arc"}
    if kind != "position":
        settings |= {"station": STATION, "epoch": EPOCH}
    return Measurements(kind, **(settings | changes))


@pytest.mark.parametrize(
    ("kind", "changes", "message"),
    [
        ("ranges", {}, r'kind is "ranges".*Did you mean "range"\?'),
        ("range", {"station": None}, r"range needs a station\. Give station="),
        ("azimuth_elevation", {"station": None}, "azimuth_elevation needs a station"),
        ("range", {"epoch": ""}, "needs the date of time zero"),
        ("range", {"sigma": None}, r"arc: sigma is not stated\. Allowed: a number, m\."),
        ("range", {"sigma": -1.0}, r"sigma is -1\.0"),
        ("range", {"sigma": [1.0, 2.0, 3.0]}, r"sigma has shape \(3,\)"),
        ("range", {"times": [1.0, 0.0]}, "time goes back at sample 1"),
        ("range", {"times": [1.0, 1.0]}, "time repeats at sample 1"),
        ("range", {"times": [], "values": np.ones((0, 1))}, "has no measurements"),
        ("range", {"values": [1.0, np.nan]}, "not finite"),
        ("range", {"values": np.ones((2, 2))}, r"values has shape \(2, 2\)"),
        ("range", {"axes": "itrf"}, 'axes is "itrf"'),
        ("range", {"axes": "earth_fixed"}, "has no setting axes"),
        ("range", {"rotation": (1e-6, 0, 0)}, "range has no setting rotation"),
        ("range", {"ways": 3}, "has no setting ways"),
        ("range", {"scale": 0.0}, "scale > 0"),
        ("range", {"astrometric": True}, "has no setting astrometric"),
        ("position", {"light_time": True}, "position has no setting light_time"),
        ("position", {"station": STATION}, "positions from the body's centre"),
        ("position", {"axes": "earth_fixed"}, "needs the date of time zero"),
        ("azimuth_elevation", {"values": [[10.0, 45.0]] * 2}, "Degrees must be turned"),
    ],
)
def test_refusals(kind, changes, message):
    with pytest.raises(DataError, match=message):
        make(kind, **changes)


def test_sigma_and_columns_in_short_forms():
    assert make(values=[1.0, 2.0]).values.shape == (2, 1)
    np.testing.assert_array_equal(make(sigma=[1.0, 2.0]).sigmas, [[1.0], [2.0]])
    both = make("azimuth_elevation", sigma=[1e-5, 2e-5])
    np.testing.assert_array_equal(both.sigmas, [[1e-5, 2e-5]] * 2)
    with pytest.raises(DataError, match="mask has shape"):
        both.subset(np.ones(3, dtype=bool))


def test_station_without_epoch_says_what_to_give():
    with pytest.raises(DataError, match="Give epoch="):
        Station.from_xyz("A", 6.4e6, 0.0, 0.0).track("", TIMES)
