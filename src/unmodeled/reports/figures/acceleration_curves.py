"""True and predicted acceleration along the orbits as curves in acceleration space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from unmodeled.core.arrays import Array
from unmodeled.core.frames import body_fixed_from_inertial, turned
from unmodeled.pipeline.inputs import learned_force
from unmodeled.pipeline.results import CharacterizationResult, LearnerResult
from unmodeled.reports.numbers import engineering
from unmodeled.reports.smooth import smooth_orbit
from unmodeled.reports.style import (
    LearnerStyle,
    figure_style,
    learner_styles,
    new_figure,
    short,
)

__all__ = ["acceleration_curves", "shown_periods"]

_MOST_PERIODS = 3.0
_TRUTH = "#111111"
_CELL, _LEGEND, _LIFT = 2.5, 0.35, 0.15  # inches
# Predictions farther out than this many times half the box are not drawn.
_MARGIN = 1.25


def shown_periods(result: CharacterizationResult) -> float:
    """Return how many periods of an orbit are drawn at most: more would only overlap."""
    data = result.data
    ends = [
        float(o.times[-1] - o.times[0]) / p
        for o, p in zip(data.orbits[:2], data.periods, strict=False)
    ]
    return min(_MOST_PERIODS, max(ends))


def acceleration_curves(
    result: CharacterizationResult, labels: Sequence[str] | None = None
) -> Figure | None:
    """Draw a row a learner: training orbit left, first extrapolation orbit right.

    As in [Neamati2022] Fig. 5, a circle marks the start, a triangle the end. The box is that of
    the true curve; predictions that leave it are cut, and their share is written in the panel.

    Parameters
    ----------
    result : CharacterizationResult
        What to draw.
    labels : sequence of str, optional
        Which learners; all that were fitted if not given.

    Returns
    -------
    Figure or None
        None if no such learner was fitted.
    """
    learners = [
        r
        for r in result.learners
        if r.learner is not None and (labels is None or r.label in labels)
    ]
    if not learners:
        return None
    height = _LEGEND + _CELL * len(learners)
    with figure_style():
        styles = learner_styles(result.config.learners)
        figure = new_figure(height)
        figure.set_layout_engine("none")  # it leaves three-dimensional axes far too much room
        for row, learner in enumerate(learners):
            top = 1 - (_LEGEND + row * _CELL) / height
            for orbit in (0, 1):
                place = (0.5 * orbit, top - (_CELL - _LIFT) / height, 0.46, (_CELL + 0.05) / height)
                axes = cast(Axes3D, figure.add_axes(place, projection="3d"))
                axes.patch.set_visible(False)  # the cells overlap a little
                _panel(axes, result, learner, orbit, styles[learner.label])
                _title(figure, learner, orbit, styles[learner.label], top - 0.1 / height)
        _legend(figure)
    return figure


def _panel(
    axes: Axes3D,
    result: CharacterizationResult,
    learner: LearnerResult,
    orbit: int,
    style: LearnerStyle,
) -> None:
    data = result.data
    assert learner.learner is not None
    curve = smooth_orbit(data.orbits[orbit], data.units, _MOST_PERIODS * data.periods[orbit])
    true = curve.accelerations * data.units.acceleration
    turn = body_fixed_from_inertial(curve.times, data.learned_spin_rate)
    force = learned_force(learner.learner, result.field(learner.label).features, data)
    places, speeds = turned(turn, curve.positions), turned(turn, curve.velocities)
    predicted = force(places, speeds, curve.times) * data.units.acceleration
    predicted = turned(turn.mT, predicted)
    factor, prefix = engineering(float(np.abs(true).max()))
    true, predicted = true * factor, predicted * factor
    middle, half = _box(true)
    outside = np.any(~(np.abs(predicted - middle) <= _MARGIN * half), axis=1)
    _curve(axes, true, _TRUTH, "-", 0.9)
    _curve(axes, np.where(outside[:, None], np.nan, predicted), style.colour, style.line, 1.5)
    for name, low, high in zip("xyz", middle - half, middle + half, strict=True):
        getattr(axes, f"set_{name}lim")(low, high)
        label = getattr(axes, f"set_{name}label")(f"$a_{name}$, {prefix}m/s²", labelpad=-1)
        label.set_parse_math(True)
        getattr(axes, f"{name}axis").set_pane_color((1, 1, 1, 0))
        axes.tick_params(axis=name, pad=-2)
        axes.locator_params(axis=name, nbins=4)
    axes.set_box_aspect((1, 1, 1), zoom=0.88)
    axes.view_init(elev=22, azim=-55)
    if outside.any():
        share = f"{outside.mean():.0%} of the prediction lies outside the box"
        axes.text2D(0.5, 0.86, share, transform=axes.transAxes, ha="center", fontsize=8)


def _box(true: Array) -> tuple[Array, float]:
    """Return middle and half edge of a cube about the true curve: equal scales on all axes."""
    low, high = true.min(axis=0), true.max(axis=0)
    return (low + high) / 2, 0.55 * float((high - low).max())


def _curve(axes: Axes3D, a: Array, colour: str, line: str, width: float) -> None:
    axes.plot(
        a[:, 0], a[:, 1], a[:, 2], color=colour, linestyle=line, linewidth=width, rasterized=True
    )
    for k, marker in ((0, "o"), (-1, "^")):
        if np.isfinite(a[k]).all():
            axes.plot(
                [a[k, 0]],
                [a[k, 1]],
                [a[k, 2]],
                linestyle="",
                marker=marker,
                markersize=5,
                color=colour,
                markeredgecolor="black",
                markeredgewidth=0.6,
            )


def _title(
    figure: Figure, learner: LearnerResult, orbit: int, style: LearnerStyle, y: float
) -> None:
    x = 0.5 * orbit + 0.02
    figure.add_artist(Line2D([x], [y], linestyle="", markersize=6, **style.marker_options))
    where = "training orbit" if orbit == 0 else "extrapolation orbit 1"
    figure.text(x + 0.017, y, f"{short(learner.label, 24)}, {where}", va="center", fontsize=8.5)


def _legend(figure: Figure) -> None:
    marker = {"linestyle": "", "color": "white", "markeredgecolor": "black"}
    handles = [
        Line2D([], [], color=_TRUTH, linewidth=0.9, label="true"),
        Line2D([], [], color="#7B8794", linewidth=1.5, label="predicted, in the learner's colour"),
        Line2D([], [], marker="o", label="start", **marker),  # type: ignore[arg-type]
        Line2D([], [], marker="^", label="end", **marker),  # type: ignore[arg-type]
    ]

    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 1.0), ncols=4)
