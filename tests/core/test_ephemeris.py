"""Ephemerides: pairs and signs, kernels written here by hand, Kepler's equation, the pole."""

import pickle
import struct
import sys

import numpy as np
import pytest

from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, RADIUS_OF
from unmodeled.core.ephemeris import AnalyticEphemeris, KernelEphemeris, load_ephemeris
from unmodeled.core.ephemeris_pairs import PLANETS
from unmodeled.core.errors import ConfigError, DataError, OrbitError
from unmodeled.core.kepler_orbit import HeliocentricOrbit, solve_kepler
from unmodeled.core.pole import Pole

EPOCH = "2019-01-01T00:00:00 TDB"
J2000 = "2000-01-01T12:00:00 TDB"
T = np.array([0.0, 40_000.0, 86_400.0])
AU = ASTRONOMICAL_UNIT.value
ORBIT = HeliocentricOrbit.from_degrees(EPOCH, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_pairs_are_differences_and_change_sign():
    e = AnalyticEphemeris({"Rock": ORBIT})
    for body in (*PLANETS, "rock"):
        for centre in ("sun", "earth", "moon", "jupiter", "rock"):
            if body == centre:
                continue
            direct = e.position(body, centre, EPOCH, T)
            assert direct.shape == (3, 3)
            np.testing.assert_array_equal(direct, -e.position(centre, body, EPOCH, T))
            if "sun" not in (body, centre):
                by_sun = e.position(body, "sun", EPOCH, T) - e.position(centre, "sun", EPOCH, T)
                np.testing.assert_allclose(direct, by_sun, atol=1e-3)


def test_scales_of_time_are_respected():
    e = load_ephemeris()
    tdb = e.position("moon", "earth", "2019-01-01T00:01:09.184 TDB", [0.0])
    utc = e.position("moon", "earth", "2019-01-01T00:00:00 UTC", [0.0])
    late = e.position("moon", "earth", "2019-01-01T00:00:00 TDB", [69.184])
    np.testing.assert_allclose(utc, tdb, atol=3.0)  # 2 ms at 1 km/s
    np.testing.assert_allclose(late, tdb, atol=1e-3)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (("jupitr", "sun", EPOCH, T), r'has no body "jupitr"\. Allowed: sun.*mean "jupiter"'),
        (("sun", "bennu", EPOCH, T), 'has no body "bennu"'),
        (("Earth", "earth", EPOCH, T), '"earth" is both body and centre'),
        (("sun", "earth", "2019-01-01", T), 'epoch "2019-01-01" cannot be read'),
        (("sun", "earth", EPOCH, [np.nan]), "times has 1 value"),
        (("sun", "earth", EPOCH, 3.0), "times has shape"),
        (("sun", "earth", "1850-01-01T00:00:00 TT", T), "outside the analytic.*1900-01-01 to 2100"),
        (("sun", "earth", EPOCH, [0.0, 3e9]), "outside the analytic series"),
    ],
)
def test_bad_questions_are_refused(ask, message):
    with pytest.raises(DataError, match=message):
        AnalyticEphemeris().position(*ask)


def test_source_names_what_is_used_and_travels_to_workers():
    e = load_ephemeris(small_bodies={"rock": ORBIT})
    assert e.source.startswith("analytic: epv00, moon98, plan94")
    assert e.source.endswith("two-body: rock")
    assert pickle.loads(pickle.dumps(e)) == e  # noqa: S301 - workers get it this way


# A kernel has polynomials of degree 2 here, so every position is known by hand.
def kernel(path, segments, keep=None):
    """Write a DAF/SPK file: (target, centre, start, end, coefficients (n, 3, k), frame, type)."""
    pytest.importorskip("jplephem", reason="jplephem (the extra 'planets') is not installed")
    words, summaries = [], b""
    for target, centre, start, end, c, frame, kind in segments:
        n, length = len(c), (end - start) / len(c)
        first = 385 + len(words)
        for k, record in enumerate(c):
            words += [start + (k + 0.5) * length, length / 2, *np.ravel(record)]
        words += [start, length, 2 + np.size(c[0]), n]
        last = 384 + len(words)
        summaries += struct.pack("<2d6i", start, end, target, centre, frame, kind, first, last)
    ftp = b"FTPSTR:\r:\n:\r\n:\r\x00:\x81:\x10\xce:ENDFTP"
    head = struct.pack(
        "<8sii60siii8s", b"DAF/SPK ", 2, 6, b"hand", 2, 2, 385 + len(words), b"LTL-IEEE"
    )
    head = head.ljust(699, b"\0") + ftp
    table = struct.pack("<3d", 0.0, 0.0, len(segments)) + summaries
    data = b"".join(block.ljust(1024, b"\0") for block in (head, table, b" " * 1024))
    path.write_bytes((data + np.array(words, dtype="<f8").tobytes())[:keep])
    return path


SPAN = (-1e6, 1e6)
LINE = np.array([[[10.0, 2.0, 0.5], [20.0, 0.0, 0.0], [0.0, -3.0, 0.0]]])


def row(target, centre, scale=1.0, span=SPAN, frame=1, kind=2):
    return target, centre, *span, scale * LINE, frame, kind


PLAIN = (row(10, 0), row(3, 0, 2.0), row(301, 3, 7.0), row(399, 3, -1.0), row(5, 0, 4.0))


def by_hand(seconds):
    x = np.asarray(seconds) / 1e6
    return 1e3 * np.stack([10 + 2 * x + 0.5 * (2 * x * x - 1), 20 + 0 * x, -3 * x], axis=1)


@pytest.mark.parametrize(
    ("body", "centre", "factor"),
    [
        ("sun", "earth", 0.0),
        ("moon", "earth", 8.0),
        ("Earth", "moon", -8.0),
        ("moon", "sun", 8.0),
        ("jupiter", "moon", -5.0),
    ],
)
def test_kernel_adds_the_right_segments(tmp_path, body, centre, factor):
    e = KernelEphemeris(kernel(tmp_path / "k.bsp", PLAIN))
    np.testing.assert_allclose(e.position(body, centre, J2000, T), factor * by_hand(T), atol=1e-6)
    assert e.bodies == ("sun", "earth", "moon", "jupiter")
    assert e.source == "kernel k.bsp"
    again = pickle.loads(pickle.dumps(e))  # noqa: S301
    np.testing.assert_array_equal(
        again.position(body, centre, J2000, T), e.position(body, centre, J2000, T)
    )


def test_kernel_segments_follow_each_other_and_later_ones_win(tmp_path):
    parts = (
        row(10, 0, 0.0, (-1e6, 3e6)),
        row(399, 0, 1.0),
        row(399, 0, 3.0),
        row(399, 0, 5.0, (1e6, 3e6)),
    )
    e = KernelEphemeris(kernel(tmp_path / "k.bsp", parts))
    times = np.array([2.5e6, 0.0, 9e5, 1.1e6])
    seen = e.position("earth", "sun", J2000, times)
    np.testing.assert_allclose(seen[1:3], 3 * by_hand(times[1:3]), atol=1e-5)
    np.testing.assert_allclose(seen[[0, 3]], 5 * by_hand(times[[0, 3]] - 2e6), atol=1e-5)
    with pytest.raises(DataError, match=r"to 2000-02-\d\d lie outside k\.bsp"):
        e.position("earth", "sun", J2000, [0.0, 3.1e6])


def test_kernel_and_elements_together(tmp_path):
    path = kernel(tmp_path / "k.bsp", PLAIN)
    e = load_ephemeris(path, {"rock": ORBIT})
    assert e.source == "kernel k.bsp; two-body: rock"
    seen = e.position("rock", "moon", J2000, T)
    np.testing.assert_allclose(seen, ORBIT.position(J2000, T) - 8 * by_hand(T), rtol=1e-12)
    # A body that the kernel holds is the kernel's.
    whole = kernel(tmp_path / "b.bsp", (*PLAIN, row(2_101_955, 10, 9.0)))
    e = load_ephemeris(whole, {"bennu": ORBIT})
    np.testing.assert_allclose(e.position("bennu", "sun", J2000, T), 9 * by_hand(T), atol=1e-6)
    assert e.source == "kernel b.bsp"


def test_bad_kernels_are_refused(tmp_path, monkeypatch):
    good = kernel(tmp_path / "k.bsp", PLAIN)
    text = tmp_path / "t.bsp"
    text.write_text("not a kernel\n" * 200)
    short = kernel(tmp_path / "s.bsp", PLAIN, keep=3100)
    (tmp_path / "empty.bsp").write_bytes(b"")
    bare = kernel(tmp_path / "n.bsp", ())
    for path, message in [
        (tmp_path / "absent.bsp", r"there is no kernel .*absent\.bsp\. Check the path"),
        (tmp_path, "there is no kernel"),
        (text, "is not a kernel, or its head is damaged"),
        (tmp_path / "empty.bsp", "is not a kernel, or its head"),
        (short, r"is truncated: 3100 bytes\. Allowed: at least \d+ bytes\. Download it again"),
        (bare, "is truncated.*a file with segments"),
    ]:
        with pytest.raises(DataError, match=message):
            load_ephemeris(path)
    e = KernelEphemeris(good)
    with pytest.raises(DataError, match='no body "mars"'):
        e.position("mars", "sun", J2000, T)
    with pytest.raises(DataError, match=r"outside k\.bsp\. Allowed: 1999-12-20 to 2000-01-13"):
        e.position("earth", "sun", EPOCH, T)
    monkeypatch.setitem(sys.modules, "jplephem.spk", None)
    with pytest.raises(ConfigError, match=r"pip install 'unmodeled\[planets\]'"):
        load_ephemeris(good)


def test_kernels_of_other_kinds_are_refused(tmp_path):
    parts = (row(399, 0), row(4, 0, kind=21), row(5, 0, frame=17), row(10, 0), row(2_000_433, 77))
    e = KernelEphemeris(kernel(tmp_path / "k.bsp", parts))
    with pytest.raises(DataError, match=r"number 4 is of SPK type 21\. Allowed: types 2 and 3"):
        e.position("mars", "earth", J2000, T)
    with pytest.raises(DataError, match=r"number 5 has NAIF frame 17\. Allowed: frame 1"):
        e.position("jupiter", "earth", J2000, T)
    with pytest.raises(DataError, match='does not connect "eros" with "earth"'):
        e.position("eros", "earth", J2000, T)


@pytest.mark.parametrize("e", [0.0, 0.2, 0.7, 0.97, 0.9999])
def test_keplers_equation_is_solved_for_every_anomaly(e):
    mean = np.concatenate([np.linspace(-20, 20, 2001), [0.0, 1e-12, np.pi, -np.pi]])
    anomaly = solve_kepler(mean, e)
    np.testing.assert_allclose(anomaly - e * np.sin(anomaly), mean, atol=2e-14)


def test_ellipse_obeys_newton_and_the_ecliptic():
    orbit = HeliocentricOrbit.from_degrees(EPOCH, 1.3, 0.4, 12.0, 40.0, 70.0, 10.0)
    h = 3000.0
    before, at, after = orbit.position(EPOCH, [5e6 - h, 5e6, 5e6 + h])
    acceleration = (before - 2 * at + after) / h**2
    pull = -GM_OF["sun"].value * at / np.linalg.norm(at) ** 3
    # Truncation h2/12 d4r/dt4 is about (n h)^2 / 12 = 3e-8 of the pull times 1/(1-e)^3.
    np.testing.assert_allclose(acceleration, pull, atol=1e-6 * np.linalg.norm(pull))
    assert orbit.period / 86_400 == pytest.approx(365.25690 * 1.3**1.5, rel=1e-7)  # Gauss's year
    # The normal is 12 degrees from the pole of the ecliptic (right ascension 270, declination
    # 90 - 23.4392911 degrees).
    tilt = np.radians(23.4392911)
    ecliptic = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    assert np.degrees(np.arccos(orbit.normal @ ecliptic)) == pytest.approx(12.0, abs=1e-7)
    assert at @ orbit.normal == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((EPOCH, 1.0, 1.0, 0, 0, 0, 0), "eccentricity 1. Allowed: 0 <= e < 1"),
        ((EPOCH, -1.0, 0.1, 0, 0, 0, 0), "semi-major axis -1.*> 0"),
        ((EPOCH, 1.0, 0.1, np.nan, 0, 0, 0), "inclination is nan"),
    ],
)
def test_bad_elements_are_refused(values, message):
    with pytest.raises(OrbitError, match=message):
        HeliocentricOrbit.from_degrees(*values)
    with pytest.raises(OrbitError, match=r"eccentricity 1\.2"):
        solve_kepler([0.0], 1.2)


def test_pole_follows_the_iau():
    p = Pole.from_degrees(30.0, 40.0, 25.0)
    m = p.matrix()
    ra, dec = np.radians([30.0, 40.0])
    axis = [np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)]
    np.testing.assert_allclose(p.axis, axis, atol=1e-15)
    # x: at right ascension 30 + 90 degrees in the ICRF's xy-plane.
    np.testing.assert_allclose(m[0], [-np.sin(ra), np.cos(ra), 0.0], atol=1e-15)
    np.testing.assert_allclose(m @ m.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(m) == pytest.approx(1.0)
    # A quarter turn after J2000 the meridian stands 25 + 90 degrees from the node.
    spin = np.pi / 2 / 1000.0
    turned = p.body_fixed_from_icrf(J2000, [0.0, 1000.0, 4000.0], spin)
    angle = np.radians(115.0)
    meridian = np.cos(angle) * m[0] + np.sin(angle) * m[1]
    np.testing.assert_allclose(turned[1, 0], meridian, atol=1e-12)
    np.testing.assert_allclose(turned[2], turned[0], atol=1e-12)
    later = p.body_fixed_from_icrf("2000-01-01T12:16:40 TDB", [0.0], spin)
    np.testing.assert_allclose(later[0], turned[1], atol=1e-7)  # TDB - TT over 1000 s
    with pytest.raises(ConfigError, match=r"declination is 91 degrees\. Allowed: -90 to 90"):
        Pole.from_degrees(0.0, 91.0)
    with pytest.raises(ConfigError, match="right_ascension is nan"):
        Pole.from_degrees(np.nan, 1.0)


def test_tables_of_constants_agree_with_the_nominal_values():
    assert set(GM_OF) == set(RADIUS_OF) == set(PLANETS)
    # IAU 2015 nominal values and the mass ratios of IAU 2009.
    assert GM_OF["sun"].value == pytest.approx(1.3271244e20, rel=1e-8)
    assert GM_OF["earth"].value == pytest.approx(3.986004e14, rel=2e-7)
    assert GM_OF["moon"].value / GM_OF["earth"].value == pytest.approx(1.23000371e-2, rel=1e-7)
    for name, ratio in [
        ("mercury", 6.0236e6), ("venus", 4.08523719e5), ("mars", 3.09870359e6),
        ("jupiter", 1.047348644e3), ("saturn", 3.4979018e3), ("uranus", 2.290298e4),
        ("neptune", 1.941226e4),
    ]:  # fmt: skip
        assert GM_OF["sun"].value / GM_OF[name].value == pytest.approx(ratio, rel=1e-5)
    assert RADIUS_OF["sun"].value == 6.957e8
