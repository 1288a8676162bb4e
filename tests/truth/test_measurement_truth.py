"""Stations and directions against astropy: another implementation of orientation and horizon."""

import os
from dataclasses import replace
from pathlib import Path

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
from scipy.interpolate import BarycentricInterpolator

from unmodeled.core.earth_orientation import inertial_from_earth_fixed
from unmodeled.datasets.measurement_files import read_measurements
from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.oem import read_oem
from unmodeled.datasets.sp3 import read_sp3
from unmodeled.datasets.station import Station

EPOCH, TIMES = "2016-03-13T06:00:00 UTC", np.linspace(0.0, 86_400.0, 25)
LATITUDE, LONGITUDE, HEIGHT = -29.0464, 115.3467, 241.4
C = 299_792_458.0
FOLDER = Path(os.environ.get("UNMODELED_DATA", Path(__file__).parents[3] / "shared" / "real"))
SLR = FOLDER / "slr"


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


def normal_points(path, station):
    """UTC seconds of the day at transmission, and times of flight, of one day's passes."""
    rows, current, day = [], "", ""
    for line in path.read_text().splitlines():
        words = line.lower().split()
        if words[0] == "h2":
            current = words[2]
        elif words[0] == "h4":
            day = words[4]
        elif words[0] == "11" and (current, day) == (station, "13"):
            assert words[4] == "2"  # the epoch is that of transmission
            rows.append((float(words[1]), float(words[2])))
    return np.array(sorted(rows)).T


@pytest.mark.real
@pytest.mark.skipif(not SLR.exists(), reason=f"no real measurements at {SLR}")
@pytest.mark.parametrize(
    ("number", "xyz", "velocity", "up", "pressure"),
    [
        (
            "7090",
            (-2389007.53398029, 5043329.44749889, -3078524.22322662),
            (-0.0468389138, 0.00839461295, 0.0509471989),
            3.1827,
            983.8,
        ),
        (
            "7119",
            (-5466065.55339658, -2404338.02403932, 2242108.39030803),
            (-0.013647828, 0.0621138779, 0.0324286362),
            2.6304,
            711.4,
        ),
    ],
)
def test_laser_ranges_to_lageos_2(number, xyz, velocity, up, pressure):
    """Normal points against the day's prediction: what is left is the air and the prediction."""
    sent, flight = normal_points(SLR / "lageos2_20160214.npt", number)
    prediction = np.array(
        [
            [float(w) for w in line.split()[3:8]]
            for line in (SLR / "lageos2_cpf_160213_5441.sgf").read_text().splitlines()
            if line.startswith("10 ")
        ]
    )
    epoch, times = "2016-02-13T00:00:00 UTC", sent + flight
    grid, fixed = prediction[:, 0], prediction[:, 2:]
    keep = (times > grid[8]) & (times < grid[-8])
    times, flight = times[keep], flight[keep]
    states = np.zeros((len(times), 6))
    for k, t in enumerate(times):  # ten points about each moment
        first = int(np.searchsorted(grid, t)) - 5
        near = slice(first, first + 10)
        part = BarycentricInterpolator((grid[near] - t) / 1000.0, fixed[near])
        states[k] = np.concatenate([part(0.0), part.derivative(0.0) / 1000.0])
    states = np.hstack(inertial_from_earth_fixed(epoch, times, states[:, :3], states[:, 3:]))
    year = 365.25 * 86_400.0
    marker = Station(
        number,
        np.array(xyz),
        velocity=np.array(velocity) / year,
        position_epoch="2010-01-01T00:00:00 UTC",
    )
    station = marker.moved(up * marker.north_east_up[2])
    settings = {"station": station, "epoch": epoch}
    elevation = Measurements(
        "azimuth_elevation", times, np.zeros((len(times), 2)), 1.0, **settings
    ).observed(states)[:, 1]
    m = Measurements(
        "range", times, C * flight / 2, 0.01, ways=2, light_time=True, gm=3.986004418e14, **settings
    )
    # Zenith delay of green light 2.4 m at 1013 hPa, growing as the cosecant [IERS2010, ch. 9].
    left = m.residuals(states)[:, 0] - 2.4 * pressure / 1013 / np.sin(elevation)
    assert len(left) >= 12
    # Measured 0.2 m: centre of mass (0.25 m), cosecant law, and the prediction itself (0.1 m).
    assert np.abs(left).max() < 0.3
    # Light time is worth 40 m and the second way metres.
    assert np.abs(replace(m, light_time=False).residuals(states)).max() > 40
    assert np.ptp(replace(m, ways=1).residuals(states) - m.residuals(states)) > 5


@pytest.mark.real
@pytest.mark.skipif(not FOLDER.exists(), reason=f"no real measurements at {FOLDER}")
def test_real_orbits_as_measurements():
    """ISS (OEM, XML, EME2000, UTC) and LAGEOS-2 (SP3, Earth-fixed) against the plain readers."""
    iss = FOLDER / "oem-iss" / "ISS.OEM_J2K_EPH_2022-042.xml.gz"
    orbit = read_oem(iss, accelerations=False)
    got = read_measurements(iss, "position", sigma=100.0, epoch="2022-02-11T12:00:00 TAI", every=9)
    (m,) = got.measurements
    np.testing.assert_allclose(m.times, orbit.times[::9] + 37.0, rtol=0, atol=1e-6)
    np.testing.assert_allclose(m.values, orbit.positions[::9], rtol=0, atol=1e-8)
    assert (m.axes, len(got)) == ("inertial", 614)
    lageos = FOLDER / "sp3-lageos2" / "ilrsa.orb.lageos2.160319.v35.sp3"
    orbit = read_sp3(lageos, accelerations=False)
    (m,) = read_measurements(
        lageos, "position_velocity", sigma=[0.03, 1e-5], start=86_400.0, end=2 * 86_400.0
    ).measurements
    day = (orbit.times >= 86_400.0) & (orbit.times <= 2 * 86_400.0)
    np.testing.assert_allclose(m.values, orbit.states[day], rtol=0, atol=1e-6)
    assert (m.axes, m.epoch) == ("earth_fixed", orbit.epoch)
    # Read with the wrong scale, the orbit is 36 s of the Earth's rotation off: 31 km at 12,000 km.
    (wrong,) = read_measurements(lageos, "position", sigma=0.03, time_scale="TAI").measurements
    assert 2e4 < np.linalg.norm(wrong.values[0] - orbit.positions[0]) < 4e4


@pytest.mark.real
@pytest.mark.skipif(not FOLDER.exists(), reason=f"no real measurements at {FOLDER}")
def test_a_real_telescope_track():
    """Ten minutes of a GPS satellite: the directions lie on an orbit of 26,560 km."""
    path = FOLDER / "tdm-optical" / "20200917_041957_001_03005A_UTA-ASTRIANet-02.tdm"
    name = "UTA-ASTRIANet-02"
    telescope = Station.from_geodetic(name, 32.903056, 254.470444, 2225.04)
    got = read_measurements(
        path, "right_ascension_declination", sigma=1e-5, stations={name: telescope}
    )
    (m,) = got.measurements
    assert (len(m.times), m.station.name, m.ways) == (60, name, 1)
    ra, dec = m.values.T
    line = np.stack([np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)], axis=1)
    here, _ = telescope.inertial(m.epoch, m.times)
    # On a sphere of that radius the track has the speed of GPS, v = sqrt(GM/a), and its
    # inclination; e = 0.01 changes radius and speed by 1 % each.
    along = np.einsum("ni,ni->n", here, line)
    distance = -along + np.sqrt(along**2 - np.sum(here**2, axis=1) + 2.656e7**2)
    place = here + distance[:, None] * line
    velocity = (place[-1] - place[0]) / (m.times[-1] - m.times[0])
    normal = np.cross(place[30], velocity)
    assert np.linalg.norm(velocity) == pytest.approx(3874.0, rel=0.03)
    assert np.degrees(np.arccos(normal[2] / np.linalg.norm(normal))) == pytest.approx(55.0, abs=1.5)
