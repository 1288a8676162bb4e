"""Columns of a trajectory table: which name means what, in which unit, and how they make one."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, nearest
from unmodeled.core.time import TIME_SCALES, elapsed_from_dates, parse_epoch
from unmodeled.datasets.smoother import smooth, with_accelerations
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["Columns", "assemble", "unit_columns"]

#: Numbers, or ISO dates for a column ``time_*``.
Columns: TypeAlias = dict[str, "Array | list[str]"]

#: Quantity -> unit in the column's name -> SI.  The one table of units.
_UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86_400.0},
    **{q: {"m": 1.0, "km": 1e3} for q in ("x", "y", "z")},
    **{q: {"m_s": 1.0, "km_s": 1e3} for q in ("vx", "vy", "vz")},
    **{q: {"m_s2": 1.0, "km_s2": 1e3} for q in ("ax", "ay", "az")},
}
_DATES = tuple(f"time_{s.lower()}" for s in TIME_SCALES)
_GROUPS = (("x", "y", "z"), ("vx", "vy", "vz"), ("ax", "ay", "az"))


def unit_columns(header: list[str], file: str) -> dict[str, str]:
    """Match a header's names with quantities.

    Parameters
    ----------
    header : list of str
        Names of the columns.
    file : str
        Name used in the error text.

    Returns
    -------
    dict
        Quantity (``"t"`` or ``"time"``, ``"x"`` ... ``"az"``) -> column's name.

    Raises
    ------
    DataError
        If a name is unknown, doubled, has no unit or an unknown one, or a column is missing.
    """
    known = [f"{q}_{u}" for q, units in _UNITS.items() for u in units] + list(_DATES)
    chosen: dict[str, str] = {}
    for name in header:
        quantity, _, unit = name.partition("_")
        if name in _DATES:
            pass
        elif quantity in _UNITS and not unit:
            raise DataError(
                f'{file}: column "{name}" has no unit',
                allowed=", ".join(f"{quantity}_{u}" for u in _UNITS[quantity]),
            )
        elif quantity in _UNITS and unit not in _UNITS[quantity]:
            raise DataError(
                f'{file}: column "{name}" has an unknown unit',
                allowed=", ".join(f"{quantity}_{u}" for u in _UNITS[quantity]),
            )
        elif name not in known:
            raise DataError(
                f'{file}: column "{name}" is unknown',
                allowed="the columns of this package's tables only",
                do=nearest(name, known),
            )
        if quantity in chosen:
            raise DataError(f'{file}: columns "{chosen[quantity]}" and "{name}" say the same')
        chosen[quantity] = name
    if "t" in chosen and "time" in chosen:
        raise DataError(f'{file}: columns "{chosen["t"]}" and "{chosen["time"]}" say the same')
    if "t" not in chosen and "time" not in chosen:
        raise DataError(f"{file}: column t_s is missing", allowed="t_s, or dates in time_utc")
    for units, group in zip(("m", "m_s", "m_s2"), _GROUPS, strict=True):
        present = [q for q in group if q in chosen]
        if present or units == "m":
            for quantity in group:
                if quantity not in chosen:
                    raise DataError(
                        f"{file}: column {quantity}_{units} is missing",
                        allowed=", ".join(f"{q}_{units}" for q in group),
                        do=f"the file has {', '.join(header)}",
                    )
    return chosen


def assemble(
    columns: Columns,
    chosen: dict[str, str],
    facts: dict[str, str],
    file: str,
    lines: list[int],
    accelerations: bool,
    word: str = "line",
) -> Trajectory:
    """Make a trajectory of columns.

    Parameters
    ----------
    columns : dict
        Column's name -> values, all of one length.
    chosen : dict
        From :func:`unit_columns`.
    facts : dict
        ``frame``, ``epoch``, ``source``, ``acceleration_sigma_m_s2``, each optional.
    file, lines, word : str, list of int, str
        Name of the file, number of each sample's line, and what to call it, for errors.
    accelerations : bool
        Whether the smoother adds what is missing.

    Raises
    ------
    DataError
        If times do not increase, samples are too few, or the smoother cannot work.
    """
    epoch, times = _times(columns, chosen, facts.get("epoch", ""), file)
    steps = np.diff(times)
    if np.any(steps <= 0):
        k = int(np.argmax(steps <= 0)) + 1
        raise DataError(
            f"{file}, {word} {lines[k]}: time {'repeats' if steps[k - 1] == 0 else 'goes back'}",
            allowed="strictly increasing times",
            do="sort the samples and remove duplicates",
        )
    blocks = [_block(columns, chosen, group) for group in _GROUPS]
    r, v, a = blocks
    if r is None or len(r) < 4:  # before the smoother, whose text speaks of windows
        raise DataError(f"{file} has {len(times)} samples", allowed="at least 4")
    frame = facts.get("frame", "inertial")
    notes: dict[str, object] = {}
    missing = v is None or (a is None and accelerations)
    if missing and frame != "inertial":
        raise DataError(
            f"{file}: velocities and accelerations cannot be smoothed in the {frame} frame",
            allowed="inertial",
            do="give these columns, or turn the trajectory to inertial axes first",
        )
    if v is None:
        v = smooth(times, r).velocities
        notes["velocities"] = "from the smoother; the file has none"
    sigma = _sigma(facts, file)
    found = Trajectory(times, r, v, a, frame, facts.get("source", file), epoch, sigma, notes)
    if a is None and accelerations:
        return with_accelerations(found, use_velocities="velocities" not in notes)
    return found


def _times(columns: Columns, chosen: dict[str, str], epoch: str, file: str) -> tuple[str, Array]:
    if epoch:
        parse_epoch(epoch)  # refuse a bad one here, not where it is first used
    if "t" in chosen:
        name = chosen["t"]
        return epoch, np.asarray(columns[name]) * _UNITS["t"][name.partition("_")[2]]
    dates = [str(d) for d in columns[chosen["time"]]]
    if not dates:
        return epoch, np.empty(0)
    try:
        return elapsed_from_dates(dates, chosen["time"].partition("_")[2], epoch)
    except DataError as exc:
        raise DataError(f"{file}: {exc.found}", allowed=exc.allowed, do=exc.do) from exc


def _block(columns: Columns, chosen: dict[str, str], group: tuple[str, ...]) -> Array | None:
    if group[0] not in chosen:
        return None
    names = [chosen[q] for q in group]
    return np.stack(
        [
            np.asarray(columns[n], dtype=np.float64) * _UNITS[q][n.partition("_")[2]]
            for q, n in zip(group, names, strict=True)
        ],
        axis=1,
    )


def _sigma(facts: dict[str, str], file: str) -> float:
    text = facts.get("acceleration_sigma_m_s2", "0")
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not (np.isfinite(value) and value >= 0):
        raise DataError(f'{file}: acceleration_sigma_m_s2 is "{text}"', allowed="a number >= 0")
    return value
