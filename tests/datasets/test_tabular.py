"""CSV and Parquet: round trips to the last bit, units, and every bad input."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from unmodeled.core.errors import DataError
from unmodeled.datasets.tabular import (
    read_csv,
    read_parquet,
    write_csv,
    write_parquet,
    write_trajectory,
)
from unmodeled.datasets.trajectory import Trajectory

EPOCH = "2016-03-13T00:00:00 UTC"
HEADER = "t_s,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s"


@pytest.fixture(scope="module")
def orbit(j2_orbit):
    times = np.arange(60) * 120.0 + 1 / 3
    r, v, acc = j2_orbit(12.164e6, 0.0136, times)
    return Trajectory(times, r, v, acc, "inertial", "test orbit", EPOCH, 1.5e-9)


@pytest.fixture
def csv(tmp_path):
    def written(text):
        path = tmp_path / "a.csv"
        path.write_text(text)
        return path

    return written


def rows(n=8, start=0, step=10):
    """Samples on a circle, far from a body."""
    lines = []
    for k in range(start, start + n):
        a = 1e-2 * k
        r = 1000 * np.cos(a), 1000 * np.sin(a), 1.0
        v = -np.sin(a), np.cos(a), 0.0
        lines.append(",".join(repr(float(q)) for q in (k * step, *r, *v)))
    return lines


@pytest.mark.parametrize(
    ("write", "read", "name"),
    [(write_csv, read_csv, "a.csv"), (write_parquet, read_parquet, "a.parquet")],
)
def test_round_trip_to_the_last_bit(orbit, tmp_path, write, read, name):
    got = read(write(orbit, tmp_path / name))
    for part in ("times", "positions", "velocities", "accelerations"):
        np.testing.assert_array_equal(getattr(got, part), getattr(orbit, part))
    for part in ("frame", "source", "epoch", "acceleration_sigma"):
        assert getattr(got, part) == getattr(orbit, part)
    again = tmp_path / f"again-{name}"
    write(got, again)
    assert again.read_bytes() == (tmp_path / name).read_bytes()


def test_the_suffix_chooses_the_writer(orbit, tmp_path):
    assert len(read_csv(write_trajectory(orbit, tmp_path / "a.csv"))) == len(orbit)
    assert len(read_parquet(write_trajectory(orbit, str(tmp_path / "a.parquet")))) == len(orbit)
    with pytest.raises(DataError, match=r'suffix "\.txt"\. Allowed: \.csv, \.parquet'):
        write_trajectory(orbit, tmp_path / "a.txt")


def test_kilometres_hours_and_any_order_of_columns(orbit, csv):
    lines = ["z_km,x_km,y_km,vx_km_s,vy_km_s,vz_km_s,t_h,ax_km_s2,ay_km_s2,az_km_s2"]
    for t, r, v, a in zip(
        orbit.times, orbit.positions, orbit.velocities, orbit.accelerations, strict=True
    ):
        cells = [r[2] / 1e3, r[0] / 1e3, r[1] / 1e3, *(v / 1e3), t / 3600, *(a / 1e3)]
        lines.append(",".join(repr(float(c)) for c in cells))
    got = read_csv(csv("\n".join(lines)))
    np.testing.assert_allclose(got.times, orbit.times, rtol=1e-15)
    np.testing.assert_allclose(got.positions, orbit.positions, rtol=1e-15)
    np.testing.assert_allclose(got.accelerations, orbit.accelerations, rtol=1e-15)
    assert (got.frame, got.source, got.epoch) == ("inertial", "a.csv", "")


def test_dates_instead_of_seconds(csv):
    header = HEADER.replace("t_s", "time_utc")
    clock = ["2016-12-31T23:59:58", "2016-12-31T23:59:59", "2016-12-31T23:59:60Z"]
    clock += [f"2017-01-01 00:00:0{k}" for k in range(5)]
    body = [f"{d},{line.split(',', 1)[1]}" for d, line in zip(clock, rows(), strict=True)]
    got = read_csv(csv("\n".join([header, *body])), accelerations=False)
    np.testing.assert_array_equal(got.times, np.arange(8))
    assert got.epoch == "2016-12-31T23:59:58 UTC"
    fact = "# epoch: 2016-12-31T00:00:00 UTC"
    later = read_csv(csv("\n".join([fact, header, *body])), accelerations=False)
    np.testing.assert_array_equal(later.times, np.arange(8) + 86398)


def test_missing_accelerations_and_velocities_come_from_the_smoother(orbit, csv):
    full = orbit.accelerations
    bare = Trajectory(orbit.times, orbit.positions, orbit.velocities, epoch=EPOCH)
    path = write_csv(bare, csv(""))
    got = read_csv(path)
    assert got.notes["accelerations"]["method"].endswith("positions and velocities")
    assert 0 < got.acceleration_sigma < 1e-9
    assert np.abs(got.accelerations - full).max() < 1e-6
    assert read_csv(path, accelerations=False).accelerations is None
    lines = [
        line if line.startswith("#") else ",".join(line.split(",")[:4])
        for line in path.read_text().splitlines()
    ]
    alone = read_csv(csv("\n".join(lines)))
    assert alone.notes["velocities"] == "from the smoother; the file has none"
    np.testing.assert_allclose(alone.velocities[5:-5], orbit.velocities[5:-5], atol=1e-5)


def with_header(header):
    return "\n".join([header, *rows()])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"a\.csv is empty\. Allowed: a header line and samples"),
        ("# frame: inertial\n", r"a\.csv is empty"),
        (HEADER, r"a\.csv has 0 samples\. Allowed: at least 4"),
        ("\n".join([HEADER, *rows(3)]), r"a\.csv has 3 samples\. Allowed: at least 4"),
        (with_header(HEADER.replace("z_m,", "")), r"column z_m is missing\. Allowed: x_m, y_m"),
        (with_header(HEADER.replace("t_s,", "")), r"column t_s is missing\. Allowed: t_s, or"),
        (with_header(HEADER.replace("vz_m_s", "az_m_s2")), r"column vz_m_s is missing"),
        (with_header(HEADER.replace("y_m", "y")), r'column "y" has no unit\. Allowed: y_m, y_km'),
        (with_header(HEADER.replace("y_m", "y_ft")), r'column "y_ft" has an unknown unit'),
        (with_header(HEADER.replace("t_s", "time_ut")), r'"time_ut" is unknown.*"time_utc"'),
        (with_header(HEADER.replace("y_m", "x_km")), r'columns "x_m" and "x_km" say the same'),
        (with_header(HEADER.replace(",y_m", ",time_tt")), r'"t_s" and "time_tt" say the same'),
        (
            "\n".join([HEADER, *rows(4), "40,nan,0,0,0,0,0", *rows(3, 5)]),
            r"line 6: x_m is missing or not finite \(1 such value\(s\)\).*repair",
        ),
        ("\n".join([HEADER, *rows(4), "40,,0,0,0,0,0"]), r"line 6: x_m is missing"),
        ("\n".join([HEADER, *rows(4), "40,1,2,x,0,0,0"]), r'line 6: z_m is "x"\. Allowed'),
        ("\n".join([HEADER, *rows(6), "60,1,2"]), r"line 8 has 3 of 7 values.*cut short"),
        ("\n".join([HEADER, *rows(4, 4), *rows(4)]), r"line 6: time goes back.*[Ss]ort"),
        ("\n".join([HEADER, *rows(4), *rows(4, 3)]), r"line 6: time repeats.*duplicates"),
        ("# epoch: 2016\n" + with_header(HEADER), r'epoch "2016" cannot be read'),
        ("# frame: rtn\n" + with_header(HEADER), "cannot be smoothed in the rtn frame"),
        ("# acceleration_sigma_m_s2: -1\n" + with_header(HEADER), r'sigma_m_s2 is "-1"'),
        (
            with_header(HEADER.replace("t_s", "time_utc")),
            r'a\.csv: date 1, "0\.0", cannot be read',
        ),
    ],
)  # fmt: skip
def test_bad_tables_are_refused(csv, text, message):
    with pytest.raises(DataError, match=message):
        read_csv(csv(text))


def test_bad_files_are_refused(tmp_path):
    for read in (read_csv, read_parquet):
        with pytest.raises(DataError, match=r"there is no file .*absent"):
            read(tmp_path / "absent")
    path = tmp_path / "a.parquet"
    path.write_text("not parquet")
    with pytest.raises(DataError, match=r"a\.parquet is not a Parquet file"):
        read_parquet(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match="cannot be read as text"):
        read_csv(path)
    cells = {"t_s": [0.0, 1.0, None], **{f"{q}_m": [1.0, 2.0, 3.0] for q in "xyz"}}
    pq.write_table(pa.table(cells), path)
    with pytest.raises(DataError, match="row 3: t_s is missing or not finite"):
        read_parquet(path)


def test_a_body_fixed_table_needs_its_accelerations(orbit, tmp_path):
    fixed = Trajectory(orbit.times, orbit.positions, orbit.velocities, frame="body_fixed")
    path = write_csv(fixed, tmp_path / "a.csv")
    with pytest.raises(DataError, match="cannot be smoothed in the body_fixed frame"):
        read_csv(path)
    assert read_csv(path, accelerations=False).frame == "body_fixed"
