"""Errors of filters against how wrong their tuning is."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.figures.navigation import FILTER_COLOURS
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["off_nominal_figure"]

_MARKS = ("o", "s", "^", "D", "v", "P", "X")


def off_nominal_figure(table: pd.DataFrame) -> Figure:
    """Draw position and velocity error of each run against its factor on Q or gain.

    Parameters
    ----------
    table : DataFrame
        As `off_nominal` returns it.
    """
    with figure_style():
        figure = new_figure(5.2)
        axes = figure.subplots(2, sharex=True)
        for a, key, label in zip(
            axes,
            ("position_rmse_m", "velocity_rmse_m_s"),
            ("position RMSE, m", "velocity RMSE, m/s"),
            strict=True,
        ):
            for mark, (name, rows) in zip(
                _MARKS, table.groupby("filter", sort=False), strict=False
            ):
                ordered = rows.sort_values("factor")
                a.plot(
                    ordered["factor"],
                    ordered[key],
                    mark,
                    markersize=3.5,
                    color=FILTER_COLOURS.get(str(name), "#6B4C9A"),
                    label=str(name),
                )
            a.axvline(1.0, color="#7B8794", linewidth=0.9, linestyle="--")
            a.set_xscale("log")
            a.set_yscale("log")
            shown = LogRange.around([np.asarray(table[key].dropna())])
            decades(a.yaxis, shown)
            a.set_ylim(*shown.limits)
            a.set_ylabel(label)
        axes[-1].xaxis.set_major_locator(FixedLocator([0.1, 0.3, 1.0, 3.0, 10.0]))
        axes[-1].xaxis.set_minor_locator(NullLocator())
        axes[-1].xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        axes[-1].set_xlabel("Q (observer: gain) over the nominal one")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=6)
    return figure
