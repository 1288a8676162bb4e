"""Median and quartiles over the runs of a sweep, against one axis of the grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, nearest

__all__ = ["bands", "counted_errors", "levels_of", "quartiles", "slices"]

#: Words for data volumes as Kepler periods of the training orbit, [Neamati2022] section IV.B.
_VOLUMES = {"low": 10.0, "moderate": 100.0}


def counted_errors(table: pd.DataFrame, metric: str) -> pd.Series[float]:
    """Return a column of errors in which a failed fit is infinite: it counts, it does not vanish.

    Raises
    ------
    DataError
        If there is no such column.
    """
    if metric not in table:
        raise DataError(f'no column "{metric}"', do=nearest(metric, map(str, table.columns)))
    return table[metric].astype(float).where(table["failure"] == "", np.inf)


def levels_of(table: pd.DataFrame, axis: str) -> pd.Series[Any]:
    """Return the values of an axis as numbers where they are numbers or words for volumes."""
    values = table[axis]
    if values.isin(list(_VOLUMES)).all():
        return values.map(_VOLUMES).astype(float)
    return values.astype(float)


def quartiles(values: Array) -> tuple[float, float, float]:
    """Return lower quartile, median and upper quartile; infinite values are the largest.

    Examples
    --------
    >>> quartiles(np.array([1.0, 2.0, 3.0, np.inf, np.inf]))
    (2.0, 3.0, inf)
    """
    # As `metrics.summarize`: no interpolation between a number and infinity.
    method: Any = "linear" if np.all(np.isfinite(values)) else "nearest"
    low, middle, high = np.quantile(values, [0.25, 0.5, 0.75], method=method)
    return float(low), float(middle), float(high)


def bands(table: pd.DataFrame, axis: str, metric: str) -> pd.DataFrame:
    """Return median and quartiles of a metric by learner and level of an axis.

    Parameters
    ----------
    table : DataFrame
        From `sweep`; all runs of one learner and level are taken together.
    axis : str
        Column with the levels.
    metric : str
        Column of errors, or one that begins with ``cost_``.

    Returns
    -------
    DataFrame
        ``learner`` (in the order of the table), ``level`` (rising), ``runs``, ``failures``,
        ``low``, ``median``, ``high``.
    """
    values = counted_errors(table, metric)
    if metric.startswith("cost_"):  # a failed fit has no error; what it cost is not known
        values = values.where(table["failure"] == "")
    frame = pd.DataFrame(
        {"learner": table["learner"], "level": levels_of(table, axis), "value": values}
    ).dropna()
    rows = []
    for learner in dict.fromkeys(frame["learner"]):
        mine = frame[frame["learner"] == learner]
        for level, part in mine.groupby("level"):
            v = part["value"].to_numpy(dtype=np.float64)
            rows.append((learner, level, len(v), int(np.sum(~np.isfinite(v))), *quartiles(v)))
    names = ["learner", "level", "runs", "failures", "low", "median", "high"]
    return pd.DataFrame(rows, columns=names)


def slices(
    table: pd.DataFrame, axis: str, axes: Sequence[str]
) -> list[tuple[dict[str, Any], pd.DataFrame]]:
    """Split a table by all axes but one, so that along it only that axis varies.

    Parameters
    ----------
    table : DataFrame
        From `sweep`.
    axis : str
        The axis to look along.
    axes : sequence of str
        All axes of the grid.

    Returns
    -------
    list of (dict, DataFrame)
        Values of the other axes that vary, and the runs; parts with one level are left out.
    """
    others = [a for a in axes if a != axis and len(table[a].unique()) > 1]
    if not others:
        parts: list[tuple[dict[str, Any], pd.DataFrame]] = [({}, table)]
    else:
        grouped = table.groupby(others, sort=False, dropna=False)
        parts = [(dict(zip(others, key, strict=True)), part) for key, part in grouped]
    return [(where, part) for where, part in parts if len(part[axis].unique()) > 1]
