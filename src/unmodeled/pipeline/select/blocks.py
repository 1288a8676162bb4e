"""A sweep's table as blocks: one row a problem, one column a learner, nothing missing."""

from __future__ import annotations

import numpy as np
import pandas as pd

from unmodeled.core.errors import DataError, nearest

__all__ = ["METRICS", "blocks_of"]

#: What learners can be compared by; lower is better.
METRICS = ("interpolation_median", "extrapolation_median", "train_median")


def blocks_of(table: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Return the metric by problem and learner; problems that a learner lacks are left out.

    A problem is an initial condition at one point of the grid, everything but the learner. A
    failed fit counts as an infinite error: it loses, it does not vanish.

    Parameters
    ----------
    table : DataFrame
        From `sweep`.
    metric : str
        Column of errors; lower is better.

    Returns
    -------
    DataFrame (n problems, k learners)

    Raises
    ------
    DataError
        Fewer than two learners, or no problem that all of them have.
    """
    if metric not in table:
        raise DataError(f'no column "{metric}"', do=nearest(metric, map(str, table.columns)))
    keys = _problem_columns(table)
    errors = table[metric].astype(float).where(table["failure"] == "", np.inf)
    frame = table[[*keys, "learner"]].assign(error=errors)
    if frame.duplicated([*keys, "learner"]).any():
        raise DataError(
            "a learner has several results on one problem",
            do="give variants of a learner a label each, in place of an axis learner.NAME",
        )
    wide = frame.pivot_table(index=keys, columns="learner", values="error", aggfunc="first")
    wide = wide[[n for n in dict.fromkeys(table["learner"]) if n in wide]]  # as in the sweep
    complete = wide[wide.notna().all(axis=1)]
    if complete.shape[1] < 2:
        raise DataError(f"{complete.shape[1]} learner in the sweep", allowed="2 or more to compare")
    if complete.empty:
        raise DataError("no problem has results of every learner", do="finish the sweep: resume")
    return complete


def _problem_columns(table: pd.DataFrame) -> list[str]:
    """Columns between learner and results are the axes; see `finished_table`."""
    names = [str(name) for name in table.columns]
    first = next(k for k, name in enumerate(names) if name.endswith("_median"))
    return [
        name
        for name in names[:first]
        if name not in ("id", "learner", "kind") and not name.startswith("learner.")
    ]
