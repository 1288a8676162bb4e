"""SP3 files: a small one made here, in all its dirty variants, and the real ones."""

import gzip

import numpy as np
import pytest

from unmodeled.core.earth_orientation import icrf_from_itrf, inertial_from_earth_fixed
from unmodeled.core.errors import DataError, UnmodeledWarning
from unmodeled.core.time import convert_epoch, seconds_between
from unmodeled.datasets.sp3 import read_sp3
from unmodeled.datasets.sp3_format import read_sp3_table

N, STEP = 48, 120.0


@pytest.fixture(scope="module")
def truth(j2_orbit):
    """Inertial states, and Earth-fixed ones with the velocity relative to the rotating Earth."""
    times = np.arange(N) * STEP
    r, v, acc = j2_orbit(12.164e6, 0.0136, times)
    epoch = "2016-03-13T00:00:00 UTC"
    back = np.swapaxes(icrf_from_itrf(epoch, times), 1, 2)
    fixed = np.einsum("nij,nj->ni", back, r)
    # v_inertial = turn(fixed, v_fixed) is affine in v_fixed: solve for it.
    _, carried = inertial_from_earth_fixed(epoch, times, fixed, np.zeros_like(fixed))
    relative = np.einsum("nij,nj->ni", back, v - carried)
    return times, r, v, acc, fixed, relative


def sp3(truth, *, version="c", mode="V", system="UTC", ids=("L52",), eof=True, count=N, scale=1.0):
    times, _, _, _, fixed, relative = truth
    listed = "".join(ids).ljust(51, " ")
    lines = [
        f"#{version}{mode}2016  3 13  0  0  0.00000000    {count:4d}   SLR SLR08 FIT TEST",
        "## 1888      0.00000000   120.00000000 57460 0.0000000000000",
        f"+   {len(ids):2d}   {listed}",
        "++         0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0  0",
        f"%c L  cc {system} ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc",
        "%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc",
        "%f  0.0000000  0.000000000  0.00000000000  0.000000000000000",
        "/* made by a test",
    ]
    for k, t in enumerate(times):
        hour, minute = divmod(int(t) // 60, 60)
        lines.append(f"*  2016  3 13 {hour:2d} {minute:2d}  0.00000000")
        for i in ids:
            km, dm = fixed[k] / 1e3, relative[k] * 10 * scale
            lines.append(f"P{i}" + "".join(f"{x:14.6f}" for x in km) + " 999999.999999")
            if mode == "V":
                lines.append(f"V{i}" + "".join(f"{x:14.6f}" for x in dm) + " 999999.999999")
    return "\n".join(lines + (["EOF"] if eof else [])) + "\n"


@pytest.fixture
def write(tmp_path):
    def written(text, name="a.sp3"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return written


def test_states_come_back_inertial(truth, write):
    times, r, v, acc, *_ = truth
    got = read_sp3(write(sp3(truth)))
    np.testing.assert_array_equal(got.times, times)
    assert got.epoch == "2016-03-13T00:00:00 UTC"
    assert (got.frame, got.source) == ("inertial", "a.sp3")
    np.testing.assert_allclose(got.positions, r, atol=0.6e-3)  # printed to 1 mm
    np.testing.assert_allclose(got.velocities, v, atol=1.5e-7)  # printed to 1e-7 m/s
    error = np.sqrt(np.mean((got.accelerations - acc)[8:-8] ** 2))
    assert error < 3 * got.acceleration_sigma < 1e-8
    assert got.notes["time_system"] == "UTC"


def test_body_fixed_axes_hold_the_inertial_velocity(truth, write):
    path = write(sp3(truth))
    fixed, inertial = read_sp3(path, frame="body_fixed"), read_sp3(path)
    np.testing.assert_allclose(fixed.positions, truth[4], atol=0.6e-3)
    for name in ("positions", "velocities", "accelerations"):
        one, other = getattr(fixed, name), getattr(inertial, name)
        np.testing.assert_allclose(
            np.linalg.norm(one, axis=1), np.linalg.norm(other, axis=1), rtol=1e-13
        )
    assert fixed.frame == "body_fixed"


def test_positions_alone_get_velocities_from_the_smoother(truth, write):
    got = read_sp3(write(sp3(truth, mode="P")))
    assert got.notes["velocities"] == "from the smoother; the file has none"
    np.testing.assert_allclose(got.velocities[8:-8], truth[2][8:-8], atol=2e-5)
    assert np.abs(got.accelerations - truth[3])[8:-8].max() < 1e-6
    bare = read_sp3(write(sp3(truth, mode="P")), accelerations=False)
    assert bare.accelerations is None


@pytest.mark.parametrize(
    ("system", "instant"),
    [
        ("UTC", "2016-03-13T00:00:00 UTC"),
        ("GLO", "2016-03-13T00:00:00 UTC"),
        ("TAI", "2016-03-13T00:00:00 TAI"),
        ("GPS", "2016-03-13T00:00:00 GPS"),
        ("ccc", "2016-03-13T00:00:00 GPS"),
        ("BDT", "2016-03-13T00:00:14 GPS"),
    ],
)
def test_the_header_rules_the_time_system(truth, write, system, instant):
    table = read_sp3_table(write(sp3(truth, system=system)))
    assert seconds_between(table.epoch, instant) == 0.0
    np.testing.assert_array_equal(table.times, truth[0])


def test_gzip_and_version_a(truth, write):
    text = sp3(truth, version="a", system="ccc", ids=("  1", "  2"))
    got = read_sp3_table(write(gzip.compress(text.encode()), "a.sp3.gz"), "2")
    assert got.satellite == "G02"
    assert got.notes["format"] == "SP3-a"
    np.testing.assert_allclose(got.positions, truth[4], atol=0.6e-3)
    assert read_sp3_table(write(text), "G01").satellite == "G01"


def test_minute_60_is_the_next_hour_and_a_blank_may_lack(truth, write):
    text = sp3(truth).replace("*  2016  3 13  1  0 ", "* 2016  3 13  0 60 ")
    np.testing.assert_array_equal(read_sp3_table(write(text)).times, truth[0])


def test_a_leap_second_between_two_epochs(truth, write):
    text = sp3(truth).replace("2016  3 13  0  0", "2016 12 31 23 59").replace(
        "2016  3 13  0", "2017  1  1  0"
    )  # fmt: skip
    text = text.replace("2016  3 13  1", "2017  1  1  1")
    times = read_sp3_table(write(text.replace("#cV", "#cP").replace("\nVL52", "\nXL52"))).times
    assert times[1] == 3 * 60 + 1.0  # 23:59 to 00:02


def test_absent_records_are_left_out_and_counted(truth, write):
    lines = sp3(truth).splitlines()
    p = [k for k, s in enumerate(lines) if s.startswith("PL52")]
    v = [k for k, s in enumerate(lines) if s.startswith("VL52")]
    zero, nines = f"{0:14.6f}" * 3, " 999999.999999" * 3
    lines[p[5]] = "PL52" + zero + " 999999.999999"
    lines[v[9]] = "VL52" + nines + " 999999.999999"
    table = read_sp3_table(write("\n".join(lines)))
    assert table.notes["samples_absent"] == 2
    np.testing.assert_array_equal(table.times, np.delete(truth[0], [5, 9]))


def test_velocities_in_metres_per_second_are_noticed(truth, write):
    path = write(sp3(truth, scale=0.1))
    with pytest.warns(UnmodeledWarning, match="velocities in m/s where SP3 says dm/s"):
        got = read_sp3(path)
    np.testing.assert_allclose(got.velocities, truth[2], atol=1.5e-6)
    with pytest.raises(DataError, match="velocities do not fit the positions"):
        read_sp3(write(sp3(truth, scale=3.0)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: "", r"a\.sp3 is empty"),
        (lambda s: "x,y,z\n1,2,3\n", r'is not an SP3 file: it begins "x,y,z"'),
        (lambda s: s[:400], "ends within its header"),
        (lambda s: s[: len(s) // 2].rsplit("*", 1)[0], r"cut short: it has \d+ of 48 epochs"),
        (lambda s: s[:-60], r"line \d+: record .* is cut short or not numeric"),
        (lambda s: s.replace("UTC", "UTX"), 'time system "UTX".*did you mean "UTC"'),
        (lambda s: s.replace("  3 13  0  2", "  3 xx  0  2"), r"line \d+: epoch .* cannot be read"),
        (lambda s: s.replace("L52", "  0", 1), "lists no satellites"),
        (lambda s: s.replace("\nP", "\nX"), "no usable record of satellite L52"),
        (lambda s: s.replace("2016  3 13", "1971  3 13"), "lies before 1972-01-01"),
    ],
)
def test_bad_files_are_refused(truth, write, change, message):
    with pytest.raises(DataError, match=f"(?is){message}"):
        read_sp3(write(change(sp3(truth))))


def test_bad_requests_are_refused(truth, write, tmp_path):
    path = write(sp3(truth, ids=("G01", "G02")))
    with pytest.raises(DataError, match=r"has 2 satellites\. Allowed: G01, G02\. Choose one"):
        read_sp3(path)
    with pytest.raises(DataError, match=r'no satellite "G03"\. Did you mean "G0[12]"'):
        read_sp3(path, satellite="G03")
    with pytest.raises(DataError, match=r'frame "itrf" is unknown'):
        read_sp3(path, frame="itrf")
    with pytest.raises(DataError, match="there is no file"):
        read_sp3(tmp_path / "absent.sp3")
    broken = write(gzip.compress(sp3(truth).encode())[:300], "b.sp3.gz")
    with pytest.raises(DataError, match=r"b\.sp3\.gz cannot be read"):
        read_sp3(broken)


@pytest.mark.real
@pytest.mark.parametrize("name", ["ilrsa", "ilrsb"])
def test_lageos_2(real_folder, name):
    path = real_folder / "sp3-lageos2" / f"{name}.orb.lageos2.160319.v35.sp3"
    got = read_sp3(path)
    assert len(got) == 5040
    assert got.epoch == "2016-03-13T00:00:00 UTC"
    # The folder's README: r 11995.7..12328.9 km.
    assert got.radii.min() == pytest.approx(11995.7e3, abs=50)
    assert got.radii.max() == pytest.approx(12328.9e3, abs=50)
    energy = np.sum(got.velocities**2, axis=1) / 2 - 3.986004415e14 / got.radii
    a = -3.986004415e14 / 2 / energy
    assert np.median(a) == pytest.approx(12.164e6, abs=2e3)
    assert 2 * np.pi * np.sqrt(np.median(a) ** 3 / 3.986004415e14) / 60 == pytest.approx(
        222.5, abs=0.1
    )
    # Accelerations: point mass and J2 explain all but 4e-6 of it; the rest is field and Moon.
    assert 1e-9 < got.acceleration_sigma < 1e-8
    gravity = -3.986004415e14 * got.positions / got.radii[:, None] ** 3
    part = np.linalg.norm(got.accelerations - gravity, axis=1)
    assert np.median(part) == pytest.approx(1.212e-3, rel=2e-3)


@pytest.mark.real
def test_gps_in_version_a_is_gps_time(real_folder):
    path = real_folder / "sp3-gps-nga" / "NGA0OPSRAP_20251850000_01D_15M_ORB.SP3.gz"
    got = read_sp3(path, satellite="G01")
    assert convert_epoch(got.epoch, "UTC") == "2025-07-03T23:59:42 UTC"
    assert got.radii.min() == pytest.approx(26545e3, abs=1e3)
    assert got.radii.max() == pytest.approx(26577e3, abs=1e3)


@pytest.mark.real
def test_topex_in_tai_and_metres_per_second(real_folder):
    (path,) = (real_folder / "sp3-leo-altimetry" / "topex").glob("*.sp3")
    with pytest.warns(UnmodeledWarning, match="velocities in m/s"):
        got = read_sp3(path, accelerations=False)
    assert got.epoch == "1997-12-10T12:00:00 TAI"
    assert got.radii.min() == pytest.approx(7714.6e3, abs=100)
    assert got.radii.max() == pytest.approx(7718.0e3, abs=100)
