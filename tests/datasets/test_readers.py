"""The door to all readers."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.readers import READERS, read_trajectory
from unmodeled.datasets.tabular import write_csv, write_parquet
from unmodeled.datasets.trajectory import Trajectory


@pytest.fixture
def circle():
    a = np.linspace(0, 1, 20)
    r = 1e3 * np.stack([np.cos(a), np.sin(a), 0 * a + 0.1], axis=1)
    return Trajectory(a * 1e3, r, np.gradient(r, a * 1e3, axis=0), r * -1e-6)


@pytest.mark.parametrize(("name", "write"), [("a.CSV", write_csv), ("a.b.parquet", write_parquet)])
def test_the_suffix_chooses_the_reader(circle, tmp_path, name, write):
    got = read_trajectory(write(circle, tmp_path / name), accelerations=False)
    np.testing.assert_array_equal(got.states, circle.states)


@pytest.mark.parametrize("name", ["a.sp3", "a.SP3.gz", "a.eph"])
def test_sp3_files_reach_the_sp3_reader(tmp_path, name):
    path = tmp_path / name
    path.write_text("no such thing")
    with pytest.raises(DataError, match="is not an SP3 file"):
        read_trajectory(path, satellite="L52")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.sp4", r'suffix "\.sp4".*did you mean "\.sp3"'),
        ("a", r'a has suffix "".*\.csv, \.eph, \.kvn, \.oem, \.parquet, \.sp3'),
        ("a.csv.gz", r'suffix "\.csv\.gz"'),
        (".csv.gz", "suffix"),
    ],
)
def test_unknown_suffixes_are_refused(name, message):
    with pytest.raises(DataError, match=f"(?i){message}"):
        read_trajectory(name)


def test_unknown_options_are_refused():
    with pytest.raises(ConfigError, match=r'\.csv have no option "satellite"'):
        read_trajectory("a.csv", satellite="L52")


def test_every_reader_takes_the_option_accelerations():
    for suffix in READERS:
        with pytest.raises(DataError, match="there is no file"):
            read_trajectory(f"/absent/a{suffix}", accelerations=False)
