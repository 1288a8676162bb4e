"""Finished runs as one Parquet file, written beside and put in place in one step."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from unmodeled.core.errors import DataError
from unmodeled.pipeline.sweep.journal import storage_error, sync_folder
from unmodeled.pipeline.sweep.run_config import Value

__all__ = ["read_rows", "write_rows"]

Rows = Mapping[str, Mapping[str, Value]]


def write_rows(rows: Rows, path: Path) -> None:
    """Write values by run id; the file is the old one or the new one, never half of it.

    Parameters
    ----------
    rows : mapping of str to mapping
        Values by run id. Written in the order of the ids, columns in the order of their names:
        the bytes depend on the content only.
    path : Path
        Replaced.

    Raises
    ------
    InputError
        If the disk is full or refuses.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    names = sorted({name for values in rows.values() for name in values})
    ids = sorted(rows)
    columns = {"id": pa.array(ids, pa.string())}
    for name in names:
        columns[name] = _column(name, [rows[i].get(name) for i in ids])
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with temporary.open("wb") as file:
            pq.write_table(pa.table(columns), file, compression="zstd")
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        sync_folder(path.parent)
    except OSError as error:
        raise storage_error(error, path.parent) from error
    finally:
        temporary.unlink(missing_ok=True)


def read_rows(path: Path) -> dict[str, dict[str, Value]]:
    """Return values by run id; a value that a run does not have is left out.

    Raises
    ------
    DataError
        If the file is not one that `write_rows` wrote.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        records = pq.read_table(path).to_pylist()
    except (pa.ArrowException, OSError) as error:
        raise DataError(
            f"{path} cannot be read ({str(error).splitlines()[0]})",
            do="restore it from a copy, or remove it: its runs are then computed again",
        ) from error
    return {r["id"]: {k: v for k, v in r.items() if k != "id" and v is not None} for r in records}


def _column(name: str, values: list[Value]) -> object:
    import pyarrow as pa

    if any(isinstance(v, float) for v in values) and not any(isinstance(v, str) for v in values):
        return pa.array(values, pa.float64())
    try:
        return pa.array(values)
    except pa.ArrowException as error:
        kinds = sorted({type(v).__name__ for v in values if v is not None})
        raise DataError(f"results of column {name} are {' and '.join(kinds)}") from error
