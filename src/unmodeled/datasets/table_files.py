"""CSV and Parquet files with stated facts, before their columns mean anything."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from unmodeled.core.errors import DataError

__all__ = ["check_complete", "csv_rows", "parquet_table"]

#: A line of a CSV file: its number, its cells.
Line = tuple[int, list[str]]


def csv_rows(
    path: Path, facts: Sequence[str], rows: str
) -> tuple[list[str], list[Line], dict[str, str]]:
    """Read a CSV file as text.

    Parameters
    ----------
    path : Path
        UTF-8, with or without byte-order mark.
    facts : sequence of str
        Keys that lines ``# key: value`` may state; other comments are passed over.
    rows : str
        What its rows are, for the error of an empty file.

    Returns
    -------
    header : list of str
    lines : list of (int, list of str)
        Of all other lines.
    stated : dict of str to str

    Raises
    ------
    DataError
        If the file is missing, not text or empty.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as exc:
        raise DataError(f"there is no file {path}", do="check the path") from exc
    except (OSError, UnicodeDecodeError) as exc:
        raise DataError(f"{path.name} cannot be read as text ({exc})") from exc
    stated: dict[str, str] = {}
    found: list[Line] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("#"):
            key, colon, value = line[1:].partition(":")
            if colon and key.strip() in facts:
                stated[key.strip()] = value.strip()
        elif line.strip():
            found.append((number, next(csv.reader([line], skipinitialspace=True))))
    if not found:
        raise DataError(f"{path.name} is empty", allowed=f"a header line and {rows}")
    return [name.strip() for name in found[0][1]], found[1:], stated


def check_complete(lines: Sequence[Line], header: Sequence[str], file: str) -> None:
    """Refuse a line that has not a value for each column.

    Raises
    ------
    DataError
        With the line's number.
    """
    for number, cells in lines:
        if len(cells) != len(header):
            raise DataError(
                f"{file}, line {number} has {len(cells)} of {len(header)} values",
                do="the file may be cut short: write it again",
            )


def parquet_table(path: Path, facts: Sequence[str]) -> tuple[pa.Table, dict[str, str]]:
    """Read a Parquet file and those facts that its schema's metadata states.

    Raises
    ------
    DataError
        If the file is missing or not Parquet.
    """
    try:
        table = pq.read_table(path)
    except FileNotFoundError as exc:
        raise DataError(f"there is no file {path}", do="check the path") from exc
    except (OSError, pa.ArrowException) as exc:
        raise DataError(f"{path.name} is not a Parquet file ({str(exc).splitlines()[0]})") from exc
    metadata = table.schema.metadata or {}
    return table, {k: metadata[k.encode()].decode() for k in facts if k.encode() in metadata}
