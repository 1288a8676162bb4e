"""Test point B: how far a flown orbit is from the true one."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.style import LearnerStyle, figure_style, learner_styles, new_figure, short

__all__ = ["flight_error"]


def flight_error(result: CharacterizationResult) -> Figure | None:
    """Draw position error against time, a panel an orbit, the training orbit first.

    A cross marks where a flight ended early. The horizontal line is the largest error of flying
    the *true* field with the same solver: below it there is nothing to see.

    Parameters
    ----------
    result : CharacterizationResult
        What to draw.

    Returns
    -------
    Figure or None
        None if nothing was flown.
    """
    orbits = sorted({f.orbit for r in result.learners for f in r.flights})
    if not orbits:
        return None
    floor = result.flight_floor
    errors = [f.flight.position_error[1:] for r in result.learners for f in r.flights]
    limits = LogRange.around([*errors, [floor]], floor=1e-9, ceiling=1e9)
    columns = min(len(orbits), 2)
    rows = math.ceil(len(orbits) / columns)
    with figure_style():
        styles = learner_styles(result.config.learners)
        figure = new_figure(0.9 + 2.3 * rows + 0.16 * math.ceil(len(styles) / 3))
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for k, axes in enumerate(grid.flat):
            if k >= len(orbits):
                axes.set_visible(False)
                continue
            if math.isfinite(floor):
                axes.axhline(floor, color="#1F2933", linestyle=(0, (1, 2)), linewidth=0.9)
            _panel(axes, result, orbits[k], styles, limits)
            axes.tick_params(labelbottom=k + columns >= len(orbits))
        figure.supxlabel("time, Kepler periods of the orbit", fontsize=8.5)
        figure.supylabel("position error, m", fontsize=8.5)
        _legend(figure, result, styles)
    return figure


def _panel(
    axes: Axes,
    result: CharacterizationResult,
    orbit: int,
    styles: dict[str, LearnerStyle],
    limits: LogRange,
) -> None:
    for k, learner in enumerate(result.learners):
        style = styles[learner.label]
        for f in learner.flights:
            if f.orbit != orbit:
                continue
            periods = f.flight.times[1:] / f.period
            error = limits.clip(f.flight.position_error[1:])
            every = max(1, len(error) // 8)
            axes.plot(
                periods,
                error,
                color=style.colour,
                linestyle=style.line,
                markevery=(k % every, every),
                markersize=3.5,
                zorder=3,
                **style.marker_options,
            )
            if f.flight.status != "complete":
                # A flight that ended at once has its cross at the start.
                end = (periods[-1], error[-1]) if len(error) else (0.0, 10.0**limits.low)
                axes.plot(
                    *end,
                    marker="x",
                    color=style.colour,
                    markersize=8,
                    markeredgewidth=1.8,
                    clip_on=False,
                )
    title = "training orbit" if orbit == 0 else f"extrapolation orbit {orbit}"
    axes.set_title(title)
    axes.set_yscale("log")
    axes.set_ylim(limits.limits)
    decades(axes.yaxis, limits)
    axes.set_xlim(0, 1.02 * max(result.config.flight.periods))


def _legend(
    figure: Figure, result: CharacterizationResult, styles: dict[str, LearnerStyle]
) -> None:
    handles = [
        Line2D(
            [],
            [],
            color=styles[r.label].colour,
            linestyle=cast(Any, styles[r.label].line),
            label=short(r.label, 30),
            **styles[r.label].marker_options,
        )
        for r in result.learners
        if r.flights
    ]
    if any(f.flight.status != "complete" for r in result.learners for f in r.flights):
        handles.append(
            Line2D([], [], color="#1F2933", marker="x", linestyle="", label="flight ended early")
        )
    if np.isfinite(result.flight_floor):
        handles.append(
            Line2D([], [], color="#1F2933", linestyle=(0, (1, 2)), label="true field, same solver")
        )
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
