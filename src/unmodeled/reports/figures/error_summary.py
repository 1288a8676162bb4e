"""Head to head: median, quartiles and worst error of every learner on the three sets."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodeled.pipeline.metrics import ErrorSummary
from unmodeled.pipeline.results import CharacterizationResult, LearnerResult
from unmodeled.pipeline.use_check import point_mass_summaries
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.numbers import power_of_ten
from unmodeled.reports.style import (
    SET_STYLES,
    LearnerStyle,
    figure_style,
    learner_styles,
    new_figure,
    short,
)

__all__ = ["error_summary"]

_OFFSETS = {"train": -0.25, "interpolation": 0.0, "extrapolation": 0.25}
_ROW = 0.42


def error_summary(result: CharacterizationResult) -> Figure | None:
    """Draw a row a learner, the most robust one on top.

    The vertical line is the median error of the bare known point mass on the extrapolation set:
    to its right a learned model is worse than having learned nothing.

    Parameters
    ----------
    result : CharacterizationResult
        What to draw; learners whose fit failed are left out here and named in the words.

    Returns
    -------
    Figure or None
        None if no learner has errors.
    """
    learners = sorted(
        (r for r in result.learners if r.summaries),
        key=lambda r: r.summaries["extrapolation"].median,
    )
    if not learners:
        return None
    reference = point_mass_summaries(result.data)["extrapolation"].median
    limits = LogRange.around(
        [[s.quartile_1, s.median, s.worst] for r in learners for s in r.summaries.values()]
        + [[reference]]
    )
    with figure_style():
        figure = new_figure(1.15 + _ROW * len(learners))
        axes = figure.add_subplot()
        styles = learner_styles(result.config.learners)
        for row, learner in enumerate(learners):
            _row(axes, row, learner.summaries, limits)
            _swatch(axes, row, styles[learner.label])
        axes.axvline(
            float(limits.clip(reference)), color="#4B5563", linestyle=":", linewidth=1.3, zorder=1
        )
        axes.set_xscale("log")
        axes.set_xlim(limits.limits)
        decades(axes.xaxis, limits)
        axes.set_ylim(len(learners) - 0.4, -0.6)
        axes.set_yticks(range(len(learners)), [short(r.label, 30) for r in learners])
        axes.tick_params(axis="y", length=0, pad=16)
        axes.grid(visible=False, axis="y")
        for row in range(len(learners) - 1):
            axes.axhline(row + 0.5, color="#E4E7EB", linewidth=0.5, zorder=0)
        axes.set_xlabel("fractional acceleration error |a − â| / |a|, dimensionless")
        _legend(figure, learners)
    return figure


def _row(axes: Axes, row: int, summaries: Mapping[str, ErrorSummary], limits: LogRange) -> None:
    for name, s in summaries.items():
        style, y = SET_STYLES[name], row + _OFFSETS[name]
        q1, median, q3, worst = limits.clip([s.quartile_1, s.median, s.quartile_3, s.worst])
        axes.plot([median, worst], [y, y], color=style.colour, linewidth=0.9, zorder=2)
        axes.plot([worst], [y], color=style.colour, marker="|", markersize=6, zorder=2)
        axes.plot(
            [q1, q3],
            [y, y],
            color=style.colour,
            linewidth=3.6,
            alpha=0.45,
            solid_capstyle="butt",
            zorder=3,
        )
        axes.plot(
            [median],
            [y],
            color=style.colour,
            marker=style.marker,
            markersize=5,
            markeredgecolor="white",
            markeredgewidth=0.5,
            zorder=4,
        )
        _edges(axes, y, s, limits, style.colour)


def _edges(axes: Axes, y: float, s: ErrorSummary, limits: LogRange, colour: str) -> None:
    """Write what a marker on the edge of the axis stands for."""
    if limits.below([s.median]):
        axes.text(
            10.0**limits.low,
            y,
            "   zero" if s.median == 0 else f"   below {power_of_ten(limits.low)}",
            color=colour,
            va="center",
            fontsize=8,
        )
    if limits.above([s.worst]):
        word = "not finite" if s.failures else f"above {power_of_ten(limits.high)}"
        axes.text(
            10.0**limits.high, y, f"{word}  ", color=colour, va="center", ha="right", fontsize=8
        )


def _swatch(axes: Axes, row: int, style: LearnerStyle) -> None:
    """Draw the learner's colour and marker between its name and the axis."""
    axes.plot(
        [-0.018],
        [row],
        transform=axes.get_yaxis_transform(),
        linestyle="",
        clip_on=False,
        markersize=6.5,
        **style.marker_options,
    )


def _legend(figure: Figure, learners: list[LearnerResult]) -> None:
    handles = [
        Line2D([], [], color=s.colour, marker=s.marker, linestyle="", label=_count(learners, name))
        for name, s in SET_STYLES.items()
    ]
    handles += [
        Line2D([], [], color="#7B8794", linewidth=3.6, alpha=0.5, label="quartiles"),
        Line2D([], [], color="#7B8794", linewidth=0.9, marker="|", label="to the worst"),
        Line2D([], [], color="#4B5563", linestyle=":", label="bare point mass, extrapolation"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, columnspacing=1.6)


def _count(learners: list[LearnerResult], name: str) -> str:
    count = learners[0].summaries[name].count
    return f"{SET_STYLES[name].title} median ({count} samples)"
