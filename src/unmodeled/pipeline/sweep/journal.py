"""The append-only journal: one line for each finished run, on the disk before it counts."""

from __future__ import annotations

import errno
import json
import os
import platform
import secrets
import warnings
from collections.abc import Iterator
from pathlib import Path

from unmodeled.core.errors import InputError, UnmodeledWarning
from unmodeled.pipeline.sweep.run_config import RunResult

__all__ = ["Journal", "count_lines", "read_journal", "storage_error"]

_FULL = (errno.ENOSPC, errno.EDQUOT)
_FORBIDDEN = (errno.EACCES, errno.EROFS, errno.EPERM)


class Journal:
    """Writer of one worker. Its file is its own: nobody else ever appends to it.

    Parameters
    ----------
    folder : Path
        Exists. The file appears with the first result.
    """

    def __init__(self, folder: Path) -> None:
        # Host and process alone come back after a restart; a file that a killed worker left
        # with half a line at its end must not be written on.
        name = f"{platform.node() or 'host'}-{os.getpid()}-{secrets.token_hex(4)}.jsonl"
        self.path = folder / name
        self._descriptor = -1
        self._size = 0

    def append(self, result: RunResult) -> None:
        """Write one line and wait until the disk has it.

        Raises
        ------
        InputError
            If the disk is full or refuses; what was written before stays whole.
        """
        line = json.dumps({"id": result.id, "values": result.values}) + "\n"
        try:
            if self._descriptor < 0:
                self._open()
            self._write(line.encode())
        except OSError as error:
            self._take_back()
            raise storage_error(error, self.path.parent) from error

    def close(self) -> None:
        """Close the file; a later `append` is an error."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _open(self) -> None:
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL
        self._descriptor = os.open(self.path, flags, 0o644)
        sync_folder(self.path.parent)

    def _write(self, data: bytes) -> None:
        written = 0
        while written < len(data):
            written += os.write(self._descriptor, data[written:])
        os.fsync(self._descriptor)
        self._size += len(data)

    def _take_back(self) -> None:
        """Cut off half a line; where even that fails, the reader leaves it out."""
        if self._descriptor >= 0:
            try:
                os.ftruncate(self._descriptor, self._size)
            except OSError:
                self.close()


def read_journal(path: Path) -> Iterator[RunResult]:
    """Yield the results of one journal; a torn last line is no result.

    A damaged line before the last one (a broken disk, an edit by hand) is reported and left out:
    that run counts as not finished and is computed again.
    """
    *lines, _torn = path.read_bytes().split(b"\n")
    for number, line in enumerate(lines, start=1):
        try:
            content = json.loads(line)
            yield RunResult(content["id"], dict(content["values"]))
        except (ValueError, KeyError, TypeError):
            warnings.warn(
                f"{path}, line {number} is damaged; that run is computed again",
                UnmodeledWarning,
                stacklevel=2,
            )


def count_lines(path: Path, start: int = 0) -> tuple[int, int]:
    """Return how many lines end after byte ``start``, and the size of the file, for progress."""
    with path.open("rb") as file:
        file.seek(start)
        data = file.read()
    return data.count(b"\n"), start + len(data)


def storage_error(error: OSError, folder: Path) -> Exception:
    """Return the sentence for a disk that is full or refuses, or the error as it is."""
    if error.errno in _FULL:
        return InputError(
            f"no space left while writing {folder}; every finished run is kept",
            do="free space, then go on with: unmodeled resume FOLDER",
        )
    if error.errno in _FORBIDDEN:
        return InputError(
            f"{folder} cannot be written ({error.strerror})", do="choose another --out"
        )
    return error


def sync_folder(folder: Path) -> None:
    """Wait until the disk has the names in a folder."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
