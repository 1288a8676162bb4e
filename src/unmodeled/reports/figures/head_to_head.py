"""Two learners over the same initial conditions, [Neamati2022] Fig. 10."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodeled.pipeline.select.blocks import blocks_of
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.style import LearnerStyle, figure_style, new_figure, short
from unmodeled.reports.sweep_view import SweepView

__all__ = ["head_to_head"]

_PANELS = {
    "interpolation_median": "(a) interpolation: safety",
    "extrapolation_median": "(b) extrapolation: robustness",
}


def head_to_head(view: SweepView, first: str, second: str) -> Figure:
    """Draw the error of one learner against that of the other, a point a problem.

    A point has colour and marker of the learner with the smaller error; the cross is the median
    of both. Failed fits lie on the upper edges.

    Parameters
    ----------
    view : SweepView
        The sweep.
    first, second : str
        Labels; horizontal and vertical axis.

    Raises
    ------
    DataError
        If there is no problem that both have finished.
    """
    table = view.table[view.table["learner"].isin([first, second])]
    blocks = {metric: blocks_of(table, metric)[[first, second]] for metric in _PANELS}
    limits = LogRange.around([b.to_numpy() for b in blocks.values()])
    styles = view.styles
    with figure_style():
        figure = new_figure(3.75)
        for axes, (metric, title) in zip(figure.subplots(1, 2), _PANELS.items(), strict=True):
            _panel(axes, blocks[metric], limits, styles[first], styles[second])
            axes.set_title(title)
        figure.supxlabel(f"median fractional error of {short(first)}, dimensionless", fontsize=8.5)
        figure.supylabel(
            f"median fractional error of\n{short(second)}, dimensionless", fontsize=8.5
        )
        handles = [
            Line2D([], [], linestyle="", label=f"{short(x)} is better", **styles[x].marker_options)
            for x in (first, second)
        ]
        handles += [
            Line2D(
                [], [], color="#111111", marker="+", markersize=9, linestyle="", label="medians"
            ),
            Line2D([], [], color="#4B5563", linewidth=0.9, label="equal errors"),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=4, columnspacing=1.4)
    return figure


def _panel(
    axes: Axes, block: pd.DataFrame, limits: LogRange, first: LearnerStyle, second: LearnerStyle
) -> None:
    x, y = block.to_numpy(dtype=np.float64).T
    for mask, style in ((x < y, first), (y < x, second)):
        axes.plot(
            limits.clip(x[mask]),
            limits.clip(y[mask]),
            linestyle="",
            markersize=4.5,
            alpha=0.85,
            zorder=3,
            rasterized=len(x) > 500,
            **style.marker_options,
        )
    same = x == y
    axes.plot(limits.clip(x[same]), limits.clip(y[same]), ".", color="#4B5563", zorder=3)
    middle = [float(limits.clip(np.quantile(v, 0.5, method="lower"))) for v in (x, y)]
    axes.plot(*([m] for m in middle), marker="+", color="#111111", markersize=13, zorder=4)
    ends = limits.limits
    axes.plot(ends, ends, color="#4B5563", linewidth=0.9, zorder=2)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends, aspect="equal")
    decades(axes.xaxis, limits)
    decades(axes.yaxis, limits)
    axes.text(
        0.03,
        0.97,
        f"{int(np.sum(x < y))} of {len(x)}",
        transform=axes.transAxes,
        va="top",
        color=first.colour,
        fontweight="bold",
    )
    axes.text(
        0.97,
        0.03,
        f"{int(np.sum(y < x))} of {len(x)}",
        transform=axes.transAxes,
        ha="right",
        color=second.colour,
        fontweight="bold",
    )
