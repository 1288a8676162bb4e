"""A sweep as figures and tables see it: its finished runs, its learners and their styles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError
from unmodeled.pipeline.config import LearnerConfig
from unmodeled.pipeline.sweep.sweep import Opened
from unmodeled.pipeline.trends.bands import counted_errors
from unmodeled.reports.numbers import number
from unmodeled.reports.style import LearnerStyle, learner_styles

__all__ = ["NOISE_AXES", "SweepView", "axis_words", "view_of", "where_words"]

#: Axes of noise and of data volume, in the order in which they are shown.
NOISE_AXES = ("noise.state", "noise.acceleration")
VOLUME_AXES = ("data.train_periods", "data.volume")

_TITLES = {
    "noise.state": ("state noise σₛ on each axis", "Brillouin radii", "m"),
    "noise.acceleration": ("acceleration noise σₐ on each axis", "normalised units", "m/s²"),
    "data.train_periods": ("training orbit", "Kepler periods", "Kepler periods"),
    "data.volume": ("training orbit", "Kepler periods", "Kepler periods"),
}


@dataclass(frozen=True)
class SweepView:
    """The finished runs of a sweep and how their learners are drawn.

    Parameters
    ----------
    name : str
        Of the sweep.
    table : DataFrame
        From `sweep`.
    learners : tuple of LearnerConfig
        All learners of the grid in its order, one for each label, so that a learner without
        finished runs changes no colour.
    axes : tuple of str
        Axes of the grid except the learner.
    planned : int
        Runs of the grid.
    si : bool
        Noise levels are in m and m/s2, not in normalised units.
    """

    name: str
    table: pd.DataFrame
    learners: tuple[LearnerConfig, ...]
    axes: tuple[str, ...]
    planned: int
    si: bool = False

    @property
    def styles(self) -> dict[str, LearnerStyle]:
        """Style of each learner by its label."""
        return learner_styles(self.learners)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of learners with finished runs, in the order of the grid."""
        there = set(self.table["learner"])
        return tuple(x.label for x in self.learners if x.label in there)

    @property
    def orbits(self) -> int:
        """How many initial conditions have finished runs."""
        return int(self.table["initial_condition"].nunique()) or 1

    def varied(self, *names: str) -> tuple[str, ...]:
        """Return which of some axes have more than one level among the finished runs."""
        return tuple(a for a in names if a in self.axes and len(self.table[a].unique()) > 1)

    def errors(self, label: str, metric: str) -> Array:
        """Return a learner's errors, one a run (n,); infinite where the fit failed."""
        mine = self.table[self.table["learner"] == label]
        errors: Array = np.array(counted_errors(mine, metric), dtype=np.float64)
        return errors

    def only(self, table: pd.DataFrame) -> SweepView:
        """Return the view of a part of the runs."""
        return replace(self, table=table)


def view_of(opened: Opened) -> SweepView:
    """Return the view of a store.

    Raises
    ------
    DataError
        If no run is finished.
    """
    table = opened.table()
    if table.empty:
        raise DataError(
            f"no run of {opened.store.folder} is finished yet",
            do=f"run: unmodeled resume {opened.store.folder}",
        )
    runs = opened.plan.runs
    learners = {run.config.learners[0].label: run.config.learners[0] for run in reversed(runs)}
    order = dict.fromkeys(run.config.learners[0].label for run in runs)
    return SweepView(
        name=opened.plan.config.name,
        table=table,
        learners=tuple(learners[label] for label in order),
        axes=tuple(k for k in runs[0].axes if k not in ("learner", "kind")),
        planned=len(runs),
        si=runs[0].config.noise.unit == "si",
    )


def axis_words(axis: str, *, si: bool = False) -> str:
    """Return the name of an axis with its unit.

    Examples
    --------
    >>> axis_words("noise.state")
    'state noise σₛ on each axis, Brillouin radii'
    """
    if axis not in _TITLES:
        return axis
    title, normalised, metric = _TITLES[axis]
    return f"{title}, {metric if si else normalised}"


def where_words(where: dict[str, Any], *, si: bool = False) -> str:
    """Return the values of some axes as words; empty for none.

    Examples
    --------
    >>> where_words({"noise.state": 0.1, "data.train_periods": 10.0})
    'state noise 0.1 Brillouin radii, training orbit 10 Kepler periods'
    """
    parts = []
    for axis, value in where.items():
        title, normalised, metric = _TITLES.get(axis, (axis, "", ""))
        words = title.partition(" σ")[0]
        shown = f"{value:g}" if isinstance(value, float | int) else str(value)
        unit = "" if isinstance(value, str) else f" {metric if si else normalised}"
        parts.append(f"{words} {shown}{unit}".rstrip())
    return ", ".join(parts)


def ordered_by_error(view: SweepView, metric: str) -> tuple[str, ...]:
    """Return the labels, lowest median error first; ties as in the grid."""
    middles = {
        x: float(np.quantile(view.errors(x, metric), 0.5, method="lower")) for x in view.labels
    }
    return tuple(sorted(view.labels, key=lambda x: middles[x]))


def span_words(values: Sequence[float]) -> str:
    """Return smallest and largest of some numbers.

    Examples
    --------
    >>> span_words([0.5, 0.1, 2.0])
    '0.10 to 2.0'
    """
    low, high = number(min(values)), number(max(values))
    return low if low == high else f"{low} to {high}"
