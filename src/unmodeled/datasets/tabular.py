"""Trajectories as CSV and Parquet, with the unit in every column's name.

Columns, in any order::

    t_s,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,ax_m_s2,ay_m_s2,az_m_s2

Velocities and accelerations may be left out as a whole: the smoother supplies them.  Instead of
elapsed time (``t_s``, ``t_min``, ``t_h``, ``t_d``) a column of ISO dates may name its scale
(``time_utc``, ``time_tai``, ``time_tt``, ``time_tdb``, ``time_gps``).  Lengths may be in km.  Lines
that begin with ``#`` may carry ``frame``, ``epoch``, ``source`` and ``acceleration_sigma_m_s2``::

    # frame: inertial
    # epoch: 2016-03-13T00:00:00 UTC

A Parquet file has the same columns and carries the same facts in its schema's metadata.  Numbers
are written so that reading them again gives the same bits.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError
from unmodeled.datasets.columns import Columns, assemble, unit_columns
from unmodeled.datasets.table_files import check_complete, csv_rows, parquet_table
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["read_csv", "read_parquet", "write_csv", "write_parquet", "write_trajectory"]

_FACTS = ("frame", "epoch", "source", "acceleration_sigma_m_s2")


def read_csv(path: str | Path, *, accelerations: bool = True) -> Trajectory:
    """Read a trajectory from comma-separated values.

    Parameters
    ----------
    path : str or Path
        The file; columns as described in :mod:`unmodeled.datasets.tabular`.
    accelerations : bool
        Whether the smoother adds accelerations where the file has none.

    Returns
    -------
    Trajectory
        In SI.

    Raises
    ------
    DataError
        If the file is missing or empty, a column is missing, unknown or without a unit, a number
        cannot be read or is not finite (with its line), a line is cut short, times do not
        increase, or fewer than 4 samples are left.
    """
    path = Path(path)
    header, rows, facts = csv_rows(path, _FACTS, "samples")
    chosen = unit_columns(header, path.name)
    check_complete(rows, header, path.name)
    lines = [number for number, _ in rows]
    columns: Columns = {
        name: (
            [cells[k].strip() for _, cells in rows]
            if name.startswith("time_")
            else _numbers([c[k] for _, c in rows], name, lines, path.name)
        )
        for k, name in enumerate(header)
    }
    return assemble(columns, chosen, facts, path.name, lines, accelerations)


def read_parquet(path: str | Path, *, accelerations: bool = True) -> Trajectory:
    """Read a trajectory from Parquet; parameters and errors as in :func:`read_csv`."""
    path = Path(path)
    table, facts = parquet_table(path, _FACTS)
    chosen = unit_columns(table.column_names, path.name)
    lines = list(range(1, table.num_rows + 1))
    columns: Columns = {}
    for name in table.column_names:
        values = table.column(name).to_pylist()
        if name.startswith("time_"):
            columns[name] = ["" if v is None else str(v) for v in values]
        else:
            columns[name] = _numbers(values, name, lines, path.name, "row")
    return assemble(columns, chosen, facts, path.name, lines, accelerations, "row")


def write_trajectory(trajectory: Trajectory, path: str | Path) -> Path:
    """Write a trajectory as the suffix says, .csv or .parquet; return the path.

    Raises
    ------
    DataError
        If the suffix is another.
    """
    writers = {".csv": write_csv, ".parquet": write_parquet}
    suffix = Path(path).suffix.lower()
    if suffix not in writers:
        raise DataError(f'{path} has suffix "{suffix}"', allowed=", ".join(writers))
    return writers[suffix](trajectory, path)


def write_csv(trajectory: Trajectory, path: str | Path) -> Path:
    """Write a trajectory as CSV in SI; return the path.

    Numbers have as many digits as it takes to read the same bits again.
    """
    path = Path(path)
    header, columns = _si_columns(trajectory)
    with path.open("w", encoding="utf-8", newline="") as file:
        for key, value in _facts(trajectory).items():
            file.write(f"# {key}: {value}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        # repr of a float is the shortest text that reads back to the same bits.
        writer.writerows([[repr(v) for v in row] for row in np.column_stack(columns).tolist()])
    return path


def write_parquet(trajectory: Trajectory, path: str | Path) -> Path:
    """Write a trajectory as Parquet in SI; return the path."""
    path = Path(path)
    header, columns = _si_columns(trajectory)
    table = pa.table(dict(zip(header, columns, strict=True)))
    pq.write_table(table.replace_schema_metadata(_facts(trajectory)), path)
    return path


def _facts(trajectory: Trajectory) -> dict[str, str]:
    facts = {
        "frame": trajectory.frame,
        "epoch": trajectory.epoch,
        "source": trajectory.source,
        "acceleration_sigma_m_s2": repr(float(trajectory.acceleration_sigma)),
    }
    return {k: " ".join(v.split()) for k, v in facts.items() if v}


def _si_columns(trajectory: Trajectory) -> tuple[list[str], list[Array]]:
    header = ["t_s", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s"]
    blocks = [trajectory.positions, trajectory.velocities]
    if trajectory.accelerations is not None:
        header += ["ax_m_s2", "ay_m_s2", "az_m_s2"]
        blocks.append(trajectory.accelerations)
    return header, [trajectory.times, *(b[:, k] for b in blocks for k in range(3))]


def _numbers(
    cells: Sequence[Any], name: str, lines: list[int], file: str, word: str = "line"
) -> Array:
    """Finite numbers, or an error with the line."""
    values = np.empty(len(cells))
    for k, cell in enumerate(cells):
        try:
            values[k] = float("nan" if cell is None or cell == "" else cell)
        except (TypeError, ValueError) as exc:
            raise DataError(
                f'{file}, {word} {lines[k]}: {name} is "{cell}"', allowed="a number"
            ) from exc
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise DataError(
            f"{file}, {word} {lines[bad[0]]}: {name} is missing or not finite "
            f"({len(bad)} such value(s))",
            allowed="finite numbers",
            do="remove or repair these samples",
        )
    return values
