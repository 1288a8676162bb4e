"""The waterfall: how far the residuals are above the noise after each addition."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from unmodeled.reports.numbers import number
from unmodeled.reports.style import SET_STYLES, figure_style, new_figure

__all__ = ["Bar", "waterfall"]

FITTED = "#0072B2"
HELD_OUT = SET_STYLES["extrapolation"].colour
_FLOOR = "#4B5563"
#: Beyond this ratio of the largest to the smallest bar the axis is logarithmic.
_LOG = 6.0
_WIDTH = 0.34
#: Words under a bar are broken at this many characters, fewer with many bars.
_LETTERS = 72


@dataclass(frozen=True)
class Bar:
    """One step.

    Parameters
    ----------
    label : str
        What was added; one effect a line.
    rms : float
        Residual RMS on the fitted arcs, in stated sigmas.
    held_out : float or None
        The same on arcs that were not fitted.
    """

    label: str
    rms: float
    held_out: float | None = None


def waterfall(bars: Sequence[Bar], noise: float, floor: str = "") -> Figure:
    """Draw the residual RMS after each addition, down to the noise.

    Parameters
    ----------
    bars : sequence of Bar
        The first is the model as given.
    noise : float
        Standard deviation of the noise as found, in stated sigmas: the floor.
    floor : str
        Words for it in the legend, if it is not the noise as found.
    """
    values = [b.rms for b in bars] + [b.held_out for b in bars if b.held_out is not None]
    logarithmic = max(*values, noise) > _LOG * min(*values, noise)
    pairs = any(b.held_out is not None for b in bars)
    with figure_style():
        figure = new_figure(3.3)
        axes = figure.add_subplot()
        if logarithmic:
            axes.set_yscale("log")
            _plain_decades(axes)
        bottom = 0.4 * min(*values, noise) if logarithmic else 0.0
        place = _WIDTH / 2 if pairs else 0.0
        for k, bar in enumerate(bars):
            _bar(axes, k - place, bar.rms, bottom, FITTED, "fitted arcs" if k == 0 else None)
            if bar.held_out is not None:
                label = "held-out arcs: never fitted" if k == 0 else None
                _bar(axes, k + place, bar.held_out, bottom, HELD_OUT, label)
        axes.axhline(
            noise,
            color=_FLOOR,
            linestyle=":",
            linewidth=1.4,
            zorder=4,
            label=floor or f"noise as found: {number(noise, 3)} of what was stated",
        )
        top = max(values)
        axes.set_ylim(bottom, top * (top / bottom) ** 0.08 if logarithmic else 1.12 * top)
        axes.set_xlim(-0.6, len(bars) - 0.4)
        letters = max(_LETTERS // len(bars), 12)
        axes.set_xticks(
            range(len(bars)),
            [_broken(b.label, letters) for b in bars],
        )
        axes.tick_params(axis="x", length=0)
        axes.grid(visible=False, axis="x")
        axes.set_ylabel("residual RMS / stated σ, dimensionless")
        handles, labels = axes.get_legend_handles_labels()
        order = sorted(range(len(labels)), key=lambda k: "arcs" not in labels[k])
        figure.legend(
            [handles[k] for k in order],
            [labels[k] for k in order],
            loc="outside upper center",
            ncols=3,
            columnspacing=1.6,
        )
    return figure


def _broken(label: str, letters: int) -> str:
    """Break each line of a label at so many letters."""
    return "\n".join(word for line in label.split("\n") for word in textwrap.wrap(line, letters))


def _bar(axes: Axes, x: float, y: float, bottom: float, colour: str, label: str | None) -> None:
    axes.bar(x, y - bottom, _WIDTH * 0.92, bottom=bottom, color=colour, label=label, zorder=3)
    axes.annotate(
        number(y, 3),
        (x, y),
        (0, 2),
        textcoords="offset points",
        ha="center",
        va="bottom",
        color=colour,
        fontsize=8,
        # On the dotted line of the noise a number stays legible.
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4, "alpha": 0.85},
        zorder=5,
    )


def _plain_decades(axes: Axes) -> None:
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
