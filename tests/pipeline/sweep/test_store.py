import errno

import pyarrow.parquet as pq
import pytest

from unmodeled.core.errors import DataError, InputError
from unmodeled.pipeline.sweep.compaction import read_rows, write_rows
from unmodeled.pipeline.sweep.journal import Journal
from unmodeled.pipeline.sweep.run_config import RunResult
from unmodeled.pipeline.sweep.store import Store

ROWS = {
    "b" * 32: {"x": 0.1, "n": 3, "word": "w", "flag": True},
    "a" * 32: {"x": float("inf"), "n": 4},
    "c" * 32: {"x": 2, "word": ""},
}


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "store")
    store.create()
    return store


def put(store, *names):
    journal = Journal(store.journals)
    for name in names:
        journal.append(RunResult(name, ROWS[name]))
    return journal


def test_table_round_trip_and_bytes(tmp_path):
    write_rows(ROWS, tmp_path / "a.parquet")
    assert read_rows(tmp_path / "a.parquet") == ROWS
    write_rows(dict(reversed(ROWS.items())), tmp_path / "b.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    assert pq.read_table(tmp_path / "a.parquet").num_rows == 3
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.parquet", "b.parquet"]


def test_empty_table(tmp_path):
    write_rows({}, tmp_path / "a.parquet")
    assert read_rows(tmp_path / "a.parquet") == {}


def test_mixed_column_and_damaged_table(tmp_path):
    with pytest.raises(DataError, match=r"column x are float and str|column x are int and str"):
        write_rows({"a": {"x": 1}, "b": {"x": "one"}}, tmp_path / "a.parquet")
    (tmp_path / "a.parquet").write_bytes(b"PAR1 half")
    with pytest.raises(DataError, match="cannot be read"):
        read_rows(tmp_path / "a.parquet")


def test_finished_is_the_union(store):
    assert store.finished() == {}
    put(store, "b" * 32)
    assert store.compact() == 1
    assert not list(store.journals.iterdir())
    put(store, "a" * 32)
    put(store, "c" * 32)
    assert store.finished() == ROWS
    assert store.compact() == 3
    assert store.finished() == ROWS


def test_killed_between_table_and_removal(store):
    journal = put(store, *ROWS)
    data = journal.path.read_bytes()
    store.compact()
    journal.path.write_bytes(data)  # as if the removal had not happened
    assert store.finished() == ROWS
    assert store.compact() == 3
    assert store.finished() == ROWS


def test_full_disk_in_compaction_leaves_everything(store, monkeypatch):
    put(store, "b" * 32)
    store.compact()
    before = store.compacted.read_bytes()
    put(store, "a" * 32)

    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(InputError, match="no space left"):
        store.compact()
    assert store.compacted.read_bytes() == before
    assert set(store.finished()) == {"a" * 32, "b" * 32}
    assert not list(store.folder.glob(".results*"))


def test_appended_counts_new_lines_only(store):
    journal = put(store, "a" * 32)
    assert store.appended() == 1
    assert store.appended() == 0
    journal.append(RunResult("b" * 32, {}))
    put(store, "c" * 32)
    assert store.appended() == 2


def test_one_driver_at_a_time(store):
    with store.lock():
        for name in ("", "1-of-2"):
            with (
                pytest.raises(InputError, match=r"another process works on .* --shard i/n"),
                Store(store.folder).lock(name),
            ):
                pass
    with store.lock("1-of-2"):
        with Store(store.folder).lock("2-of-2"):
            pass
        for name in ("", "1-of-2"):
            with pytest.raises(InputError, match="another process"), store.lock(name):
                pass
    with store.lock():
        pass


def test_folders(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file"):
        Store(tmp_path / "file").create()
    with pytest.raises(InputError, match="holds files that are not a sweep"):
        Store(tmp_path).create()
    with pytest.raises(InputError, match="is not the folder of a sweep, seen from"):
        Store(tmp_path).require()
