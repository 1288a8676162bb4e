"""How far a sweep is, and its table as a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.sweep.cost_model import Expected, expected_cost
from unmodeled.pipeline.sweep.grid import Plan
from unmodeled.pipeline.sweep.journal import storage_error
from unmodeled.pipeline.sweep.run_config import Value
from unmodeled.pipeline.sweep.sweep import Opened

__all__ = ["Status", "export", "status", "status_of"]

_WRITERS = {
    ".parquet": lambda table, path: table.to_parquet(path, index=False),
    ".csv": lambda table, path: table.to_csv(path, index=False, lineterminator="\n"),
    ".json": lambda table, path: table.to_json(path, orient="records", indent=1),
}


@dataclass(frozen=True)
class Status:
    """Counts of a sweep.

    Parameters
    ----------
    planned, finished, failed, merged, other : int
        Runs of the grid; finished ones; of these, fits that broke down (rows with a reason);
        points of the grid that mean the same run as another; finished runs in the store that
        are not in this grid.
    by_learner : DataFrame
        Columns ``learner``, ``planned``, ``finished``, ``failed``, ``seconds_per_run`` (median
        of the finished ones).
    remaining : Expected
        Time and memory of what is left.
    """

    planned: int
    finished: int
    failed: int
    merged: int
    other: int
    by_learner: pd.DataFrame
    remaining: Expected

    def as_json(self) -> dict[str, Any]:
        """Return plain data; what is not known is null."""
        learners = self.by_learner.astype(object).where(self.by_learner.notna(), None)
        return {
            "planned": self.planned,
            "finished": self.finished,
            "failed": self.failed,
            "merged": self.merged,
            "other": self.other,
            "learners": learners.to_dict(orient="records"),
            "remaining": self.remaining.as_json(),
        }


def status(opened: Opened) -> Status:
    """Return how far the sweep in a store is."""
    return status_of(opened.plan, opened.store.finished())


def status_of(plan: Plan, finished: Mapping[str, Mapping[str, Value]]) -> Status:
    """Return the counts of a plan and the values of finished runs by id."""
    table = plan.table()[["id", "learner"]]
    table["done"] = [i in finished for i in table["id"]]
    table["failed"] = [bool(finished.get(i, {}).get("failure")) for i in table["id"]]
    table["seconds"] = pd.Series(
        [finished.get(i, {}).get("cost_total_s") for i in table["id"]], dtype=float
    )
    grouped = table.groupby("learner", sort=False)
    by_learner = pd.DataFrame(
        {
            "planned": grouped.size(),
            "finished": grouped["done"].sum(),
            "failed": grouped["failed"].sum(),
            "seconds_per_run": grouped["seconds"].median(),
        }
    ).reset_index()
    done = int(table["done"].sum())
    return Status(
        planned=len(table),
        finished=done,
        failed=int(table["failed"].sum()),
        merged=plan.merged,
        other=len(finished) - done,
        by_learner=by_learner,
        remaining=expected_cost(plan, finished),
    )


def export(opened: Opened, target: Path) -> int:
    """Write the table of the finished runs to a Parquet, CSV or JSON file, in one step.

    Returns
    -------
    int
        Number of rows.

    Raises
    ------
    ConfigError
        Another suffix, or nothing is finished.
    InputError
        The disk is full or refuses.
    """
    write = _WRITERS.get(target.suffix)
    if write is None:
        raise ConfigError(f"--out {target}", allowed="a name that ends in " + ", ".join(_WRITERS))
    table = opened.table()
    if table.empty:
        raise ConfigError(f"no run of {opened.store.folder} is finished yet")
    temporary = target.with_name(f".{target.stem}.partial{target.suffix}")
    try:
        write(table, temporary)
        temporary.replace(target)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise storage_error(error, target.parent) from error
    return len(table)
