"""Residuals in time, a panel a component, beside the noise that was stated."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.reports.numbers import engineering
from unmodeled.reports.style import figure_style, new_figure, short

__all__ = ["COMPONENT_COLOURS", "comparison_in_time", "time_unit"]

#: Radial, transverse, normal; measured components take them in turn.
COMPONENT_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#882255", "#E69F00", "#332288")
_TITLES = {"R": "radial", "T": "transverse", "N": "normal"}
_BAND, _EDITED = "#D5DAE0", "#111111"
_PANEL = 1.35
#: More panels than this would not fit on a page.
_MOST = 6


def comparison_in_time(comparison: Comparison) -> Figure:
    """Draw measured minus predicted: positions along R, T, N, other data as measured.

    The band is twice the stated standard deviation; crosses were edited out.
    """
    panels = _panels(comparison)[:_MOST]
    times = comparison.residuals["t_s"].to_numpy()
    per, unit = time_unit(float(np.ptp(times)))
    with figure_style():
        figure = new_figure(0.6 + _PANEL * len(panels))
        axes = figure.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
        for k, (a, (title, si, table)) in enumerate(zip(axes, panels, strict=True)):
            _draw(a, title, si, table, per, COMPONENT_COLOURS[k % len(COMPONENT_COLOURS)])
        axes[-1].set_xlabel(f"time since the epoch, {unit}")
        handles: list[Artist] = [Patch(color=_BAND, label="2 stated sigmas")]
        if not comparison.residuals["used"].all():
            handles.append(
                Line2D([], [], linestyle="", marker="x", color=_EDITED, label="edited out")
            )
        figure.legend(handles=handles, loc="outside upper right", ncols=2)
    return figure


def time_unit(span: float) -> tuple[float, str]:
    """Return the seconds in a unit that suits a span, and its name.

    Examples
    --------
    >>> time_unit(3e5)
    (3600.0, 'h')
    """
    for size, name in ((86_400.0 * 365.25, "a"), (86_400.0, "d"), (3600.0, "h")):
        if span >= 5 * size:
            return size, name
    return 1.0, "s"


def _panels(comparison: Comparison) -> list[tuple[str, str, pd.DataFrame]]:
    """Title, SI unit and table (t_s, value, sigma, used) of each panel."""
    found = []
    rtn = comparison.rtn
    for axis in "RTN" if len(rtn) else "":
        table = rtn[["t_s", axis, f"sigma_{axis}", "used"]].copy()
        table.columns = pd.Index(["t_s", "value", "sigma", "used"])
        found.append((_TITLES[axis], "m", table))
    turned = set(rtn["label"]) if len(rtn) else set()
    rms = comparison.rms
    units = dict(zip(zip(rms["label"], rms["component"], strict=True), rms["unit"], strict=True))
    rest = comparison.residuals
    for label, component in units:
        part = rest[(rest["label"] == label) & (rest["component"] == component)]
        if label in turned and component in ("x", "y", "z"):
            continue
        table = part[["t_s", "residual", "sigma", "used"]].copy()
        table.columns = pd.Index(["t_s", "value", "sigma", "used"])
        name = short(str(label), 22)
        if str(component).replace("_", "-") not in name and str(component) not in name:
            name = f"{name} {component}"
        found.append((name, str(units[label, component]), table))
    return found


def _draw(axes: Axes, title: str, si: str, table: pd.DataFrame, per: float, colour: str) -> None:
    table = table.sort_values("t_s")
    t: Array = table["t_s"].to_numpy() / per
    value, sigma = table["value"].to_numpy(), table["sigma"].to_numpy()
    used = table["used"].to_numpy(dtype=bool)
    largest = max(float(np.abs(value[used]).max(initial=0.0)), 2 * float(np.median(sigma)))
    factor, prefix = engineering(largest)
    axes.fill_between(
        t, -2 * sigma * factor, 2 * sigma * factor, color=_BAND, linewidth=0, zorder=0, step="mid"
    )
    axes.axhline(0.0, color="#7B8794", linewidth=0.6, zorder=1)
    axes.plot(
        t[used],
        value[used] * factor,
        linestyle="",
        marker=".",
        markersize=2.5,
        color=colour,
        rasterized=True,
    )
    bound = 1.08 * largest * factor
    axes.plot(
        t[~used],
        np.clip(value[~used] * factor, -bound, bound),
        linestyle="",
        marker="x",
        markersize=4,
        color=_EDITED,
    )
    axes.set_ylim(-bound, bound)
    axes.set_ylabel(f"{prefix}{si}")
    axes.set_title(title)
