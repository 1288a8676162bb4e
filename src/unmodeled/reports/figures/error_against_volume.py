"""Errors and training time against data volume."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from unmodeled.pipeline.trends.bands import bands
from unmodeled.reports.figures.error_against_noise import band_legend, draw_bands
from unmodeled.reports.figures.log_axes import LogRange
from unmodeled.reports.style import figure_style, new_figure
from unmodeled.reports.sweep_view import SweepView, axis_words

__all__ = ["error_against_volume"]

_ERRORS = {
    "interpolation_median": "(a) interpolation",
    "extrapolation_median": "(b) extrapolation",
}


def error_against_volume(view: SweepView, axis: str) -> Figure:
    """Draw median and quartile band of each learner over the initial conditions.

    Parameters
    ----------
    view : SweepView
        Runs in which only this axis, the learner and the orbit vary.
    axis : str
        ``"data.train_periods"`` or ``"data.volume"``.
    """
    found = {metric: bands(view.table, axis, metric) for metric in _ERRORS}
    limits = LogRange.around([b[["low", "median", "high"]].to_numpy() for b in found.values()])
    cost = bands(view.table, axis, "cost_train_s")
    with figure_style():
        figure = new_figure(3.2)
        left, middle, right = figure.subplots(1, 3)
        for axes, (metric, title) in zip((left, middle), _ERRORS.items(), strict=True):
            draw_bands(axes, found[metric], view.styles, limits)
            axes.set_title(title)
        left.set_ylabel("median fractional error, dimensionless")
        draw_bands(
            right, cost, view.styles, LogRange.around([cost[["low", "median", "high"]].to_numpy()])
        )
        right.set_title("(c) training time")
        right.set_ylabel("time of one training, s")
        levels = sorted(set(found["extrapolation_median"]["level"]))
        for axes in (left, middle, right):
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(FixedLocator(levels))
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.xaxis.set_minor_locator(NullLocator())
        figure.supxlabel(axis_words(axis), fontsize=8.5)
        band_legend(figure, view, [])
    return figure
