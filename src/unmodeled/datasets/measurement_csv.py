"""Measurements as CSV and Parquet, with the unit in every column's name.

One file may hold several kinds; a cell that a row does not need is left empty::

    # epoch: 2016-03-13T00:00:00 UTC
    t_s,station,range_m,sigma_range_m,azimuth_deg,elevation_deg
    0.0,YARL,7123456.7,0.01,,
    5.0,YARL,,,123.4,45.6

Time: ``t_s`` (``t_min``, ``t_h``, ``t_d``) since the epoch, or ISO dates in ``time_utc``,
``time_tai``, ``time_tt``, ``time_tdb``, ``time_gps``.  Readings: ``x_m y_m z_m`` (``_km``),
``vx_m_s vy_m_s vz_m_s`` (``_km_s``), ``range_m`` (``_km``), ``range_rate_m_s`` (``_km_s``),
``ra_rad dec_rad`` (``_deg``), ``azimuth_rad elevation_rad`` (``_deg``).  Standard deviations:
``sigma_`` before any of them; that of ``ra`` and ``azimuth`` is along the great circle, times the
cosine of declination (elevation).  ``station`` names the station of each row.  Lines that begin
with ``#`` may state ``epoch``, ``frame`` (ICRF by default, EME2000 or ITRF: for positions, and
EME2000 for right ascensions), ``station`` (of all rows) and ``ways`` (1 or 2, of ranges; 2 means
the mean of both legs, not their sum).  A Parquet file carries these in its schema's metadata.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, nearest
from unmodeled.core.time import TIME_SCALES, elapsed_from_dates, parse_epoch
from unmodeled.datasets.measurement_rows import Rows, frame_name
from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.table_files import check_complete, csv_rows, parquet_table

__all__ = ["read_measurement_table", "write_measurements"]

_FACTS = ("epoch", "frame", "station", "ways", "source", "acceleration_sigma_m_s2")
_TIME = {"t_s": 1.0, "t_min": 60.0, "t_h": 3600.0, "t_d": 86_400.0}
_DATES = tuple(f"time_{s.lower()}" for s in TIME_SCALES)
_LENGTH, _SPEED = {"m": 1.0, "km": 1e3}, {"m_s": 1.0, "km_s": 1e3}
_ANGLE = {"rad": 1.0, "deg": math.pi / 180}
_QUANTITIES: dict[str, dict[str, float]] = {
    **dict.fromkeys(("x", "y", "z", "range"), _LENGTH),
    **dict.fromkeys(("vx", "vy", "vz", "range_rate"), _SPEED),
    **dict.fromkeys(("ra", "dec", "azimuth", "elevation"), _ANGLE),
}
_KINDS: dict[str, tuple[str, ...]] = {
    "position": ("x", "y", "z"),
    "position_velocity": ("x", "y", "z", "vx", "vy", "vz"),
    "range": ("range",),
    "range_rate": ("range_rate",),
    "right_ascension_declination": ("ra", "dec"),
    "azimuth_elevation": ("azimuth", "elevation"),
}
#: Column -> quantity (or ``sigma_`` and quantity), factor to SI.
_COLUMNS = {
    f"{prefix}{q}_{unit}": (f"{prefix}{q}", factor)
    for prefix in ("", "sigma_")
    for q, units in _QUANTITIES.items()
    for unit, factor in units.items()
}
# Of trajectory files, which are measurement files, too: read over.
_IGNORED = tuple(f"a{c}_{u}" for c in "xyz" for u in ("m_s2", "km_s2"))


def read_measurement_table(path: Path, kind: str) -> list[Rows]:
    """Read the rows of one kind from CSV or Parquet, a set a station.

    Raises
    ------
    DataError
        If the file is missing, empty or damaged; a column is unknown, doubled, without a unit or
        missing for this kind; a line is cut short; a number cannot be read or is not finite; a
        row has only some of the readings; or nothing of this kind is in it.
    """
    read = _parquet if path.suffix.lower() == ".parquet" else _csv
    header, cells, places, facts = read(path)
    chosen = _choose(header, kind, path.name)
    columns = {name: [row[k] for row in cells] for k, name in enumerate(header)}
    needed = _KINDS[kind]
    table = {q: _numbers(columns[chosen[q]], chosen[q], places, path.name) for q in needed}
    values = np.column_stack([table[q] for q in needed]) if cells else np.empty((0, len(needed)))
    there = ~np.isnan(values)
    if np.any(there.any(axis=1) & ~there.all(axis=1)):
        k = int(np.argmax(there.any(axis=1) & ~there.all(axis=1)))
        raise DataError(
            f"{path.name}, {places[k]}: some of {', '.join(chosen[q] for q in needed)} are empty",
            allowed="all of them or none",
        )
    keep = [int(k) for k in np.flatnonzero(there.all(axis=1))]
    if not keep:
        raise DataError(f"{path.name} has no {kind}", do="check the file, or ask for another kind")
    epoch, times = _times(columns, chosen["time"], keep, facts.get("epoch", ""), path.name)
    sigma = _sigma(columns, chosen, needed, places, keep, path.name)
    default = facts.get("station", "")
    names = [str(columns["station"][k] or default) for k in keep] if "station" in chosen else []
    names = names or [default] * len(keep)
    frame = frame_name(facts.get("frame", "ICRF"), path.name)
    ways = facts.get("ways", "1")
    if ways not in ("1", "2"):
        raise DataError(f'{path.name}: ways is "{ways}"', allowed="1, 2")
    found = []
    for name in dict.fromkeys(names):
        mine = np.array([n == name for n in names])
        part = values[keep][mine]
        noise = None if sigma is None else sigma[mine]
        found.append(Rows(epoch, times[mine], part, noise, frame, name, int(ways)))
    return found


def write_measurements(measurements: Sequence[Measurements], path: str | Path) -> Path:
    """Write measurements of one kind as CSV or Parquet (by suffix), in SI; return the path.

    Reading them again gives the same bits. Positions are written along ICRF axes; what an
    instrument effect added (bias, rotation, moved times) is not: the tags and values are.

    Parameters
    ----------
    measurements : sequence of Measurements
        At least one; same kind, epoch and ways.
    path : str or Path
        Ending in .csv or .parquet.

    Raises
    ------
    DataError
        If they differ in kind, epoch or ways, or the suffix is another.
    """
    path = Path(path)
    alike = {(m.kind, m.epoch, m.ways) for m in measurements}
    if len(alike) != 1:
        raise DataError(
            f"{path.name}: {len(alike)} combinations of kind, epoch and ways",
            allowed="one kind, one epoch, one number of ways a file",
        )
    kind, epoch, ways = alike.pop()
    units = [next(iter(_QUANTITIES[q])) for q in _KINDS[kind]]
    names = [f"{q}_{unit}" for q, unit in zip(_KINDS[kind], units, strict=True)]
    blocks = [np.column_stack([np.asarray(m.tags), m.values, m.sigmas]) for m in measurements]
    numbers = np.concatenate(blocks)
    stations = [m.station.name if m.station else "" for m in measurements for _ in m.times]
    header = ["t_s", *names, *(f"sigma_{n}" for n in names)]
    facts = {"epoch": epoch, "frame": "ICRF", "ways": str(ways)}
    facts = {k: v for k, v in facts.items() if v}
    if path.suffix.lower() == ".parquet":
        columns = dict(zip(header, numbers.T, strict=True)) | {"station": stations}
        pq.write_table(pa.table(columns).replace_schema_metadata(facts), path)
    elif path.suffix.lower() == ".csv":
        with path.open("w", encoding="utf-8", newline="") as file:
            file.writelines(f"# {key}: {value}\n" for key, value in facts.items())
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([*header, "station"])
            for row, name in zip(numbers.tolist(), stations, strict=True):
                writer.writerow([*map(repr, row), name])
    else:
        raise DataError(f'{path} has suffix "{path.suffix}"', allowed=".csv, .parquet")
    return path


_Table = tuple[list[str], list[list[object]], list[str], dict[str, str]]


def _csv(path: Path) -> _Table:
    header, rows, facts = csv_rows(path, _FACTS, "measurements")
    check_complete(rows, header, path.name)
    body: list[list[object]] = [[c.strip() for c in cells] for _, cells in rows]
    return header, body, [f"line {n}" for n, _ in rows], facts


def _parquet(path: Path) -> _Table:
    table, facts = parquet_table(path, _FACTS)
    columns = [table.column(name).to_pylist() for name in table.column_names]
    body: list[list[object]] = [
        ["" if c is None else c for c in row] for row in zip(*columns, strict=True)
    ]
    return table.column_names, body, [f"row {k + 1}" for k in range(len(body))], facts


def _choose(header: list[str], kind: str, file: str) -> dict[str, str]:
    """Quantity -> column, with ``"time"`` and, where there is one, ``"station"``."""
    known = [*_COLUMNS, *_TIME, *_DATES, "station", *_IGNORED]
    chosen: dict[str, str] = {}
    for name in header:
        if name not in known:
            units = _QUANTITIES.get(name.removeprefix("sigma_"))
            raise DataError(
                f'{file}: column "{name}" ' + ("has no unit" if units else "is unknown"),
                allowed=", ".join(f"{name}_{u}" for u in units) if units else "",
                do="" if units else nearest(name, known),
            )
        is_time = name in _TIME or name in _DATES
        quantity = "time" if is_time else _COLUMNS.get(name, (name, 1.0))[0]
        if quantity in chosen:
            raise DataError(f'{file}: columns "{chosen[quantity]}" and "{name}" say the same')
        chosen[quantity] = name
    if "time" not in chosen:
        raise DataError(f"{file}: column t_s is missing", allowed="t_s, or dates in time_utc")
    for quantity in _KINDS[kind]:
        if quantity not in chosen:
            unit = next(iter(_QUANTITIES[quantity]))
            raise DataError(
                f"{file}: column {quantity}_{unit} is missing for {kind}",
                allowed=", ".join(f"{quantity}_{u}" for u in _QUANTITIES[quantity]),
                do=f"the file has {', '.join(header)}",
            )
    return chosen


def _numbers(cells: list[object], name: str, places: list[str], file: str) -> Array:
    """Numbers in SI; NaN where a cell is empty."""
    factor = _COLUMNS[name][1] if name in _COLUMNS else _TIME[name]
    values = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if cell == "":
            continue
        try:
            values[k] = float(str(cell)) * factor
            if not math.isfinite(values[k]):
                raise ValueError
        except ValueError as exc:
            raise DataError(
                f'{file}, {places[k]}: {name} is "{cell}"',
                allowed="a finite number",
                do="remove or repair this measurement",
            ) from exc
    return values


def _times(
    columns: dict[str, list[object]], name: str, keep: list[int], epoch: str, file: str
) -> tuple[str, Array]:
    if epoch:
        parse_epoch(epoch)  # refuse a bad one here, not where it is first used
    cells = [columns[name][k] for k in keep]
    if name in _TIME:
        times = _numbers(cells, name, [f"measurement {k + 1}" for k in keep], file)
        if np.any(np.isnan(times)):
            raise DataError(
                f"{file}: {name} is empty in measurement {int(np.argmax(np.isnan(times))) + 1}"
            )
        return epoch, times
    try:
        return elapsed_from_dates([str(c) for c in cells], name.partition("_")[2], epoch)
    except DataError as exc:
        raise DataError(f"{file}: {exc.found}", allowed=exc.allowed, do=exc.do) from exc


def _sigma(
    columns: dict[str, list[object]],
    chosen: dict[str, str],
    needed: tuple[str, ...],
    places: list[str],
    keep: list[int],
    file: str,
) -> Array | None:
    have = [q for q in needed if f"sigma_{q}" in chosen]
    if not have:
        return None
    if len(have) < len(needed):
        raise DataError(
            f"{file}: sigma of {', '.join(q for q in needed if q not in have)} is missing",
            allowed="a column sigma_... for each reading, or none",
        )
    names = [chosen[f"sigma_{q}"] for q in needed]
    table: Array = np.column_stack([_numbers(columns[n], n, places, file) for n in names])[keep]
    if np.any(np.isnan(table)):
        k = int(np.argmax(np.isnan(table).any(axis=1)))
        raise DataError(f"{file}, {places[keep[k]]}: sigma is empty", allowed="a number > 0")
    return table
