"""Which learners are worth their cost: the Pareto front of error against time and size."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array

__all__ = ["COSTS", "on_front", "pareto"]

#: Columns of a sweep's table in which less is better.
COSTS = ("cost_train_s", "cost_evaluate_one_s", "model_bytes")


def pareto(table: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Return the medians of error and costs of each learner, and whether it is on the front.

    Parameters
    ----------
    table : DataFrame
        From `sweep`; failed fits count as infinite errors.
    metric : str
        Column of errors.

    Returns
    -------
    DataFrame
        ``learner``, the metric, training time (s), time of one evaluation (s), size (bytes),
        ``front``: no other learner is as good in all of them and better in one.
    """
    errors = table[metric].astype(float).where(table["failure"] == "", np.inf)
    columns = [name for name in COSTS if name in table]
    frame = table[["learner", *columns]].assign(**{metric: errors})
    medians = frame.groupby("learner", sort=False).median()[[metric, *columns]]
    values = medians.fillna(np.inf).to_numpy(dtype=np.float64)
    return medians.assign(front=on_front(values)).reset_index()


def on_front(values: Array) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return which rows of (n, m) values, less is better, no other row dominates.

    Examples
    --------
    >>> on_front(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 4.0]])).tolist()
    [True, True, False]
    """
    no_worse = np.all(values[:, None] <= values[None], axis=2)
    better = np.any(values[:, None] < values[None], axis=2)
    return np.asarray(~np.any(no_worse & better, axis=0), dtype=np.bool_)
