"""Residuals in bins of the variables that they depend on most."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.dependence import PLACE, ResidualMap
from unmodeled.pipeline.comparison.orbit_geometry import VARIABLES
from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.reports.figures.comparison_in_time import COMPONENT_COLOURS, time_unit
from unmodeled.reports.numbers import engineering, number
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["comparison_maps", "in_units"]

_SHOWN = 4
_MARKERS = ("o", "s", "^", "v", "D", "P")


def comparison_maps(comparison: Comparison) -> Figure | None:
    """Draw the mean residual of each bin in its standard errors, for the top four variables.

    Returns
    -------
    Figure or None
        None if nothing varies.
    """
    maps = [m for m in comparison.maps if m.variable != PLACE][:_SHOWN]
    if not maps:
        return None
    with figure_style():
        rows = (len(maps) + 1) // 2
        figure = new_figure(0.6 + 2.25 * rows)
        panels = figure.subplots(rows, 2, squeeze=False).ravel()
        for a, m in zip(panels, maps, strict=False):
            _draw(a, m)
        for a in panels[len(maps) :]:
            a.set_visible(False)
        names = [c[2:] for c in maps[0].bins.columns if c.startswith("z_")]
        handles: list[Artist] = [
            Line2D([], [], color=COMPONENT_COLOURS[k % 6], marker=_MARKERS[k % 6], label=_title(n))
            for k, n in enumerate(names)
        ]
        handles.append(Patch(color="#E4E7EB", label="95 % for white noise"))
        figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 4))
    return figure


def in_units(variable: str, values: Array) -> tuple[Array, str]:
    """Return values of a variable in a unit that suits them, and its name."""
    si = VARIABLES[variable].unit
    largest = float(np.abs(values).max())
    if si == "rad":
        return np.degrees(values), "°"
    if si == "s":
        per, unit = time_unit(float(np.ptp(values)))
        return values / per, unit
    if si == "1":
        return values, "–"
    factor, prefix = engineering(largest)
    return values * factor, f"{prefix}{si}"


def _draw(axes: Axes, m: ResidualMap) -> None:
    bins = m.bins
    edges, unit = in_units(m.variable, np.concatenate([bins["low"], bins["high"].tail(1)]))
    low, high = edges[: len(bins)], np.append(edges[1 : len(bins)], edges[-1])
    middle = 0.5 * (low + high)
    axes.axhspan(-1.96, 1.96, color="#E4E7EB", zorder=0)
    names = [c for c in bins.columns if c.startswith("z_")]
    for k, name in enumerate(names):
        axes.plot(
            middle,
            bins[name],
            color=COMPONENT_COLOURS[k % 6],
            marker=_MARKERS[k % 6],
            linewidth=1.0,
        )
    if VARIABLES[m.variable].circle:
        axes.set_xlim(0, 360)
        axes.set_xticks(range(0, 361, 90))
    else:
        axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel(f"{m.title}, {unit}")
    axes.set_ylabel("mean in standard errors, –")
    chance = "p < 0.001" if m.p < 1e-3 else f"p = {number(m.p)}"
    axes.set_title(chance)


def _title(component: str) -> str:
    words = {"R": "radial", "T": "transverse", "N": "normal"}
    return words.get(component, component.replace("_", " "))
