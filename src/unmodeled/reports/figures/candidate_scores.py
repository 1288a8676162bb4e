"""What each candidate alone would explain, beside what chance could."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pandas as pd
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from unmodeled.reports.families import family_colour
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.numbers import number
from unmodeled.reports.style import figure_style, new_figure, short

__all__ = ["candidate_scores"]

_MOST = 18
_ROW = 0.21
_PALE = 0.3


def candidate_scores(
    candidates: pd.DataFrame, found: Collection[str], noise: float
) -> Figure | None:
    """Draw a bar a candidate: by how much chi-square would fall with it alone.

    Parameters
    ----------
    candidates : DataFrame
        As in `Diagnosis.candidates`; at most the first 18 by fall of chi-square are drawn, and all
        that were found.
    found : collection of str
        Names of the findings, which are marked.
    noise : float
        Of what is left in the end, stated sigmas: chance explains this much more or less.

    Returns
    -------
    Figure or None
        None if there are no candidates.
    """
    if "drop" not in candidates or not len(candidates):
        return None
    table = candidates.sort_values("drop", ascending=False, kind="stable")
    table = table[(table.reset_index().index < _MOST) | table["name"].isin(list(found))]
    limits = table["threshold"].to_numpy(dtype=float) * noise**2
    drops = table["drop"].to_numpy(dtype=float)
    span = LogRange.around([drops, limits], floor=0.1, ceiling=1e12)
    with figure_style():
        figure = new_figure(1.2 + _ROW * len(table))
        axes = figure.add_subplot()
        rows = zip(table["family"], table["name"], drops, limits, strict=True)
        for row, (family, name, drop, limit) in enumerate(rows):
            colour = family_colour(family)
            axes.barh(
                row,
                max(float(span.clip(drop)) - 10.0**span.low, 0.0),
                0.72,
                left=10.0**span.low,
                color=to_rgba(colour, 1.0 if drop > limit else _PALE),
                zorder=2,
            )
            axes.plot([limit] * 2, [row - 0.42, row + 0.42], color="#111111", lw=1.3, zorder=3)
            mark = f"  {number(drop, 3)}" + ("  found" if name in found else "")
            end = float(span.clip(max(drop, limit)))
            weight = "bold" if name in found else "normal"
            axes.text(end, row, mark, va="center", fontsize=7.5, fontweight=weight)
        axes.set_xscale("log")
        # Room for the words behind the longest bar.
        high = float(np.log10(span.clip(max(drops.max(), limits.max()))))
        axes.set_xlim(10.0**span.low, 10.0 ** (high + 0.22 * (high - span.low)))
        decades(axes.xaxis, span)
        axes.set_ylim(len(table) - 0.4, -0.6)
        axes.set_yticks(range(len(table)), [short(t, 44) for t in table["title"]])
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        axes.set_xlabel("fall of chi-square with this effect alone, stated σ², dimensionless")
        families = list(dict.fromkeys(table["family"]))
        handles: list[Patch | Line2D] = [Patch(color=family_colour(f), label=f) for f in families]
        handles.append(
            Line2D([], [], color="#111111", marker="|", linestyle="", markersize=9, label="needed")
        )
        figure.legend(handles=handles, loc="outside upper center", ncols=5, columnspacing=1.4)
    return figure
