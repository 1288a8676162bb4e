"""Mean ranks and which of them the data do not tell apart, [Demsar2006]."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unmodeled.pipeline.select.ranks import Ranks
from unmodeled.pipeline.select.select import Choice
from unmodeled.reports.style import LearnerStyle, figure_style, new_figure, short
from unmodeled.reports.sweep_view import SweepView

__all__ = ["critical_difference_figure"]

_ROW = 0.2  # inches between names
_HEAD, _FOOT = 0.85, 0.1


def critical_difference_figure(view: SweepView, choices: Sequence[Choice]) -> Figure:
    """Draw a diagram for each regime, best rank left; bars join what is not told apart.

    Parameters
    ----------
    view : SweepView
        For the styles.
    choices : sequence of Choice
        From `select`.
    """
    heights = [_HEAD + _FOOT + _ROW * math.ceil(len(c.ranks.mean) / 2) for c in choices]
    with figure_style():
        figure = new_figure(sum(heights) + 0.1)
        grid = figure.subplots(len(choices), 1, squeeze=False, height_ratios=heights)[:, 0]
        for axes, choice, height in zip(grid, choices, heights, strict=True):
            _diagram(axes, choice.ranks, view.styles, height)
            problems = int(choice.medians["problems"].iloc[0])
            axes.set_title(f"{choice.regime}: mean rank over {problems} problems, 1 is best")
    return figure


def _diagram(axes: Axes, ranks: Ranks, styles: dict[str, LearnerStyle], height: float) -> None:
    """Draw in inches downwards from the axis of ranks at zero."""
    k = len(ranks.mean)
    names = [str(n) for n in ranks.mean.index]
    room = 0.55 * (k - 1)  # for names left and right of the ranks
    axes.set_xlim(1 - room, k + room)
    axes.set_ylim(height - 0.62, -0.55)
    axes.axis("off")
    axes.plot([1, k], [0, 0], color="#1F2933", linewidth=1.0)
    for rank in range(1, k + 1):
        axes.plot([rank, rank], [0, -0.06], color="#1F2933", linewidth=1.0)
        axes.text(rank, -0.09, str(rank), ha="center", va="bottom")
    width = min(ranks.critical_difference, k - 1.0)
    axes.plot([1, 1 + width], [-0.37, -0.37], color="#1F2933", linewidth=2.2, solid_capstyle="butt")
    text = f"critical difference {ranks.critical_difference:.2g}"
    if width < ranks.critical_difference:
        text += ", wider than the axis"
    axes.text(1 + width + 0.02 * (k - 1), -0.37, text, va="center")
    half = math.ceil(k / 2)
    for place, name in enumerate(names):
        left = place < half
        y = 0.2 + _ROW * (place if left else k - 1 - place)
        x, end = float(ranks.mean.iloc[place]), (1 - 0.04 * room if left else k + 0.04 * room)
        style = styles[name]
        axes.plot([x, x, end], [0, y, y], color=style.colour, linestyle=style.line, linewidth=1.1)
        axes.plot([x], [0], linestyle="", markersize=6, zorder=4, **style.marker_options)
        label = f"{short(name, 26)} ({x:.2f})"
        side = -0.02 * room if left else 0.02 * room
        axes.text(end + side, y, label, ha="right" if left else "left", va="center")
    for level, group in enumerate(ranks.groups):
        ends = [float(ranks.mean[name]) for name in (group[0], group[-1])]
        y = 0.06 + 0.055 * level
        air = 0.012 * (k - 1)
        axes.plot(
            [ends[0] - air, ends[1] + air],
            [y, y],
            color="#111111",
            linewidth=3.0,
            solid_capstyle="butt",
            zorder=3,
        )
