"""The folder of a sweep: journals, the compacted table, locks; nothing finished is ever lost."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from unmodeled.core.errors import InputError
from unmodeled.pipeline.sweep.compaction import read_rows, write_rows
from unmodeled.pipeline.sweep.journal import count_lines, read_journal, storage_error
from unmodeled.pipeline.sweep.run_config import Value

__all__ = ["Store"]


class Store:
    """A sweep's folder.

    ``journal/`` holds one file a worker, ``results.parquet`` what was compacted, ``started/`` a
    mark for each batch that is being worked on, ``sweep.yaml`` and ``initial-conditions-*.csv``
    what the sweep is.

    Parameters
    ----------
    folder : Path
        May not exist yet; see `create` and `require`.
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)
        self.journals = self.folder / "journal"
        self.started = self.folder / "started"
        self.compacted = self.folder / "results.parquet"
        self.sweep = self.folder / "sweep.yaml"
        self._tails: dict[Path, int] = {}

    def create(self) -> None:
        """Make the folder, if it is not there.

        Raises
        ------
        InputError
            If it is a file, holds something else, or cannot be written.
        """
        if self.folder.is_file():
            raise InputError(f"{self.folder} is a file", allowed="a folder for the results")
        if self.folder.is_dir() and any(self.folder.iterdir()) and not self.journals.is_dir():
            raise InputError(
                f"{self.folder} holds files that are not a sweep",
                do="choose another --out, or empty it",
            )
        try:
            self.journals.mkdir(parents=True, exist_ok=True)
            self.started.mkdir(exist_ok=True)
        except OSError as error:
            raise storage_error(error, self.folder) from error

    def remove_empty(self) -> None:
        """Remove a folder that `create` has just made and nothing was put in."""
        for folder in (self.journals, self.started, self.folder):
            try:
                folder.rmdir()
            except OSError:
                return

    def replace(self, name: str, text: str) -> None:
        """Write a small file in one step.

        Raises
        ------
        InputError
            If the disk is full or refuses.
        """
        temporary = self.folder / f".{name}.{os.getpid()}.partial"
        try:
            temporary.write_text(text)
            temporary.replace(self.folder / name)
        except OSError as error:
            temporary.unlink(missing_ok=True)
            raise storage_error(error, self.folder) from error

    def require(self) -> None:
        """Refuse a folder that is not a sweep.

        Raises
        ------
        InputError
            Naming the host, because a worker elsewhere may not share the disk.
        """
        if not self.journals.is_dir():
            raise InputError(
                f"{self.folder} is not the folder of a sweep, seen from {os.uname().nodename}",
                do="check the path; all workers must see it (a shared disk)",
            )

    def finished(self) -> dict[str, dict[str, Value]]:
        """Return the values of all finished runs by id, from the table and the journals."""
        # Journals are listed first: one that is compacted and removed meanwhile is in the table.
        paths = sorted(self.journals.glob("*.jsonl"))
        rows: dict[str, dict[str, Value]] = {}
        for path in paths:
            try:
                for result in read_journal(path):
                    rows.setdefault(result.id, result.values)
            except FileNotFoundError:
                continue
        return rows | (read_rows(self.compacted) if self.compacted.exists() else {})

    def appended(self) -> int:
        """Return how many lines the journals gained since the last call; for progress."""
        gained = 0
        for path in self.journals.glob("*.jsonl"):
            try:
                lines, self._tails[path] = count_lines(path, self._tails.get(path, 0))
            except FileNotFoundError:
                continue
            gained += lines
        return gained

    def compact(self) -> int:
        """Put all finished runs into the Parquet table and remove their journals.

        Call it under the exclusive `lock`. Killed at any moment, it loses nothing: journals go
        only after the table is in place, and a run that is in both counts once.

        Returns
        -------
        int
            How many finished runs the table holds.
        """
        journals = sorted(self.journals.glob("*.jsonl"))
        rows = self.finished()
        if journals:
            write_rows(rows, self.compacted)
            for path in journals:
                path.unlink()
        return len(rows)

    def forget_started(self) -> None:
        """Remove the marks that killed workers left. Call it under the exclusive `lock`."""
        for mark in self.started.iterdir():
            mark.unlink(missing_ok=True)

    @contextmanager
    def lock(self, name: str = "") -> Iterator[None]:
        """Hold the store for one driver.

        Without a name the whole store is held, against every other driver. Drivers with
        different names (shards) hold it together. The system releases a lock when its process
        ends, however it ends.

        Raises
        ------
        InputError
            If another driver holds it.
        """
        wanted = [(self.folder / ".lock", fcntl.LOCK_SH if name else fcntl.LOCK_EX)]
        if name:
            wanted.append((self.folder / f".lock-{name}", fcntl.LOCK_EX))
        held: list[int] = []
        try:
            for path, kind in wanted:
                held.append(self._open_lock(path))
                try:
                    fcntl.flock(held[-1], kind | fcntl.LOCK_NB)
                except BlockingIOError as error:
                    raise InputError(
                        f"another process works on {self.folder}",
                        do="wait for it, or give each process its own --shard i/n",
                    ) from error
            yield
        finally:
            for descriptor in held:
                os.close(descriptor)

    def _open_lock(self, path: Path) -> int:
        try:
            return os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise storage_error(error, self.folder) from error
