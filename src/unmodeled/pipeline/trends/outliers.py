"""Runs that are far worse than the others of their cell, and whether their data say why."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from unmodeled.pipeline.trends.bands import counted_errors

__all__ = ["FAR_OBSERVED", "OUTLIER_FACTOR", "outliers"]

#: Times the median of its cell above which the error of a run is an outlier.
OUTLIER_FACTOR = 10.0
#: Largest observed over largest true acceleration from which on one sample rules the fit.
FAR_OBSERVED = 10.0


def outliers(
    table: pd.DataFrame, axes: Sequence[str], metric: str = "interpolation_median"
) -> pd.DataFrame:
    """Return the runs whose error is above ten times the median of their cell.

    A cell is a learner at one point of the grid: only the initial condition and its noise differ.

    Parameters
    ----------
    table : DataFrame
        From `sweep`.
    axes : sequence of str
        Axes of the grid except the learner.
    metric : str
        Column of errors; failed fits are not outliers, they have their own reasons.

    Returns
    -------
    DataFrame
        Rows of the table, worst first, with ``times_cell``, the error over the median of the cell,
        and ``explained``: the training data hold an observed acceleration of ten or more times
        the largest true one. State noise draws the position whose acceleration is observed; where
        it falls beside the centre of the body the answer of the point mass has no bound.
    """
    errors = counted_errors(table, metric)
    keys = [table[k] for k in ("learner", *axes)]
    middle = errors.groupby(keys, dropna=False).transform("median")
    times = errors / middle  # inf / inf where most of a cell failed: nobody stands out
    far = table.assign(times_cell=times)[(times > OUTLIER_FACTOR) & (table["failure"] == "")]
    if "train_largest_observed" in far:
        explained = far["train_largest_observed"] >= FAR_OBSERVED
    else:  # a store of an earlier version
        explained = pd.Series(False, index=far.index)
    return far.assign(explained=explained).sort_values("times_cell", ascending=False)
