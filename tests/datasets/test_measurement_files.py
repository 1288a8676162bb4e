"""Files of measurements: what is read, in which scale and axes, and what is refused."""

import gzip
import struct
from dataclasses import replace

import numpy as np
import pytest
from tests.datasets.measurement_cases import CASES, EPOCH, STATION, TIMES, measurement, orbit

from unmodeled.core.earth_orientation import icrf_from_itrf, inertial_from_earth_fixed
from unmodeled.core.errors import ConfigError, DataError, UnmodeledError
from unmodeled.core.time import seconds_between
from unmodeled.datasets.measurement_csv import write_measurements
from unmodeled.datasets.measurement_files import read_measurements
from unmodeled.datasets.oem_writer import write_oem
from unmodeled.datasets.spk import read_spk
from unmodeled.datasets.station import Station
from unmodeled.datasets.trajectory import Trajectory

OTHER = Station.from_geodetic("HERL", 50.9, 0.3, 75.0)
BOTH = {"YARL": STATION, "HERL": OTHER}


@pytest.fixture
def write(tmp_path):
    def written(text, name):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return written


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("name", ["position", "state", "range", "rate", "radec, centre", "azel"])
def test_tables_round_trip_bit_by_bit(tmp_path, name, suffix):
    m = measurement(name)
    sets = (m, replace(m, station=OTHER)) if m.station else (m,)
    path = write_measurements(sets, tmp_path / f"a.{suffix}")
    got = read_measurements(path, CASES[name][0], sigma=None, stations=BOTH if m.station else None)
    assert len(got.measurements) == len(sets)
    assert got.epoch == EPOCH
    for one, two in zip(sets, got.measurements, strict=True):
        np.testing.assert_array_equal(one.times, two.times)
        np.testing.assert_array_equal(one.values, two.values)
        np.testing.assert_array_equal(one.sigmas, two.sigmas)
        assert one.station is two.station


TABLE = """# epoch: 2016-12-31T23:59:50 UTC
time_gps,station,range_km,sigma_range_m,azimuth_deg,elevation_deg
2017-01-01T00:00:07,YARL,7000.5,0.01,,
2017-01-01T00:00:12,HERL,,,200.0,-1.0
2017-01-01T00:00:17,YARL,7001.5,0.02,190.0,30.0
2017-01-01T00:00:27,YARL,7002.5,0.03,,
"""


def test_a_table_of_several_kinds_and_stations(write):
    path = write(TABLE, "a.csv")
    got = read_measurements(path, "range", sigma=None, stations=BOTH, light_time=True)
    (m,) = got.measurements
    # GPS - UTC is 17 s before the leap second at the end of 2016.
    np.testing.assert_allclose(m.times, [0, 10, 20], atol=1e-9)
    np.testing.assert_allclose(m.values[:, 0], [7000500, 7001500, 7002500])
    np.testing.assert_allclose(m.sigmas[:, 0], [0.01, 0.02, 0.03])
    assert (m.station, m.light_time, got.epoch) == (STATION, True, "2016-12-31T23:59:50 UTC")
    angles = read_measurements(path, "azimuth_elevation", sigma=1e-4, stations=BOTH)
    assert [a.label for a in angles.measurements] == ["a.csv, HERL", "a.csv, YARL"]
    assert angles.notes["below_horizon"] == "1 elevations below zero"
    np.testing.assert_allclose(angles.measurements[1].values, np.radians([[190.0, 30.0]]))


def test_choice_of_epoch_span_and_every(write):
    path, options = write(TABLE, "a.csv"), {"sigma": None, "stations": BOTH}
    (m,) = read_measurements(path, "range", every=2, **options).measurements
    np.testing.assert_allclose(m.times, [0, 20], atol=1e-9)
    late = "2016-12-31T23:59:55 UTC"
    got = read_measurements(
        path, "range", epoch=late, start=0.0, end="2017-01-01T00:00:00 UTC", **options
    )
    np.testing.assert_allclose(got.measurements[0].times, [5.0], atol=1e-9)
    with pytest.raises(DataError, match=r"no measurements between 100 and inf s.*after 2016"):
        read_measurements(path, "range", start=100.0, **options)
    # The same digits in another scale: 36 s of TAI - UTC, less the 17 s of GPS - UTC.
    path = write(TABLE.replace("# epoch: 2016-12-31T23:59:50 UTC\n", ""), "b.csv")
    got = read_measurements(path, "range", epoch=late, time_scale="TAI", **options)
    expected = seconds_between(late, "2017-01-01T00:00:07 TAI")
    np.testing.assert_allclose(got.measurements[0].times[0], expected, atol=1e-9)
    assert got.notes["time_scale"] == "TAI by the caller, GPS in the file"


def test_seconds_without_an_epoch_count_from_the_callers(write):
    path = write("t_min,x_km,y_km,z_km\n1,7000,0,0\n2,0,7000,0\n", "a.csv")
    got = read_measurements(path, "position", sigma=1.0)
    assert got.epoch == ""
    np.testing.assert_allclose(got.measurements[0].times, [60, 120])
    got = read_measurements(path, "position", sigma=1.0, epoch=EPOCH, frame="ITRF")
    (m,) = got.measurements
    assert (m.epoch, m.axes) == (EPOCH, "earth_fixed")
    turn = icrf_from_itrf(EPOCH, [60.0, 120.0])
    np.testing.assert_allclose(m.values[0], turn[0] @ [7e6, 0, 0], rtol=1e-14)
    with pytest.raises(DataError, match="needs the date of time zero"):
        read_measurements(path, "position", sigma=1.0, frame="ITRF")


@pytest.fixture
def oem(tmp_path):
    states, _ = orbit(TIMES)
    path = tmp_path / "a.oem"
    orbit_itself = Trajectory(TIMES, states[:, :3], states[:, 3:], epoch=EPOCH)
    write_oem(orbit_itself, path, object_name="SAT", object_id="2016-001A", center_name="EARTH")
    return path


def test_an_oem_and_what_it_is_said_to_be(oem):
    states, _ = orbit(TIMES)
    got = read_measurements(oem, "position_velocity", sigma=[1.0, 1e-3])
    (m,) = got.measurements
    np.testing.assert_allclose(m.values, states, rtol=0, atol=2e-6)
    assert (got.epoch, m.axes, m.kind) == (EPOCH, "inertial", "position_velocity")
    (m,) = read_measurements(oem, "position", sigma=1.0).measurements
    assert m.values.shape == (len(TIMES), 3)
    fixed = read_measurements(oem, "position_velocity", sigma=[1.0, 1e-3], frame="ITRF2014")
    turned = inertial_from_earth_fixed(EPOCH, TIMES, states[:, :3], states[:, 3:])
    (m,) = fixed.measurements
    np.testing.assert_allclose(m.values, np.hstack(turned), rtol=0, atol=2e-6)
    assert m.axes == "earth_fixed"
    moved = read_measurements(oem, "position", sigma=1.0, time_scale="TT", epoch=EPOCH)
    np.testing.assert_allclose(moved.measurements[0].times, TIMES - 68.184, atol=1e-9)


META = "\n".join(
    [
        "CCSDS_TDM_VERS = 2.0",
        "META_START",
        "TIME_SYSTEM = UTC",
        "PARTICIPANT_1 = YARL",
        "PARTICIPANT_2 = SAT",
        "PATH = 1,2,1",
        "TIMETAG_REF = RECEIVE",
        "ANGLE_TYPE = RADEC",
        "REFERENCE_FRAME = EME2000",
        "INTEGRATION_INTERVAL = 10",
        "INTEGRATION_REF = START",
        "META_STOP",
        "DATA_START",
    ]
)
DATA = """
RANGE = 2016-03-13T06:00:00 14000.0
RANGE = 2016-03-13T06:00:10 14002.0
DOPPLER_INTEGRATED = 2016-03-13T06:00:00 -3.0
ANGLE_1 = 2016-03-13T06:00:00 0.0
ANGLE_2 = 2016-03-13T06:00:00 90.0
DATA_STOP
"""


def tdm(path, kind, **options):
    return read_measurements(path, kind, **({"sigma": 1.0, "stations": BOTH} | options))


def test_tracking_data(write):
    path = write(META + DATA, "a.tdm")
    (m,) = tdm(path, "range", round_trip=True).measurements
    np.testing.assert_allclose(m.values[:, 0], [7e6, 7.001e6])
    assert (m.ways, m.station, m.epoch) == (2, STATION, EPOCH)
    (m,) = tdm(path, "range", round_trip=False).measurements
    np.testing.assert_allclose(m.values[:, 0], [14e6, 14.002e6])
    got = tdm(path, "range_rate", round_trip=True)
    np.testing.assert_allclose(got.measurements[0].values, [[-1500.0]])
    np.testing.assert_allclose(got.measurements[0].times, [5.0])
    assert "interval's middle" in got.notes["range_rate"]
    # The pole of J2000 in ICRF: 16.6 and 6.8 mas away [IERS2010, Eq. 5.21].
    (m,) = tdm(path, "right_ascension_declination").measurements
    ra, dec = m.values[0]
    tilt = (np.pi / 2 - dec) * np.array([np.cos(ra), np.sin(ra)])
    np.testing.assert_allclose(np.degrees(tilt) * 3.6e6, [-16.617, -6.819], atol=0.01)
    sent = write((META + DATA).replace("RECEIVE", "TRANSMIT"), "b.tdm")
    (m,) = tdm(sent, "range", round_trip=True, light_time=True).measurements
    np.testing.assert_allclose(m.times[0], 14e6 / 299_792_458.0)


@pytest.mark.parametrize(
    ("change", "kind", "options", "message"),
    [
        (("", ""), "range", {}, r"whole way or half.*round_trip=True"),
        (("", ""), "range", {"stations": OTHER}, r'participants YARL, SAT.*stations=\{"YARL"'),
        (("", ""), "range", {"stations": None}, "no stations were given"),
        (("", ""), "azimuth_elevation", {}, "a.tdm has no azimuth_elevation.*range"),
        (("ANGLE_2", "TEMPERATURE"), "right_ascension_declination", {}, "both angles"),
        (("EME2000", "TOD"), "right_ascension_declination", {}, 'frame "TOD" cannot be used'),
        (("REF = START", "REF = X"), "range_rate", {}, "START, MIDDLE or END"),
        (("1,2,1", "1,2"), "range", {"light_time": True}, "does not end at station YARL"),
        (("", ""), "position", {}, "a.tdm is tracking data, not position"),
    ],
)
def test_tracking_data_that_are_refused(write, change, kind, options, message):
    path = write((META + DATA).replace(*change), "a.tdm")
    with pytest.raises(DataError, match=message):
        tdm(path, kind, **options)


HEADER = "t_s,x_m,y_m,z_m\n"


@pytest.mark.parametrize(
    ("text", "name", "kind", "options", "message"),
    [
        ("", "a.csv", "position", {}, "a.csv is empty"),
        (HEADER, "a.csv", "position", {}, "a.csv has no position"),
        (HEADER + "0,1,2\n", "a.csv", "position", {}, "line 2 has 3 of 4 values.*cut short"),
        (HEADER + "0,1,2,nan\n", "a.csv", "position", {}, 'line 2: z_m is "nan"'),
        (HEADER + "0,1,2,x\n", "a.csv", "position", {}, 'line 2: z_m is "x"'),
        (HEADER + "0,1,2,\n", "a.csv", "position", {}, "line 2: some of x_m, y_m, z_m are empty"),
        (HEADER + "1,1,2,3\n0,1,2,3\n", "a.csv", "position", {}, "time goes back"),
        (HEADER + "1,1,2,3\n1,1,2,3\n", "a.csv", "position", {}, "time repeats"),
        (HEADER + "1,1,2,3\n", "a.csv", "range", {}, "column range_m is missing for range"),
        (HEADER + "1,1,2,3\n", "a.csv", "positions", {}, r'Did you mean "position"\?'),
        (HEADER + "1,1,2,3\n", "a.csv", "position", {"every": 0}, "every is 0"),
        (HEADER + "1,1,2,3\n", "a.csv", "position", {"sigma": None}, "sigma is not stated"),
        (HEADER + "1,1,2,3\n", "a.csv", "position", {"start": EPOCH}, "cannot be placed"),
        (HEADER + "1,1,2,3\n", "a.csv", "position", {"time_scale": "TT"}, "nothing to act on"),
        (HEADER + "1,1,2,3\n", "a.csv", "position", {"frame": "TEME"}, 'frame "TEME" cannot'),
        ("# frame: TOD\n" + HEADER + "1,1,2,3\n", "a.csv", "position", {}, 'frame "TOD" cannot'),
        ("t_s,range\n1,1\n", "a.csv", "range", {}, r'"range" has no unit.*range_m, range_km'),
        ("t_s,rnge_m\n1,1\n", "a.csv", "range", {}, r'Did you mean "range_m"\?'),
        ("range_m\n1\n", "a.csv", "range", {}, "column t_s is missing"),
        ("t_s,range_m,range_km\n1,1,1\n", "a.csv", "range", {}, "say the same"),
        ("t_s,range_m\n1,1\n", "a.csv", "range", {}, "names no station, and 0 were given"),
        ("t_s,range_m,station\n1,1,A\n", "a.csv", "range", {}, r'station "A" is not given'),
        (
            "t_s,range_m,sigma_range_m\n1,1,1\n",
            "a.csv",
            "range",
            {"stations": STATION},
            "sigma is stated twice",
        ),
        (
            "t_s,ra_rad,dec_rad,sigma_ra_rad\n1,1,1,1\n",
            "a.csv",
            "right_ascension_declination",
            {},
            "sigma of dec is missing",
        ),
        ("# ways: 3\nt_s,range_m\n1,1\n", "a.csv", "range", {}, 'ways is "3"'),
        (b"PAR1", "a.parquet", "range", {}, "is not a Parquet file"),
        ("x", "a.dat", "range", {}, r'suffix "\.dat"'),
        ("x", "a.bsp", "position", {}, "read_spk"),
        ("x", "a.sp3", "range", {}, "a.sp3 is an orbit file, not range"),
        ("", "a.tdm", "range", {}, "is empty"),
        ("CCSDS_OEM_VERS = 2.0", "a.kvn", "range", {}, "is not a TDM"),
        ("CCSDS_TDM_VERS = 2.0", "a.kvn", "position", {}, "is not an OEM.*read_tdm"),
    ],
)
def test_files_that_are_refused(write, text, name, kind, options, message):
    path = write(text, name)
    with pytest.raises(UnmodeledError, match=message) as caught:
        read_measurements(path, kind, **({"sigma": 1.0} | options))
    assert caught.value.exit_code == 2


def test_missing_and_truncated_files(oem, tmp_path):
    with pytest.raises(DataError, match="there is no file"):
        read_measurements(tmp_path / "b.csv", "range", sigma=1.0)
    packed = tmp_path / "b.oem.gz"
    packed.write_bytes(gzip.compress(oem.read_bytes())[:-200])
    with pytest.raises(DataError, match="cannot be read"):
        read_measurements(packed, "position", sigma=1.0)
    short = tmp_path / "c.oem"
    short.write_bytes(b"\n".join(oem.read_bytes().splitlines()[:-3]))
    with pytest.raises(DataError, match="cut short"):
        read_measurements(short, "position", sigma=1.0)
    with pytest.raises(DataError, match="suffix"):
        write_measurements((measurement("range"),), tmp_path / "a.txt")
    with pytest.raises(DataError, match="one kind"):
        write_measurements((measurement("range"), measurement("rate")), tmp_path / "a.csv")


def kernel(path, bodies):
    """A DAF/SPK file whose bodies (target, centre, km, km/s) move in straight lines from J2000."""
    half = 40 * 86_400.0
    summaries, words = [], []
    for target, center, position, velocity in bodies:
        begin = 3 * 128 + 1 + len(words)
        words += [0.0, half]  # middle and radius of the one record, s past J2000 TDB
        for x, v in zip(position, velocity, strict=True):
            words += [x, v * half]  # Chebyshev coefficients
        words += [-half, 2 * half, 8.0, 1.0]
        summaries.append(
            struct.pack("<2d6i", -half, half, target, center, 1, 2, begin, 3 * 128 + len(words))
        )
    first = b"DAF/SPK " + struct.pack("<2i", 2, 6) + b"test".ljust(60)
    first += struct.pack("<3i", 2, 2, 3 * 128 + len(words) + 1) + b"LTL-IEEE"
    first = first.ljust(699, b"\0") + b"FTPSTR:\r:\n:\r\n:\r\x00:\x81:\x10\xce:ENDFTP"
    second = struct.pack("<3d", 0, 0, len(summaries)) + b"".join(summaries)
    third = b"".join(b"body".ljust(40) for _ in summaries)
    data = struct.pack(f"<{len(words)}d", *words)
    path.write_bytes(
        first.ljust(1024, b"\0") + second.ljust(1024, b"\0") + third.ljust(1024, b" ") + data
    )
    return path


def test_a_kernel_as_pseudo_measurements(tmp_path):
    pytest.importorskip("jplephem")
    path = kernel(
        tmp_path / "a.bsp",
        [(10, 0, (1e5, 0, 0), (0.0, 0.01, 0.0)), (2101955, 10, (1e8, 2e8, 3e8), (10.0, 20.0, 5.0))],
    )
    options = {"sigma": [1.0, 1e-3], "start": "2000-01-02T12:00:00 TDB"}
    options |= {"end": "2000-01-04T12:00:00 TDB", "step": 43_200.0, "target": 2101955}
    got = read_spk(path, "position_velocity", center=0, **options)
    (m,) = got.measurements
    np.testing.assert_allclose(m.times, np.arange(5) * 43_200.0, atol=1e-6)
    t = 86_400.0 + m.times
    np.testing.assert_allclose(m.values[:, 3:], [[1e4, 20_010.0, 5e3]] * 5, rtol=1e-9)
    # 1e-4 s of date in a double of days since J2000, times the velocity.
    np.testing.assert_allclose(m.values[:, 1], 2e11 + 20_010.0 * t, rtol=0, atol=2.0)
    with pytest.raises(DataError, match=r"has no body 399\. Allowed: 0, 10, 2101955"):
        read_spk(path, "position_velocity", center=399, **options)
    late = options | {"end": "2001-01-04T12:00:00 TDB"}
    with pytest.raises(DataError, match="does not cover all dates"):
        read_spk(path, "position_velocity", center=10, **late)
    with pytest.raises(ConfigError, match="step > 0 s"):
        read_spk(path, "position_velocity", center=10, **(options | {"step": 0.0}))
    with pytest.raises(ConfigError, match='kind is "range"'):
        read_spk(path, "range", center=10, **options)
    split = kernel(
        tmp_path / "b.bsp", [(2101955, 10, (1, 2, 3), (1, 1, 1)), (5, 0, (1, 1, 1), (0, 0, 0))]
    )
    with pytest.raises(DataError, match="does not join 2101955 and 5"):
        read_spk(split, "position_velocity", center=5, **options)
    path.write_bytes(b"nothing")
    with pytest.raises(DataError, match="is not an SPK kernel"):
        read_spk(path, "position_velocity", center=10, **options)
    with pytest.raises(DataError, match="there is no file"):
        read_spk(tmp_path / "c.bsp", "position_velocity", center=10, **options)
