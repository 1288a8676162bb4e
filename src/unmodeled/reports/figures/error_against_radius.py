"""Where a model fails: fractional error against radius, a panel a learner."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodeled.datasets.learning_data import LearningData
from unmodeled.pipeline.results import CharacterizationResult, LearnerResult
from unmodeled.pipeline.use_check import point_mass_summaries
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.numbers import engineering, power_of_ten
from unmodeled.reports.style import (
    SET_STYLES,
    LearnerStyle,
    figure_style,
    learner_styles,
    new_figure,
    short,
)

__all__ = ["error_against_radius"]

# Errors at rounding level lie on the lower edge: the head-to-head figure shows how low they are.
_FLOOR = 1e-10
_SIZES = {"train": 7, "interpolation": 13, "extrapolation": 8}
# The many extrapolation points lie behind the few interpolation ones.
_ORDER = ("extrapolation", "train", "interpolation")


def error_against_radius(result: CharacterizationResult) -> Figure | None:
    """Draw the pointwise errors of the three sets, as in [Neamati2022] Figs. 7 and 8.

    All panels share both axes. Errors below 1e-10 lie on the lower edge, infinite ones on the
    upper edge, with their number in the corner.

    Parameters
    ----------
    result : CharacterizationResult
        What to draw.

    Returns
    -------
    Figure or None
        None if no learner has errors.
    """
    learners = [r for r in result.learners if r.errors]
    if not learners:
        return None
    limits = LogRange.around([e for r in learners for e in r.errors.values()], floor=_FLOOR)
    columns = min(len(learners), 2 if len(learners) <= 4 else 3)
    rows = math.ceil(len(learners) / columns)
    with figure_style():
        figure = new_figure(1.0 + 1.9 * rows)
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        styles = learner_styles(result.config.learners)
        reference = point_mass_summaries(result.data)["extrapolation"].median
        for k, axes in enumerate(grid.flat):
            if k >= len(learners):
                axes.set_visible(False)
                continue
            axes.axhline(
                float(limits.clip(reference)),
                color="#4B5563",
                linestyle=":",
                linewidth=1.0,
                zorder=1,
            )
            _panel(axes, learners[k], result.data, limits, styles[learners[k].label])
            if k + columns >= len(learners):  # lowest panel of its column
                axes.tick_params(labelbottom=True)
            if k < columns:
                _second_axis(axes, result.data)
        figure.supxlabel("radius, Brillouin radii", fontsize=8.5)
        figure.supylabel("fractional acceleration error, dimensionless", fontsize=8.5)
        _legend(figure)
    return figure


def _panel(
    axes: Axes, learner: LearnerResult, data: LearningData, limits: LogRange, style: LearnerStyle
) -> None:
    sets = {s.name: s for s in data.sets}
    for name in _ORDER:
        look = SET_STYLES[name]
        radius = np.linalg.norm(sets[name].positions, axis=1)
        axes.scatter(
            radius,
            limits.clip(learner.errors[name]),
            s=_SIZES[name],
            marker=look.marker,
            color=look.colour,
            alpha=0.9 if name == "interpolation" else 0.45,
            linewidths=0,
            rasterized=True,
            zorder=3,
        )
    axes.set_yscale("log")
    axes.set_ylim(limits.limits)
    decades(axes.yaxis, limits)
    axes.plot(
        [0.035],
        [1.075],
        transform=axes.transAxes,
        linestyle="",
        clip_on=False,
        markersize=6,
        **style.marker_options,
    )
    axes.text(0.075, 1.075, short(learner.label, 28), transform=axes.transAxes, va="center")
    _count_edges(axes, learner, limits)


def _count_edges(axes: Axes, learner: LearnerResult, limits: LogRange) -> None:
    everything = np.concatenate(list(learner.errors.values()))
    above, below = limits.above(everything), limits.below(everything)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    if above:
        axes.text(
            0.98, 0.93, f"{above} above", transform=axes.transAxes, ha="right", va="top", bbox=box
        )
    if below:
        text = f"{below} below {power_of_ten(limits.low)}"
        axes.text(0.98, 0.07, text, transform=axes.transAxes, ha="right", bbox=box)


def _second_axis(axes: Axes, data: LearningData) -> None:
    """Put the same radius in metres above the top panels."""
    largest = max(float(np.linalg.norm(s.positions, axis=1).max()) for s in data.sets)
    factor, prefix = engineering(largest * data.units.length)
    scale = data.units.length * factor

    def metres(radii: Any) -> Any:
        return radii * scale

    def radii(metres: Any) -> Any:
        return metres / scale

    top = axes.secondary_xaxis(1.16, functions=(metres, radii))
    top.set_xlabel(f"radius, {prefix}m")
    top.spines["top"].set_color("#7B8794")


def _legend(figure: Figure) -> None:
    handles = [
        Line2D([], [], color=s.colour, marker=s.marker, linestyle="", markersize=5, label=s.title)
        for s in SET_STYLES.values()
    ]
    handles.append(
        Line2D(
            [], [], color="#4B5563", linestyle=":", label="bare point mass, extrapolation median"
        )
    )
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
