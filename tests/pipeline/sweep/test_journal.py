import errno
import json
import os
import warnings

import pytest

from unmodeled.core.errors import InputError, UnmodeledWarning
from unmodeled.pipeline.sweep.journal import Journal, count_lines, read_journal
from unmodeled.pipeline.sweep.run_config import RunResult

ONE = RunResult("a" * 32, {"x": 0.1 + 0.2, "n": 3, "word": "ä\n", "bad": float("inf"), "no": None})
TWO = RunResult("b" * 32, {"x": 5e-324})


def written(folder, *results):
    journal = Journal(folder)
    for result in results:
        journal.append(result)
    return journal


def test_what_is_appended_is_read_back_to_the_last_digit(tmp_path):
    journal = written(tmp_path, ONE, TWO)
    assert list(read_journal(journal.path)) == [ONE, TWO]


def test_no_result_no_file_and_no_file_twice(tmp_path):
    written(tmp_path)
    assert list(tmp_path.iterdir()) == []
    written(tmp_path, ONE)
    written(tmp_path, TWO)
    assert len(list(tmp_path.iterdir())) == 2


def test_torn_last_line_at_every_byte(tmp_path):
    journal = written(tmp_path, ONE, TWO)
    data = journal.path.read_bytes()
    first = data.index(b"\n") + 1
    for size in range(len(data)):
        journal.path.write_bytes(data[:size])
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # a torn line is no damage
            assert list(read_journal(journal.path)) == ([ONE] if size >= first else [])


@pytest.mark.parametrize("damage", [b"\0" * 30, b'{"id": 3', b"[]", b'{"id": "x", "values": 3}'])
def test_damage_before_the_end_is_reported_and_skipped(tmp_path, damage):
    journal = written(tmp_path, ONE, TWO)
    first, second, _ = journal.path.read_bytes().split(b"\n")
    journal.path.write_bytes(b"\n".join([first, damage, second, b""]))
    with pytest.warns(UnmodeledWarning, match="line 2 is damaged; that run is computed again"):
        assert list(read_journal(journal.path)) == [ONE, TWO]


def test_every_line_is_on_the_disk_before_it_counts(tmp_path, monkeypatch):
    synced = []
    real = os.fsync
    monkeypatch.setattr(os, "fsync", lambda fd: (synced.append(os.fstat(fd).st_size), real(fd)))
    journal = written(tmp_path, ONE)
    synced.clear()
    journal.append(TWO)
    assert synced == [journal.path.stat().st_size]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT])
def test_full_disk(tmp_path, monkeypatch, code):
    """Half of the line is written, then there is no space: a sentence, and no torn line."""
    journal = written(tmp_path, ONE)
    real = os.write

    def full(fd, data):
        if len(data) < 40:
            raise OSError(code, os.strerror(code))
        return real(fd, data[: len(data) // 2])

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(InputError) as caught:
        journal.append(ONE)
    monkeypatch.undo()
    assert "no space left while writing" in str(caught.value)
    assert "Free space, then go on with: unmodeled resume" in str(caught.value)
    assert journal.path.read_bytes().endswith(b"\n")
    journal.append(TWO)  # once there is space again
    assert list(read_journal(journal.path)) == [ONE, TWO]


def test_folder_that_cannot_be_written(tmp_path, monkeypatch):
    def refused(*_):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", refused)
    with pytest.raises(InputError, match="cannot be written"):
        Journal(tmp_path).append(ONE)


def test_a_special_file_is_not_a_full_disk(tmp_path):
    with pytest.raises(FileNotFoundError):
        Journal(tmp_path / "nowhere").append(ONE)


def test_count_lines(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"1\n2\n3")
    assert count_lines(path) == (2, 5)
    path.write_bytes(b"1\n2\n3\n4\n")
    assert count_lines(path, 5) == (2, 8)


def test_lines_are_json(tmp_path):
    text = written(tmp_path, TWO).path.read_text()
    assert json.loads(text) == {"id": TWO.id, "values": TWO.values}
