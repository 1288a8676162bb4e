"""Orbit ephemeris messages: small ones made here, KVN and XML, and the real one."""

import gzip
import re
import time

import erfa
import numpy as np
import pytest

from unmodeled.core.earth_orientation import icrf_from_itrf, inertial_from_earth_fixed
from unmodeled.core.errors import DataError
from unmodeled.core.time import seconds_between
from unmodeled.datasets.oem import read_oem
from unmodeled.datasets.oem_writer import write_oem
from unmodeled.datasets.readers import read_trajectory
from unmodeled.datasets.trajectory import Trajectory

N, STEP = 40, 120.0
EPOCH = "2016-12-31T23:00:00 UTC"  # a leap second follows an hour later


@pytest.fixture(scope="module")
def truth(j2_orbit):
    times = np.arange(N) * STEP
    return times, *j2_orbit(12.164e6, 0.0136, times)


def date(t, day_of_year=False):
    """Two hours around the leap second at the end of 2016."""
    if t < 3600:
        day, s = ("2016-366" if day_of_year else "2016-12-31"), 82800 + t
    elif t < 3601:
        return ("2016-366" if day_of_year else "2016-12-31") + f"T23:59:{60 + t - 3600:06.3f}"
    else:
        day, s = ("2017-001" if day_of_year else "2017-01-01"), t - 3601
    return f"{day}T{int(s) // 3600:02d}:{int(s) // 60 % 60:02d}:{s % 60:06.3f}"


def meta(first, last, **changes):
    return {
        "OBJECT_NAME": "LAGEOS 2",
        "OBJECT_ID": "1992-070-B",
        "CENTER_NAME": "EARTH",
        "REF_FRAME": "ICRF",
        "TIME_SYSTEM": "UTC",
        "START_TIME": date(first),
        "STOP_TIME": date(last),
        **changes,
    }


def states(truth, part=slice(None), acc=False, day_of_year=False):
    times, r, v, a = (x[part] for x in truth)
    block = np.hstack([r, v, a] if acc else [r, v]) / 1e3
    return [
        (date(t, day_of_year), [f"{x:.15g}" for x in row])
        for t, row in zip(times, block, strict=True)
    ]


def kvn(*segments, version="2.0"):
    lines = [f"CCSDS_OEM_VERS = {version}", "COMMENT a test", "CREATION_DATE = 2017-01-02T00:00:00"]
    lines += ["ORIGINATOR = TEST", ""]
    for head, rows in segments:
        lines += ["META_START", *(f"{k:20s} = {x}" for k, x in head.items()), "META_STOP", ""]
        lines += ["COMMENT boost of 0.4 m/s", *(f"{e}  {' '.join(w)}" for e, w in rows)]
        lines += ["COVARIANCE_START", f"EPOCH = {rows[0][0] if rows else ''}", "1.0", "0.0 1.0"]
        lines += ["COVARIANCE_STOP"]
    return "\n".join(lines) + "\n"


NAMES = ["X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT", "X_DDOT", "Y_DDOT", "Z_DDOT"]


def xml(*segments, root='<ndm xmlns="urn:ccsds:schema:ndmxml">', unit="km"):
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', root]
    lines += ['<oem id="CCSDS_OEM_VERS" version="2.0"><header><COMMENT>a test</COMMENT>']
    lines += ["<ORIGINATOR>TEST</ORIGINATOR></header><body>"]
    for head, rows in segments:
        lines += ["<segment><metadata>", *(f"<{k}>{x}</{k}>" for k, x in head.items())]
        lines += ["</metadata><data><COMMENT>boost of 0.4 m/s</COMMENT>"]
        for epoch, words in rows:
            cells = [f"<{n}>{w}</{n}>" for n, w in zip(NAMES, words, strict=False)]
            cells[0] = cells[0].replace("<X>", f'<X units="{unit}">')
            lines.append(f"<stateVector><EPOCH>{epoch}</EPOCH>{''.join(cells)}</stateVector>")
        lines += ["<covarianceMatrix><CX_X>1</CX_X></covarianceMatrix></data></segment>"]
    return "\n".join([*lines, "</body></oem>", "</ndm>"])


@pytest.fixture
def write(tmp_path):
    def written(text, name="a.oem"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return written


@pytest.fixture
def whole(truth):
    return meta(0, truth[0][-1]), states(truth)


@pytest.mark.parametrize("day_of_year", [False, True])
def test_states_come_back_over_a_leap_second(truth, write, day_of_year):
    times, r, v, acc = truth
    text = kvn((meta(0, times[-1]), states(truth, day_of_year=day_of_year)))
    got = read_oem(write(text))
    np.testing.assert_allclose(got.times, times, rtol=0, atol=1e-9)
    assert (got.epoch, got.frame, got.source) == (EPOCH, "inertial", "a.oem")
    np.testing.assert_allclose(got.positions, r, rtol=1e-14)
    np.testing.assert_allclose(got.velocities, v, rtol=1e-14, atol=1e-9)
    error = np.sqrt(np.mean((got.accelerations - acc)[8:-8] ** 2))
    assert error < 3 * got.acceleration_sigma < 1e-6
    assert got.notes["comments"] == ["a test", "boost of 0.4 m/s"]
    assert got.notes["covariances"] == "1 in the file, not read"
    assert got.notes["center"] == "EARTH"
    assert got.notes["format"] == "CCSDS OEM 2.0 (KVN)"


def test_kvn_and_xml_say_the_same(whole, write):
    a = read_trajectory(write(kvn(whole)))
    b = read_trajectory(write(xml(whole), "a.xml"))
    c = read_trajectory(write(gzip.compress(xml(whole).encode()), "a.xml.gz"))
    d = read_trajectory(write(xml(whole), "a.txt"))
    for other in (b, c, d):
        np.testing.assert_array_equal(a.states, other.states)
        np.testing.assert_array_equal(a.accelerations, other.accelerations)
    alike = set(a.notes) - {"format", "created"}
    assert {k: a.notes[k] for k in alike} == {k: b.notes[k] for k in alike}


def test_accelerations_of_the_file_are_kept(truth, write):
    for text in (kvn, xml):
        got = read_oem(write(text((meta(0, truth[0][-1]), states(truth, acc=True)))))
        np.testing.assert_allclose(got.accelerations, truth[3], rtol=1e-13)
        assert got.acceleration_sigma == 0.0


def test_eme2000_is_turned_by_the_frame_bias(truth, write):
    times, r, v, acc = truth
    head = meta(0, times[-1], REF_FRAME="EME2000")
    got = read_oem(write(kvn((head, states(truth, acc=True)))))
    # The bias as three small angles, 23 mas in all [IERS2010, ch. 5].  To first order, and IAU 2000
    # where the reader has IAU 2006: they differ by 1e-12 rad (0.2 microarcseconds).
    longitude, obliquity, ascension = erfa.bi00()
    xi, eta = longitude * np.sin(np.radians(84381.448 / 3600)), obliquity
    bias = np.array([[1, ascension, -xi], [-ascension, 1, -eta], [xi, eta, 1]])
    for found, given in ((got.positions, r), (got.velocities, v), (got.accelerations, acc)):
        size = np.linalg.norm(given, axis=1).max()
        np.testing.assert_allclose(found, given @ bias, atol=2e-12 * size, rtol=0)
    angle = np.linalg.norm(got.positions - r, axis=1) / np.linalg.norm(r, axis=1)
    assert 0.5e-7 < angle.max() < 1.13e-7
    same = read_oem(write(kvn((meta(0, times[-1], REF_FRAME="J2000"), states(truth, acc=True)))))
    np.testing.assert_array_equal(same.states, got.states)


def test_itrf_is_turned_to_inertial_axes(truth, write):
    times, r, v, acc = truth
    back = np.swapaxes(icrf_from_itrf(EPOCH, times), 1, 2)
    fixed = np.einsum("nij,nj->ni", back, r)
    _, carried = inertial_from_earth_fixed(EPOCH, times, fixed, np.zeros_like(fixed))
    relative = np.einsum("nij,nj->ni", back, v - carried)
    turned = (times, fixed, relative, acc)
    head = meta(0, times[-1], REF_FRAME="ITRF-97")
    got = read_oem(write(kvn((head, states(turned, acc=True)))), accelerations=False)
    np.testing.assert_allclose(got.positions, r, atol=1e-6)
    np.testing.assert_allclose(got.velocities, v, atol=1e-8)
    assert got.accelerations is None
    assert "not used" in got.notes["accelerations_in_file"]


def test_segments_are_joined_and_gaps_stay(truth, write):
    times, r, *_ = truth
    one, two, three = slice(0, 15), slice(14, 27), slice(29, None)
    parts = [(meta(times[s][0], times[s][-1]), states(truth, s)) for s in (one, two, three)]
    got = read_oem(write(kvn(*parts)))
    keep = np.r_[0:27, 29:N]
    np.testing.assert_allclose(got.times, times[keep], rtol=0, atol=1e-9)
    np.testing.assert_allclose(got.positions, r[keep], rtol=1e-14)
    assert got.notes["segments"] == 3
    assert got.notes["states_left_out"] == 1  # the epoch that two segments share
    alone = read_oem(write(kvn(parts[1])))
    np.testing.assert_allclose(got.accelerations[14:27], alone.accelerations, rtol=1e-12)
    with pytest.raises(DataError, match="begins before the one ahead of it ends"):
        read_oem(write(kvn(parts[1], parts[0])))


def test_states_outside_the_useable_span_are_left_out(truth, write):
    times = truth[0]
    head = meta(0, times[-1], USEABLE_START_TIME=date(240.0), USEABLE_STOP_TIME=date(times[-3]))
    got = read_oem(write(kvn((head, states(truth)))), accelerations=False)
    np.testing.assert_allclose(got.times, times[2:-2], rtol=0, atol=1e-9)
    assert got.notes["states_left_out"] == 4
    assert seconds_between(EPOCH, got.epoch) == 0


def test_one_of_several_objects_is_chosen(truth, whole, write):
    other = meta(0, truth[0][-1], OBJECT_NAME="LARES", OBJECT_ID="2012-006-A")
    path = write(kvn(whole, (other, states(truth))))
    for name in ("lares", "2012-006-A"):
        assert read_oem(path, satellite=name).notes["satellite"] == "2012-006-A (LARES)"
    with pytest.raises(DataError, match=r"2 objects.*1992-070-B \(LAGEOS 2\).*option satellite"):
        read_oem(path)
    with pytest.raises(DataError, match=r'Did you mean "LARES"'):
        read_oem(path, satellite="LARS")


@pytest.mark.parametrize("scale", ["UTC", "TAI", "TT", "TDB", "GPS"])
def test_time_systems(truth, write, scale):
    rows = [(f"2016-03-13T00:{k:02d}:00.5", w) for k, (_, w) in enumerate(states(truth))]
    head = meta(0, 0, TIME_SYSTEM=scale, START_TIME=rows[0][0], STOP_TIME=rows[-1][0])
    got = read_oem(write(kvn((head, rows))), accelerations=False)
    assert got.epoch == f"2016-03-13T00:00:00.5 {scale}"
    np.testing.assert_allclose(got.times, np.arange(N) * 60.0, atol=1e-6)


@pytest.mark.parametrize("scale", [None, "UTC", "TAI", "TT", "TDB", "GPS"])
def test_round_trip(truth, tmp_path, scale):
    times, r, v, acc = truth
    made = Trajectory(times + 0.123456789, r, v, acc, epoch=EPOCH)
    path = write_oem(
        made,
        tmp_path / "b.oem",
        object_name="LAGEOS 2",
        object_id="1992-070-B",
        center_name="Earth",
        time_system=scale,
        comments=["no manoeuvre " * 30],
        accelerations=True,
    )
    assert max(len(line) for line in path.read_text().splitlines()) <= 254
    got = read_trajectory(path, center="earth")
    assert got.epoch.endswith(scale or "UTC")
    # Half a nanosecond of rounding, and as much again between the scales.
    assert got.times - got.times[0] == pytest.approx(times, abs=2e-9)
    assert seconds_between(EPOCH, got.epoch) == pytest.approx(0.123456789, abs=2e-9)
    np.testing.assert_allclose(got.positions, r, atol=0.6e-6, rtol=0)
    np.testing.assert_allclose(got.velocities, v, atol=0.6e-9, rtol=0)
    np.testing.assert_allclose(got.accelerations, acc, rtol=1e-14)


@pytest.mark.parametrize(
    ("change", "names", "message"),
    [
        ({"frame": "body_fixed"}, {}, "body_fixed frame.*inertial"),
        ({"epoch": ""}, {}, "no epoch"),
        ({}, {"object_name": " "}, "OBJECT_NAME is empty"),
        ({}, {"object_id": "Größe"}, "ASCII"),
        ({}, {"time_system": "UT1"}, "UT1.*unknown"),
        ({}, {"path": "a.xml"}, r"suffix.*plain KVN"),
    ],
)
def test_what_cannot_be_written(truth, tmp_path, change, names, message):
    made = Trajectory(*truth[:3], **{"epoch": EPOCH} | change)
    words = {"object_name": "A", "object_id": "B", "center_name": "EARTH", "path": "a.oem"} | names
    path = tmp_path / words.pop("path")
    with pytest.raises(DataError, match=f"(?s){message}"):
        write_oem(made, path, **words)
    assert not path.exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"REF_FRAME": "TEME"}, r'"TEME" about EARTH\. Allowed: ICRF, GCRF, EME2000'),
        ({"REF_FRAME": "ITRF2014", "CENTER_NAME": "MARS"}, "ITRF2014.*about MARS"),
        ({"TIME_SYSTEM": "UT1"}, r'TIME_SYSTEM is "UT1"\. Allowed: UTC, TAI, TT, TDB, GPS'),
        ({"CENTER_NAME": "SOLAR SYSTEM BARYCENTER"}, "CENTER_NAME.*a body"),
        ({"REF_FRAME": ""}, "REF_FRAME is missing"),
        ({"STOP_TIME": "2017-01-01T09:00:00"}, "cut short.*before STOP_TIME"),
        ({"STOP_TIME": "never"}, 'STOP_TIME: epoch "never" cannot be read'),
    ],
)
def test_metadata_that_are_refused(truth, write, change, message):
    for text in (kvn, xml):
        with pytest.raises(DataError, match=message):
            read_oem(write(text((meta(0, truth[0][-1], **change), states(truth)))))


def test_another_center_than_expected_is_refused(whole, write):
    with pytest.raises(DataError, match=r'CENTER_NAME is "EARTH"\. Allowed: Moon'):
        read_oem(write(kvn(whole)), center="Moon")


def test_segments_in_two_frames_are_refused(truth, write):
    a = (meta(0, truth[0][19]), states(truth, slice(0, 20)))
    b = (meta(truth[0][20], truth[0][-1], REF_FRAME="GCRF"), states(truth, slice(20, None)))
    with pytest.raises(DataError, match="REF_FRAME GCRF, ICRF"):
        read_oem(write(kvn(a, b)))


@pytest.mark.parametrize(
    ("row", "value", "message"),
    [
        (3, ("2016-12-31T23:06:00.000", ["1"] * 5), "5 numbers.*6 "),
        (3, ("2016-12-31T23:06:00.000", ["1"] * 9), "9 numbers.*the same in a segment"),
        (3, ("2016-12-31T23:06:00.000", ["1", "nan", "1", "1", "1", "1"]), "not finite"),
        (3, ("2016-12-31T23:06:00.000", ["1", "x", "1", "1", "1", "1"]), "not finite"),
        (3, ("2016-12-31T23:00:00.000", ["1"] * 6), "time goes back"),
        (3, ("2016-12-31T23:04:00.000", ["1"] * 6), "time repeats"),
        (3, ("2016-02-30T23:06:00.000", ["1"] * 6), "does not exist"),
        (3, ("2016-367T23:06:00.000", ["1"] * 6), "does not exist"),
        (3, ("2016-12-31T24:06:00.000", ["1"] * 6), "does not exist"),
        (3, ("2016-12-31", ["1"] * 6), "cannot be read"),
    ],
)
def test_bad_states_are_named(whole, write, row, value, message):
    head, rows = whole
    rows = [*rows[:row], value, *rows[row + 1 :]]
    with pytest.raises(DataError, match=rf"a\.oem, line 20.*{message}"):
        read_oem(write(kvn((head, rows))))


def test_z_means_utc(truth, write):
    rows = [(e + "Z", w) for e, w in states(truth)]
    assert read_oem(write(kvn((meta(0, truth[0][-1]), rows))), accelerations=False).epoch == EPOCH
    with pytest.raises(DataError, match=r"ends in Z.*TIME_SYSTEM is TAI"):
        read_oem(write(kvn((meta(0, truth[0][-1], TIME_SYSTEM="TAI"), rows))))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("what is this", "is not an OEM"),
        ("COMMENT only", "is not an OEM"),
        ("CCSDS_TDM_VERS = 2.0", r"is not an OEM.*read_tdm"),
        ("CCSDS_OEM_VERS = 9.0", r'VERS is "9\.0"\. Allowed: 1\.0, 2\.0, 3\.0'),
        ("CCSDS_OEM_VERS = 2.0\nORIGINATOR = A", "has no segments"),
        ("CCSDS_OEM_VERS = 2.0\nMETA_START\nOBJECT_NAME = A", "ends within its metadata"),
        ("CCSDS_OEM_VERS = 2.0\nMETA_START\nMETA_STOP\nA = 1", '"A" is out of place'),
        ("<ndm><tdm/></ndm>", r"is not an OEM.*read_tdm"),
        ("<ndm><oem", "not well-formed XML.*cut short"),
        ('<oem version="7"/>', r'VERS is "7"'),
        ('<oem version="2.0"/>', "has no segments"),
        (b"\x1f\x8b broken", "cannot be read"),
        (b"\xff\xfe\x00", "is not an OEM"),
        (b"<\x00>", "not well-formed XML"),
    ],
)
def test_other_files_are_refused(write, text, message):
    with pytest.raises(DataError, match=f"(?s){message}"):
        read_oem(write(text))


def test_entities_are_not_expanded(whole, write):
    bomb = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]>\n<ndm>'
    text = xml(whole).split("\n", 2)[2]
    with pytest.raises(DataError, match="document type or entities"):
        read_oem(write(bomb + text))


def test_a_comment_in_latin_1_does_no_harm(whole, write):
    text = (
        kvn(whole).replace("boost", "man\u0153uvre \xe9t\xe9").encode("latin-1", errors="replace")
    )
    assert len(read_oem(write(text), accelerations=False)) == N


def test_an_end_between_two_samples_is_not_a_cut(truth, write):
    head = meta(0, truth[0][-1] + 0.9 * STEP)
    assert len(read_oem(write(kvn((head, states(truth)))), accelerations=False)) == N
    head = meta(0, truth[0][-1] + STEP)
    with pytest.raises(DataError, match="end 120 s before STOP_TIME"):
        read_oem(write(kvn((head, states(truth)))))


def test_xml_states_are_checked(whole, write):
    with pytest.raises(DataError, match=r'state 1: X has units "m"\. Allowed: km'):
        read_oem(write(xml(whole, unit="m")))
    with pytest.raises(DataError, match="state 1: Y is missing"):
        read_oem(write(re.sub("<Y>.*</Y>", "", xml(whole))))
    with pytest.raises(DataError, match="without states"):
        read_oem(write(xml((whole[0], []))))


@pytest.mark.real
def test_the_space_station(real_folder):
    path = real_folder / "oem-iss" / "ISS.OEM_J2K_EPH_2022-042.xml.gz"
    began = time.perf_counter()
    got = read_trajectory(path, satellite="ISS", center="Earth", accelerations=False)
    assert time.perf_counter() - began < 5
    assert (len(got), got.epoch) == (5524, "2022-02-11T12:00:00 UTC")
    assert got.times[-1] == 15 * 86400
    assert got.notes["frame"].startswith("EME2000")
    assert any("GMT057 Reboost" in c for c in got.notes["comments"])
    gm = 3.986004415e14
    energy = np.sum(got.velocities**2, axis=1) / 2 - gm / got.radii
    assert np.mean(-gm / (2 * energy)) == pytest.approx(6796e3, abs=5e3)
    pole = np.cross(got.positions, got.velocities)
    inclination = np.degrees(np.arccos(pole[:, 2] / np.linalg.norm(pole, axis=1)))
    assert np.mean(inclination) == pytest.approx(51.6, abs=0.3)
