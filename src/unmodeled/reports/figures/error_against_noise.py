"""Errors of several learners along one axis of a grid, [Neamati2022] Figs. 12 and 13."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from unmodeled.pipeline.trends.bands import bands
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.style import LearnerStyle, figure_style, new_figure, short
from unmodeled.reports.sweep_view import SweepView, axis_words

__all__ = ["band_legend", "draw_bands", "error_against_noise"]

_PANELS = (
    ("train_median", "(a) training, logarithmic", True),
    ("train_median", "(b) training, linear", False),
    ("interpolation_median", "(c) interpolation: safety", True),
    ("extrapolation_median", "(d) extrapolation: robustness", True),
)


def error_against_noise(view: SweepView, axis: str) -> Figure:
    """Draw median and quartile band of each learner over the initial conditions.

    Panels (a) and (c) share their axis.

    Parameters
    ----------
    view : SweepView
        Runs in which only this axis, the learner and the orbit vary.
    axis : str
        ``"noise.state"`` or ``"noise.acceleration"``.
    """
    found = {metric: bands(view.table, axis, metric) for metric, _, _ in _PANELS}
    shared = _range(*(found[m] for m in ("train_median", "interpolation_median")))
    own = _range(found["extrapolation_median"])  # it spans decades less
    with figure_style():
        figure = new_figure(5.5)
        grid = figure.subplots(2, 2, sharex=True)
        for axes, (metric, title, logarithmic) in zip(grid.flat, _PANELS, strict=True):
            if logarithmic:
                limits = own if metric == "extrapolation_median" else shared
                draw_bands(axes, found[metric], view.styles, limits)
                axes.axhline(1.0, color="#4B5563", linestyle=":", linewidth=1.0, zorder=1)
            else:
                _linear(axes, found[metric], view.styles)
            axes.set_title(title)
        figure.supxlabel(axis_words(axis, si=view.si), fontsize=8.5)
        figure.supylabel("median fractional acceleration error, dimensionless", fontsize=8.5)
        skill = Line2D([], [], color="#4B5563", linestyle=":", label="1: no skill")
        band_legend(figure, view, [skill])
    return figure


def draw_bands(
    axes: Axes, found: pd.DataFrame, styles: Mapping[str, LearnerStyle], limits: LogRange
) -> None:
    """Draw lines and bands on a logarithmic vertical axis; what is infinite lies on its edge.

    Parameters
    ----------
    axes : Axes
        To draw on.
    found : DataFrame
        From `bands`.
    styles : mapping of str to LearnerStyle
        By learner.
    limits : LogRange
        Of the vertical axis.
    """
    for learner, part in found.groupby("learner", sort=False):
        style = styles[str(learner)]
        x = part["level"].to_numpy(dtype=np.float64)
        low, middle, high = (limits.clip(part[c].to_numpy()) for c in ("low", "median", "high"))
        _line(axes, x, low, middle, high, style)
    axes.set_yscale("log")
    axes.set_ylim(limits.limits)
    decades(axes.yaxis, limits)


def band_legend(figure: Figure, view: SweepView, more: list[Line2D]) -> None:
    """Put a legend of learners, band and more above a figure."""
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=s.colour, ls=s.line, label=short(x), **s.marker_options)
        for x, s in view.styles.items()
        if x in view.labels
    ]
    handles.append(Patch(facecolor="#7B8794", alpha=0.25, label="quartiles"))
    figure.legend(
        handles=[*handles, *more],
        loc="outside upper center",
        ncols=min(len(handles) + len(more), 4),
        columnspacing=1.6,
        handlelength=2.6,
    )


def _range(*found: pd.DataFrame) -> LogRange:
    return LogRange.around([b[["low", "median", "high"]].to_numpy() for b in found])


def _linear(axes: Axes, found: pd.DataFrame, styles: Mapping[str, LearnerStyle]) -> None:
    finite = found["high"][np.isfinite(found["high"])]
    top = 1.06 * float(finite.max()) if len(finite) else 1.0
    for learner, part in found.groupby("learner", sort=False):
        x = part["level"].to_numpy(dtype=np.float64)
        low, middle, high = (np.minimum(part[c], top) for c in ("low", "median", "high"))
        _line(axes, x, low, middle, high, styles[str(learner)])
    axes.set_ylim(0, top)


def _line(
    axes: Axes,
    x: np.ndarray,
    low: np.ndarray,
    middle: np.ndarray,
    high: np.ndarray,
    style: LearnerStyle,
) -> None:
    axes.fill_between(x, low, high, color=style.colour, alpha=0.22, linewidth=0, zorder=2)
    axes.plot(x, middle, color=style.colour, linestyle=style.line, zorder=3, **style.marker_options)
