"""Does the training error tell the test error? [Neamati2022] Fig. 11."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodeled.core.errors import DataError
from unmodeled.pipeline.trends.log_fit import LogFit, log_fit
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.style import SET_STYLES, LearnerStyle, figure_style, new_figure, short
from unmodeled.reports.sweep_view import SweepView

__all__ = ["fits_of", "train_against_test"]

_TESTS = ("interpolation", "extrapolation")


def fits_of(view: SweepView, label: str) -> dict[str, LogFit | None]:
    """Return the log-log fit of each test error against the training error; None if impossible."""
    train = view.errors(label, "train_median")
    found: dict[str, LogFit | None] = {}
    for name in _TESTS:
        try:
            found[name] = log_fit(train, view.errors(label, f"{name}_median"))
        except DataError:  # fewer than three runs, or none that differ: no line to draw
            found[name] = None
    return found


def train_against_test(view: SweepView) -> Figure:
    """Draw a panel a learner: test against training error, a point a run, with fitted lines.

    Parameters
    ----------
    view : SweepView
        The sweep; all its runs are taken together.
    """
    labels = view.labels
    columns = min(len(labels), 2 if len(labels) <= 4 else 3)
    rows = math.ceil(len(labels) / columns)
    values = [view.errors(x, f"{s}_median") for x in labels for s in _TESTS]
    vertical = LogRange.around(values)
    horizontal = LogRange.around([view.errors(x, "train_median") for x in labels])
    with figure_style():
        figure = new_figure(0.95 + 2.75 * rows)
        grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
        for k, axes in enumerate(grid.flat):
            if k >= len(labels):
                axes.set_visible(False)
                continue
            _panel(axes, view, labels[k], view.styles[labels[k]], horizontal, vertical)
        figure.supxlabel("median fractional error, training, dimensionless", fontsize=8.5)
        figure.supylabel("median fractional error, test, dimensionless", fontsize=8.5)
        handles = [
            Line2D([], [], color=s.colour, marker=s.marker, linestyle="", label=s.title)
            for s in (SET_STYLES[name] for name in _TESTS)
        ]
        handles.append(Line2D([], [], color="#4B5563", linestyle=":", label="test = training"))
        figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure


def _panel(
    axes: Axes,
    view: SweepView,
    label: str,
    style: LearnerStyle,
    horizontal: LogRange,
    vertical: LogRange,
) -> None:
    x = view.errors(label, "train_median")
    fits = fits_of(view, label)
    for k, name in enumerate(_TESTS):
        look, fit = SET_STYLES[name], fits[name]
        axes.scatter(
            horizontal.clip(x),
            vertical.clip(view.errors(label, f"{name}_median")),
            s=11,
            marker=look.marker,
            color=look.colour,
            alpha=0.6,
            linewidths=0,
            rasterized=len(x) > 500,
            zorder=3,
        )
        if fit is None:
            text = f"{look.title}: no line"
        else:
            kept = x[np.isfinite(x) & (x > 0)]
            ends = np.array([kept.min(), kept.max()])
            axes.plot(
                ends,
                10**fit.intercept * ends**fit.slope,
                color=look.colour,
                linewidth=1.1,
                zorder=4,
            )
            text = f"{look.title}: slope {fit.slope:.3f}, R² {fit.r_squared:.4f}".replace("-", "−")
        axes.text(0.0, 1.09 - 0.075 * k, text, transform=axes.transAxes, color=look.colour)
    ends = np.array(horizontal.limits)
    axes.plot(ends, ends, color="#4B5563", linestyle=":", linewidth=1.0, zorder=2)
    axes.set(xscale="log", yscale="log", xlim=horizontal.limits, ylim=vertical.limits)
    decades(axes.xaxis, horizontal)
    decades(axes.yaxis, vertical)
    axes.tick_params(labelleft=True)
    axes.plot(
        [0.015],
        [1.2],
        transform=axes.transAxes,
        linestyle="",
        clip_on=False,
        markersize=6,
        **style.marker_options,
    )
    axes.text(0.05, 1.2, short(label, 28), transform=axes.transAxes, va="center", fontsize=9)
