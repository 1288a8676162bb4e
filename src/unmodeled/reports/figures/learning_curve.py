"""Error of a network on held-out labels while it learns."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from unmodeled.core.arrays import Array
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["learning_curve_figure"]

_COLOURS = ("#AA4499", "#0072B2", "#E69F00", "#009E73")


def learning_curve_figure(curves: Mapping[str, Array], printed: float) -> Figure:
    """Draw validation errors against epochs, both logarithmic, with the printed plateau.

    Parameters
    ----------
    curves : mapping of str to ndarray (checks, 2)
        Epochs and percent, by the words of the legend.
    printed : float
        Percent.
    """
    with figure_style():
        figure = new_figure(3.6)
        a = figure.subplots()
        for colour, (name, curve) in zip(_COLOURS, curves.items(), strict=False):
            a.plot(curve[:, 0], curve[:, 1], color=colour, linewidth=1.2, label=name)
        a.axhline(printed, color="#7B8794", linewidth=0.9, linestyle="--", label="printed")
        a.set_xscale("log")
        a.set_yscale("log")
        across = LogRange.around([curve[:, 0] for curve in curves.values()], ceiling=1e6)
        decades(a.xaxis, across)
        a.set_xlim(*across.limits)
        up = LogRange.around([*(curve[:, 1] for curve in curves.values()), printed])
        decades(a.yaxis, up)
        a.set_ylim(*up.limits)
        a.set_xlabel("epoch")
        a.set_ylabel("error on held-out labels, %")
        handles, labels = a.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure
