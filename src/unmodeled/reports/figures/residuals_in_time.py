"""Normalised residuals in time, before and after effects were added."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unmodeled.reports.style import figure_style, new_figure, short

__all__ = ["residuals_in_time"]

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#882255", "#4B5563")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
#: More points than this are drawn as an image within the SVG.
_MANY = 1_500
_UNITS = (("d", 86_400.0), ("h", 3_600.0), ("min", 60.0), ("s", 1.0))


def residuals_in_time(before: pd.DataFrame, after: pd.DataFrame) -> Figure:
    """Draw two panels, the model as given above the model with what was added.

    Parameters
    ----------
    before, after : DataFrame
        `OrbitFit.residuals` of both fits.
    """
    times = before["t_s"].to_numpy(dtype=float)
    span = float(np.ptp(times)) if len(times) else 1.0
    unit, size = next((u for u in _UNITS if span >= 2 * u[1]), _UNITS[-1])
    alone = len(set(before["label"])) == 1
    with figure_style():
        figure = new_figure(4.3)
        axes: list[Axes] = list(figure.subplots(2, 1, sharex=True))
        titles = ("model as given", "with what was added")
        for panel, table, title in zip(axes, (before, after), titles, strict=True):
            _panel(panel, table, size, alone)
            panel.set_title(title)
            panel.set_ylabel("residual / σ, dimensionless")
        axes[-1].set_xlabel(f"time since the epoch of the case, {unit}")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=5, markerscale=2)
    return figure


def _panel(axes: Axes, table: pd.DataFrame, size: float, alone: bool) -> None:
    for sigma, shade in ((3.0, "#EEF1F4"), (1.0, "#DDE3E9")):
        axes.axhspan(-sigma, sigma, color=shade, linewidth=0, zorder=0)
    looks = itertools.cycle(zip(_COLOURS, _MARKERS, strict=True))
    for (label, component), rows in table.groupby(["label", "component"], sort=False):
        colour, marker = next(looks)
        used = rows["used"].to_numpy(dtype=bool)
        t = rows["t_s"].to_numpy(dtype=float) / size
        r = rows["residual"].to_numpy(dtype=float) / rows["sigma"].to_numpy(dtype=float)
        name = str(component) if alone else f"{short(str(label), 16)} {component}"
        axes.plot(
            t[used],
            r[used],
            linestyle="",
            marker=marker,
            markersize=2.0,
            markeredgewidth=0,
            color=colour,
            label=name,
            alpha=0.85,
            zorder=2,
            rasterized=len(table) > _MANY,
        )
        if not used.all():
            axes.plot(t[~used], r[~used], linestyle="", marker="x", color=colour, markersize=3)
    largest = float(np.nanmax(np.abs(table["residual"] / table["sigma"]))) if len(table) else 1.0
    axes.set_ylim(-1.08 * max(largest, 3.2), 1.08 * max(largest, 3.2))
