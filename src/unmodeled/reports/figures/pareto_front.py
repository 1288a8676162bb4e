"""Error against what it costs, a panel a kind of cost."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodeled.pipeline.select.pareto import COSTS, on_front
from unmodeled.pipeline.trends.bands import quartiles
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.style import figure_style, new_figure, short
from unmodeled.reports.sweep_view import SweepView

__all__ = ["pareto_front"]

_WORDS = {
    "cost_train_s": ("training, s", 1.0),
    "cost_evaluate_one_s": ("one evaluation, µs", 1e6),
    "model_bytes": ("fitted arrays, kB", 1e-3),
}
_SETS = {"extrapolation_median": "extrapolation", "interpolation_median": "interpolation"}


def pareto_front(view: SweepView, metric: str) -> Figure:
    """Draw median error against median cost of each learner, with quartiles of both.

    The step line joins the learners that no other beats in error and in that cost.

    Parameters
    ----------
    view : SweepView
        The sweep.
    metric : str
        Column of errors.
    """
    costs = [c for c in COSTS if c in view.table]
    error = {x: quartiles(view.errors(x, metric)) for x in view.labels}
    limits = LogRange.around([list(v) for v in error.values()])
    with figure_style():
        figure = new_figure(3.3)
        grid = figure.subplots(1, len(costs), sharey=True, squeeze=False)[0]
        for axes, cost in zip(grid, costs, strict=True):
            _panel(axes, view, error, cost, limits)
        grid[0].set_ylabel(
            f"median fractional error,\n{_SETS.get(metric, 'training')}, dimensionless"
        )
        handles = [
            Line2D([], [], linestyle="", label=short(x), markersize=6, **s.marker_options)
            for x, s in view.styles.items()
            if x in view.labels
        ]
        handles.append(Line2D([], [], color="#111111", linewidth=0.9, label="front"))
        figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 4))
    return figure


def _panel(
    axes: Axes,
    view: SweepView,
    error: dict[str, tuple[float, float, float]],
    cost: str,
    limits: LogRange,
) -> None:
    words, scale = _WORDS[cost]
    table = view.table[view.table[cost].notna()]
    spent = {
        x: quartiles(scale * part[cost].to_numpy(dtype=np.float64))
        for x, part in table.groupby("learner")
    }
    labels = [x for x in view.labels if x in spent]
    horizontal = LogRange.around([list(spent[x]) for x in labels])
    middles = np.array([[spent[x][1], error[x][1]] for x in labels])
    front = middles[on_front(middles)]
    front = front[np.argsort(front[:, 0])]
    axes.step(
        np.append(front[:, 0], horizontal.limits[1]),
        limits.clip(np.append(front[:, 1], front[-1, 1])),
        where="post",
        color="#111111",
        linewidth=0.9,
        zorder=2,
    )
    for x in labels:
        style = view.styles[x]
        (low, middle, high), (left, centre, right) = (
            limits.clip(error[x]),
            horizontal.clip(spent[x]),
        )
        axes.errorbar(
            centre,
            middle,
            xerr=[[centre - left], [right - centre]],
            yerr=[[middle - low], [high - middle]],
            ecolor=style.colour,
            elinewidth=1.0,
            linestyle="",
            markersize=7,
            zorder=3,
            **style.marker_options,
        )
    axes.set(xscale="log", yscale="log", xlim=horizontal.limits, ylim=limits.limits)
    decades(axes.xaxis, horizontal)
    decades(axes.yaxis, limits)
    axes.set_xlabel(words)
