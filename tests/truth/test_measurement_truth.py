"""Stations and directions against astropy: another implementation of orientation and horizon."""

import astropy.units as u
import astropy_iers_data
import numpy as np
import pytest
from astropy.coordinates import (
    GCRS,
    ITRS,
    AltAz,
    CartesianRepresentation,
    EarthLocation,
    get_body_barycentric,
)
from astropy.time import Time, TimeDelta
from astropy.utils import iers

from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.station import Station

EPOCH, TIMES = "2016-03-13T06:00:00 UTC", np.linspace(0.0, 86_400.0, 25)
LATITUDE, LONGITUDE, HEIGHT = -29.0464, 115.3467, 241.4
C = 299_792_458.0


@pytest.fixture(scope="module")
def sky():
    """The same table of Earth orientation as ours, interpolated by astropy's straight lines."""
    with iers.conf.set_temp("auto_download", False), iers.conf.set_temp("auto_max_age", None):
        table = iers.IERS_A.open(astropy_iers_data.IERS_A_FILE)
        with iers.earth_orientation_table.set(table):
            yield Time("2016-03-13T06:00:00", scale="utc") + TimeDelta(TIMES, format="sec")


@pytest.fixture(scope="module")
def place():
    return EarthLocation.from_geodetic(LONGITUDE * u.deg, LATITUDE * u.deg, HEIGHT * u.m)


@pytest.fixture(scope="module")
def station():
    return Station.from_geodetic("YARL", LATITUDE, LONGITUDE, HEIGHT)


def cartesian(frame):
    return frame.cartesian.xyz.to_value(u.m).T


def satellite(sky):
    """A satellite 12,000 km from the centre: Earth-fixed (the truth) and inertial by astropy."""
    a, b = TIMES / 2000.0, TIMES / 7000.0
    fixed = 1.2e7 * np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)
    itrs = ITRS(CartesianRepresentation(fixed.T * u.m), obstime=sky)
    return fixed, cartesian(itrs.transform_to(GCRS(obstime=sky)))


def test_station_track(sky, place, station):
    np.testing.assert_allclose(
        station.position, u.Quantity(place.geocentric).to_value(u.m), rtol=0, atol=1e-8
    )
    positions, velocities = station.inertial(EPOCH, TIMES)
    expected = place.get_gcrs_posvel(sky)
    r, v = (x.xyz.to_value(unit).T for x, unit in zip(expected, (u.m, u.m / u.s), strict=True))
    # astropy leaves the celestial pole offsets out (0.2 mas: 6 mm) and draws straight lines
    # between daily values of UT1 (20 us: 1 cm).
    np.testing.assert_allclose(positions, r, rtol=0, atol=0.02)
    np.testing.assert_allclose(velocities, v, rtol=0, atol=1e-4)


def test_azimuth_and_elevation(sky, place, station):
    fixed, inertial = satellite(sky)
    here = u.Quantity(place.geocentric).to_value(u.m)
    local = ITRS(CartesianRepresentation((fixed - here).T * u.m), obstime=sky, location=place)
    horizon = local.transform_to(AltAz(obstime=sky, location=place, pressure=0 * u.hPa))
    states = np.hstack([inertial, np.zeros_like(inertial)])
    values = np.stack([horizon.az.to_value(u.rad), horizon.alt.to_value(u.rad)], axis=1)
    m = Measurements("azimuth_elevation", TIMES, values, 1e-6, station=station, epoch=EPOCH)
    assert 3 < m.below_horizon < 22
    residuals = m.residuals(states)
    # 1 cm of orientation at 6000 km: 2e-9 rad.
    np.testing.assert_allclose(residuals, 0, atol=5e-9)
    ranges = Measurements(
        "range", TIMES, horizon.distance.to_value(u.m), 1.0, station=station, epoch=EPOCH
    )
    np.testing.assert_allclose(ranges.residuals(states), 0, atol=0.02)


@pytest.mark.parametrize("astrometric", [False, True])
def test_right_ascension_and_declination(sky, place, station, astrometric):
    """Direction of arrival from retarded positions about the barycentre, ICRS axes."""
    _, position = satellite(sky)
    velocity = 4e3 * np.cross([0.3, 0.5, 0.8], position) / 1.2e7
    here = place.get_gcrs_posvel(sky)[0].xyz.to_value(u.m).T
    tau = np.zeros(len(TIMES))
    for _ in range(8):
        back = TimeDelta(tau, format="sec")
        line = position - velocity * tau[:, None] - here
        if astrometric:
            earth = get_body_barycentric("earth", sky - back, ephemeris="builtin")
            now = get_body_barycentric("earth", sky, ephemeris="builtin")
            line = line + (earth - now).xyz.to_value(u.m).T
            tau = np.linalg.norm(position - velocity * tau[:, None] - here, axis=1) / C
        else:
            tau = np.linalg.norm(line, axis=1) / C
    values = np.stack(
        [
            np.arctan2(line[:, 1], line[:, 0]),
            np.arctan2(line[:, 2], np.hypot(line[:, 0], line[:, 1])),
        ],
        axis=1,
    )
    m = Measurements(
        "right_ascension_declination",
        TIMES,
        values,
        1e-6,
        station=station,
        epoch=EPOCH,
        light_time=True,
        astrometric=astrometric,
    )
    residuals = m.residuals(np.hstack([position, velocity]))
    # Differences of barycentric positions carry 1e-16 of 1 au: 2e-5 m; orientation as above.
    np.testing.assert_allclose(residuals, 0, atol=5e-9)
