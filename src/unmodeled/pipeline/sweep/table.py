"""The final table of a sweep: one row a run, in the order of the grid."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from unmodeled.pipeline.sweep.grid import Plan
from unmodeled.pipeline.sweep.run_config import Value

__all__ = ["COST", "finished_table", "results_only"]

#: Columns with this beginning may differ from run to run; all others may not.
COST = "cost_"
_SETS = ("train", "interpolation", "extrapolation")


def finished_table(plan: Plan, finished: Mapping[str, Mapping[str, Value]]) -> pd.DataFrame:
    """Return the finished runs of a plan.

    Parameters
    ----------
    plan : Plan
        Gives the rows' order, the axes and the learners.
    finished : mapping
        Values by run id, from `Store.finished`; runs of other plans are left out.

    Returns
    -------
    DataFrame
        ``id``, ``initial_condition``, ``learner``, ``kind``, the axes, then what was measured:
        the medians first, the rest in the order of the names. It does not depend on who
        finished what when.
    """
    head = plan.table()
    rows = [finished.get(i) for i in head["id"]]
    body = pd.DataFrame([row or {} for row in rows], index=head.index)
    first = [name for name in (f"{s}_median" for s in _SETS) if name in body]
    rest = sorted(str(name) for name in body if name not in first)
    table = pd.concat([head, body[first + rest]], axis=1)
    return table[[row is not None for row in rows]].reset_index(drop=True)


def results_only(table: pd.DataFrame) -> pd.DataFrame:
    """Return the columns that depend on the configurations only."""
    return table[[name for name in table if not str(name).startswith(COST)]]
