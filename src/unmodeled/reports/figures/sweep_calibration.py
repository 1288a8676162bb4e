"""Does the predicted uncertainty hold what it says, over many orbits and noise levels?"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodeled.pipeline.trends.bands import levels_of, quartiles
from unmodeled.reports.style import SET_STYLES, LearnerStyle, figure_style, new_figure, short
from unmodeled.reports.sweep_view import SweepView, axis_words

__all__ = ["calibrated_labels", "sweep_calibration"]

_NOMINAL = {"coverage_68": 68.3, "coverage_95": 95.0}
_LINES = {"train": "-", "interpolation": "--", "extrapolation": "-"}


def calibrated_labels(view: SweepView) -> tuple[str, ...]:
    """Return the learners that predicted an uncertainty."""
    column = "interpolation_coverage_68"
    if column not in view.table:
        return ()
    there = view.table[view.table[column].notna()]["learner"]
    return tuple(x for x in view.labels if x in set(there))


def sweep_calibration(view: SweepView, axis: str | None = None) -> Figure | None:
    """Draw a row a learner: coverage of the 68.3 % (left) and the 95 % interval (right).

    Median and quartiles over the runs; below the line a learner is over-confident.

    Parameters
    ----------
    view : SweepView
        The sweep.
    axis : str, optional
        Axis of noise to draw against; all runs together if not given.

    Returns
    -------
    Figure or None
        None if no learner predicts an uncertainty.
    """
    labels = calibrated_labels(view)
    if not labels:
        return None
    with figure_style():
        figure = new_figure(0.8 + 2.2 * len(labels))
        grid = figure.subplots(len(labels), 2, squeeze=False, sharex=True, sharey=True)
        for row, label in zip(grid, labels, strict=True):
            for axes, column in zip(row, _NOMINAL, strict=True):
                _panel(axes, view, label, column, axis)
            _name(row[0], label, view.styles[label])
        words = "all runs" if axis is None else axis_words(axis, si=view.si)
        figure.supxlabel(words, fontsize=8.5)
        figure.supylabel("components inside the interval, %", fontsize=8.5)
        handles = [
            Line2D([], [], color=s.colour, marker=s.marker, ls=_LINES[n], label=s.title)
            for n, s in SET_STYLES.items()
        ]
        handles.append(Line2D([], [], color="#4B5563", linewidth=0.9, label="as it should be"))
        figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def _panel(axes: Axes, view: SweepView, label: str, column: str, axis: str | None) -> None:
    mine = view.table[view.table["learner"] == label]
    levels = levels_of(mine, axis) if axis else mine["train_median"] * 0.0
    gaps = np.diff(np.unique(levels))
    step = float(gaps.min()) if len(gaps) else 1.0
    for k, name in enumerate(SET_STYLES):
        values = 100 * mine[f"{name}_{column}"]
        there = values.notna()
        rows = [
            (level, *quartiles(part.to_numpy(dtype=np.float64)))
            for level, part in values[there].groupby(levels[there])
        ]
        x, low, middle, high = np.array(rows).T
        look = SET_STYLES[name]
        axes.errorbar(
            x + 0.14 * (k - 1) * step,
            middle,
            yerr=(middle - low, high - middle),
            color=look.colour,
            marker=look.marker,
            linestyle=_LINES[name] if len(x) > 1 else "",
            linewidth=1.0,
            elinewidth=1.0,
            capsize=2,
        )
    nominal = _NOMINAL[column]
    axes.axhline(nominal, color="#4B5563", linewidth=0.9, zorder=1)
    axes.set_ylim(-3, 103)
    axes.set_yticks(range(0, 101, 25))
    if axis is None:
        axes.set_xticks([])
        axes.set_xlim(-0.6, 0.6)
    axes.set_title(f"{nominal:.1f} % interval", loc="right")


def _name(axes: Axes, label: str, style: LearnerStyle) -> None:
    axes.plot(
        [0.015],
        [1.06],
        transform=axes.transAxes,
        linestyle="",
        clip_on=False,
        markersize=6,
        **style.marker_options,
    )
    axes.text(0.05, 1.06, short(label, 26), transform=axes.transAxes, va="center", fontsize=9)
