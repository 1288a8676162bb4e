"""Tracking data messages: small ones made here, and the real one."""

import gzip

import numpy as np
import pytest

from unmodeled.core.errors import DataError
from unmodeled.datasets.tdm import read_tdm

META = {
    "TIME_SYSTEM": "UTC",
    "PARTICIPANT_1": "DSS-25",
    "PARTICIPANT_2": "YYYY-NNNA",
    "MODE": "SEQUENTIAL",
    "PATH": "1,2,1",
    "TIMETAG_REF": "RECEIVE",
    "ANGLE_TYPE": "RADEC",
    "REFERENCE_FRAME": "EME2000",
    "CORRECTIONS_APPLIED": "NO",
}
ROWS = [
    ("ANGLE_1", "2016-12-31T23:59:59.5Z", "90.0"),
    ("ANGLE_2", "2016-12-31T23:59:59.5Z", "-45.0"),
    ("RANGE", "2016-12-31T23:59:60.5", "1234.5"),
    ("DOPPLER_INSTANTANEOUS", "2017-001T00:00:00.5", "-1.5"),
    ("DOPPLER_INTEGRATED", "2017-001T00:00:00.5", "2.5"),
]


def tdm(*segments, version="2.0"):
    lines = [f"CCSDS_TDM_VERS = {version}", "COMMENT a test", "ORIGINATOR = TEST"]
    for meta, rows in segments:
        lines += ["META_START", "COMMENT track 7", *(f"{k} = {x}" for k, x in meta.items())]
        lines += ["META_STOP", "DATA_START", *(f"{k} = {e} {x}" for k, e, x in rows), "DATA_STOP"]
    return "\n".join(lines) + "\n"


@pytest.fixture
def write(tmp_path):
    def written(text, name="a.tdm"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return written


def test_observations_are_in_si_over_a_leap_second(write):
    got = read_tdm(write(gzip.compress(tdm((META, ROWS)).encode())))
    table = got.observations
    assert list(table.columns) == ["time_s", "kind", "value", "unit", "path", "mode", "segment"]
    assert got.epoch == "2016-12-31T23:59:59.5 UTC"
    np.testing.assert_allclose(table["time_s"], [0, 0, 1, 2, 2], atol=1e-9)
    assert list(table["kind"]) == [
        "right_ascension",
        "declination",
        "range",
        "range_rate",
        "range_rate_integrated",
    ]
    np.testing.assert_allclose(table["value"], [np.pi / 2, -np.pi / 4, 1234500, -1500, 2500])
    assert list(table["unit"]) == ["rad", "rad", "m", "m/s", "m/s"]
    assert set(table["path"]) == {"DSS-25 > YYYY-NNNA > DSS-25"}
    (segment,) = got.segments
    assert segment.participants == {1: "DSS-25", 2: "YYYY-NNNA"}
    assert (segment.angle_type, segment.frame) == ("RADEC", "EME2000")
    assert (segment.timetag, segment.corrections_applied) == ("RECEIVE", "NO")
    assert segment.comments == ("track 7",)
    assert (got.originator, got.version, got.unknown) == ("TEST", "2.0", ())


def test_ranges_in_seconds_become_metres(write):
    meta = META | {"RANGE_UNITS": "s"}
    got = read_tdm(write(tdm((meta, [("RANGE", "2016-12-31T00:00:00", "0.5")]))))
    assert got.observations["value"][0] == 299792458 / 2
    assert got.segments[0].range_units == "s"


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("AZEL", ["azimuth", "elevation"]),
        ("XEYN", ["x_east", "y_north"]),
        ("XSYE", ["x_south", "y_east"]),
    ],
)
def test_angle_types(write, kind, names):
    got = read_tdm(write(tdm((META | {"ANGLE_TYPE": kind, "REFERENCE_FRAME": ""}, ROWS[:2]))))
    assert list(got.observations["kind"]) == names


def test_frequencies_carry_their_offset(write):
    meta = META | {"FREQ_OFFSET": "8.4e9"}
    words = ("RECEIVE_FREQ_2", "RECEIVE_FREQ", "TRANSMIT_FREQ_1", "RECEIVE_FREQ_RATE")
    rows = [(k, "2017-01-01T00:00:00", "100.5") for k in words]
    got = read_tdm(write(tdm((meta, rows)))).observations
    kinds = ["receive_frequency_2", "receive_frequency", "transmit_frequency_1"]
    assert list(got["kind"]) == [*kinds, "receive_freq_rate"]
    assert list(got["value"]) == [8.4e9 + 100.5, 8.4e9 + 100.5, 100.5, 100.5]
    with pytest.raises(DataError, match='FREQ_OFFSET is "some"'):
        read_tdm(write(tdm((META | {"FREQ_OFFSET": "some"}, rows))))


def test_unknown_keywords_are_kept_and_said(write):
    got = read_tdm(write(tdm((META, [*ROWS, ("SPIN_RATE", "2017-01-01T00:00:02", "7")]))))
    last = got.observations.iloc[-1]
    assert (last["kind"], last["value"], last["unit"]) == ("spin_rate", 7.0, "")
    assert got.unknown == ("SPIN_RATE",)


def test_segments_share_one_epoch(write):
    # GPS time is 18 s ahead of UTC in 2017 and 17 s before the leap second.
    second = (META | {"TIME_SYSTEM": "GPS"}, [("RANGE", "2017-01-01T00:00:20", "1")])
    single = META | {"MODE": "SINGLE_DIFF", "PATH_1": "1,2", "PATH_2": "2,1"}
    third = (single, [("RANGE", "2017-01-01T00:00:10", "1")])
    got = read_tdm(write(tdm((META, ROWS), second, third)))
    table = got.observations
    np.testing.assert_allclose(table["time_s"][5:], [3.5, 11.5], atol=1e-9)
    assert list(table["segment"]) == [0] * 5 + [1, 2]
    assert table["path"][6] == "(YYYY-NNNA > DSS-25) - (DSS-25 > YYYY-NNNA)"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"TIME_SYSTEM": "UT1"}, r'TIME_SYSTEM is "UT1"\. Allowed: UTC'),
        ({"TIME_SYSTEM": ""}, "TIME_SYSTEM is missing"),
        ({"PARTICIPANT_1": ""}, "PARTICIPANT_1 is missing"),
        ({"PATH": "1,3"}, 'PATH = "1,3" names participant 3'),
        ({"ANGLE_TYPE": ""}, 'line 17: ANGLE_TYPE is "".*RADEC, AZEL'),
        ({"REFERENCE_FRAME": ""}, "right ascensions without REFERENCE_FRAME"),
        ({"RANGE_UNITS": "RU"}, r'RANGE_UNITS is "RU"\. Allowed: km, s'),
    ],
)
def test_metadata_that_are_refused(write, change, message):
    with pytest.raises(DataError, match=message):
        read_tdm(write(tdm((META | change, ROWS))))


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (("RANGE", "2017-01-01T00:00:00", "nan"), "not a finite number"),
        (("RANGE", "2017-01-01T00:00:00", "a"), "not a finite number"),
        (("RANGE", "2017-01-01T00:00:00", ""), "cut short"),
        (("RANGE", "yesterday", "1"), 'epoch "yesterday" cannot be read'),
        (("RANGE", "2016-12-31T00:00:00", "1"), "dates of RANGE go back"),
    ],
)
def test_bad_observations_are_named(write, row, message):
    with pytest.raises(DataError, match=rf"a\.tdm, line 22: .*{message}"):
        read_tdm(write(tdm((META, [*ROWS, row]))))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("<ndm/>", "is not a TDM in KVN.*XML"),
        ("CCSDS_OEM_VERS = 2.0", "is not a TDM in KVN.*read_trajectory"),
        ("CCSDS_TDM_VERS = 8.0", r'VERS is "8\.0"'),
        ("CCSDS_TDM_VERS = 2.0", "no observations"),
        (tdm((META, [])), "no observations"),
        (tdm((META, ROWS)).replace("DATA_STOP", ""), "ends within its data"),
        (tdm((META, ROWS)).replace("DATA_START", ""), "out of place"),
        (tdm((META, ROWS)).partition("META_STOP")[0], "ends within its metadata"),
    ],
)
def test_other_files_are_refused(write, text, message):
    with pytest.raises(DataError, match=f"(?s){message}"):
        read_tdm(write(text))


@pytest.mark.real
def test_a_telescope_track_of_a_gps_satellite(real_folder):
    path = real_folder / "tdm-optical" / "20200917_041957_001_03005A_UTA-ASTRIANet-02.tdm"
    got = read_tdm(path)
    table = got.observations
    assert (len(table), got.epoch) == (120, "2020-09-17T04:19:56.716 UTC")
    assert table["time_s"].max() == pytest.approx(572.721, abs=1e-6)
    ascension = table[table["kind"] == "right_ascension"]
    assert np.degrees(ascension["value"].iloc[0]) == pytest.approx(3.248498, abs=1e-12)
    assert len(ascension) == 60
    assert got.segments[0].frame == "EME2000"
    assert set(table["path"]) == {"03005A > UTA-ASTRIANet-02"}


def xml(meta, rows, version="2.0"):
    keys = "".join(f"<{k}>{v}</{k}>" for k, v in meta.items())
    data = "".join(
        f"<observation><EPOCH>{e}</EPOCH><{k}>{x}</{k}></observation>" for k, e, x in rows
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        f'<tdm id="CCSDS_TDM_VERS" version="{version}">'
        "<header><ORIGINATOR>TEST</ORIGINATOR></header>"
        f"<body><segment><metadata><COMMENT>track 7</COMMENT>{keys}</metadata>"
        f"<data>{data}</data></segment></body></tdm>"
    )


def test_xml_says_the_same_as_kvn(write):
    one, two = read_tdm(write(tdm((META, ROWS)))), read_tdm(write(xml(META, ROWS), "a.xml"))
    assert one.observations.equals(two.observations)
    assert (one.epoch, one.segments, one.version) == (two.epoch, two.segments, two.version)
    assert two.originator == "TEST"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<oem/>", "is not a TDM in KVN or XML"),
        (xml(META, ROWS)[:-40], "not well-formed XML.*cut short"),
        (xml(META, ROWS, "7.0"), r'VERS is "7\.0"'),
        (xml(META, []), "no observations in a segment"),
        (xml(META, [("RANGE", "2017-01-01T00:00:00", "nan")]), "observation 1: .*not a finite"),
        (xml(META, ROWS).replace("<RANGE>1234.5</RANGE>", ""), "observation 3 has EPOCH"),
        (xml(META, ROWS).replace("<ANGLE_1>", '<ANGLE_1 units="rad">'), 'units "rad".*deg'),
        (xml(META, ROWS).replace("<RANGE>", '<RANGE units="s">'), 'units "s".*Allowed: km'),
        (xml(META, ROWS[::-1]), ""),
    ],
)
def test_bad_xml(write, text, message):
    if not message:  # keyword by keyword, nothing goes back
        assert len(read_tdm(write(text)).observations) == len(ROWS)
        return
    with pytest.raises(DataError, match=message):
        read_tdm(write(text))
