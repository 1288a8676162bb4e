"""Stations: coordinates, tracks on the Earth and on another body, drift, refusals."""

import numpy as np
import pytest

from unmodeled.core.constants import EARTH_ROTATION_RATE
from unmodeled.core.errors import DataError
from unmodeled.datasets.station import Station, UniformRotation

EPOCH, TIMES = "2016-03-13T06:00:00 UTC", np.linspace(-1000.0, 4000.0, 6)
PLACE = np.array([3.0e6, 4.0e6, 3.9e6])


def test_on_the_earth_the_velocity_is_the_derivative_of_the_position():
    station = Station.from_xyz("A", *PLACE)
    r, v = station.inertial(EPOCH, TIMES)
    np.testing.assert_allclose(np.linalg.norm(r, axis=1), np.linalg.norm(PLACE), rtol=1e-14)
    # At 5000 km from the axis; the length of day and precession are 1e-7 of it.
    speed = EARTH_ROTATION_RATE.value * 5.0e6
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), speed, rtol=1e-4)
    h = 1.0
    difference = (station.inertial(EPOCH, TIMES + h)[0] - station.inertial(EPOCH, TIMES - h)[0]) / (
        2 * h
    )
    # omega^3 h^2 / 6 of 5000 km: 3e-7 m/s; rounding 1e-9 m / 1 s.
    np.testing.assert_allclose(v, difference, rtol=0, atol=1e-6)


def test_on_another_body():
    """A slow spin about a pole that is tilted by 90 degrees."""
    equator = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    station = Station("rover", np.array([200.0, 0.0, 50.0]), UniformRotation(4e-4, 0.5, equator))
    angle = 0.5 + 4e-4 * TIMES
    r, v = station.inertial("", TIMES)
    expected = np.stack([200 * np.cos(angle), np.full(6, -50.0), 200 * np.sin(angle)], axis=1)
    np.testing.assert_allclose(r, expected, atol=1e-10)
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), 200 * 4e-4, rtol=1e-12)
    np.testing.assert_allclose(np.cross(v, r)[:, 1] > 0, True)
    up = station.track("", TIMES).north_east_up[:, 2]
    np.testing.assert_allclose(up, r / np.linalg.norm(r, axis=1, keepdims=True), atol=1e-14)


def test_plate_motion():
    year = 365.25 * 86_400
    drift = Station(
        "A", PLACE, velocity=np.array([0, 0, 1.0]) / year, position_epoch="2006-03-13T06:00:00 UTC"
    )
    moved = drift.inertial(EPOCH, TIMES)[0] - Station("A", PLACE).inertial(EPOCH, TIMES)[0]
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 10.0, rtol=1e-3)


def test_moved_keeps_the_horizon():
    station = Station.from_geodetic("A", 45.0, 10.0, 100.0)
    moved = station.moved([1e5, 0, 0])
    np.testing.assert_array_equal(moved.north_east_up, station.north_east_up)
    np.testing.assert_allclose(moved.position - station.position, [1e5, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Station.from_xyz("A", 0.1, 0, 0), "lies at the body's centre"),
        (lambda: Station("A", np.ones(2)), r"station A: position has shape \(2,\)"),
        (lambda: Station.from_xyz("A", np.nan, 0, 0), "not finite"),
        (lambda: Station.from_geodetic("A", 91.0, 0, 0), r"latitude 91\.0.*degrees -90 \.\. 90"),
        (lambda: Station("A", PLACE, velocity=(1e-9, 0, 0)), "position_epoch is not given"),
        (lambda: Station("A", PLACE).inertial("1800-01-01T00:00:00 TT", TIMES), "lie outside"),
    ],
)
def test_refusals(make, message):
    with pytest.raises(DataError, match=message):
        make()
