"""The data in space: training orbit, held-out samples, other orbits and the body."""

from __future__ import annotations

from typing import cast

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from unmodeled.core.arrays import Array
from unmodeled.core.frames import body_fixed_from_inertial, turned
from unmodeled.datasets.learning_data import LearningData
from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.reports.numbers import engineering
from unmodeled.reports.smooth import smooth_orbit
from unmodeled.reports.style import SET_STYLES, figure_style, new_figure

__all__ = ["trajectories"]

_SPHERE = (40, 20)
_HEIGHT, _SHARE = 4.2, 0.68


def trajectories(result: CharacterizationResult) -> Figure:
    """Draw the orbits in three dimensions with equal scales, as in [Neamati2022] Figs. 7a and 8a.

    Parameters
    ----------
    result : CharacterizationResult
        What to draw.
    """
    data = result.data
    largest = max(float(o.radii.max()) for o in data.orbits)
    factor, prefix = engineering(largest)
    with figure_style():
        figure = new_figure(_HEIGHT)
        figure.set_layout_engine("none")
        axes = cast(Axes3D, figure.add_axes((-0.01, 0.02, _SHARE, 1.02), projection="3d"))
        _sphere(axes, data.units.length * factor)
        _orbits(axes, data, factor)
        for name in "xyz":
            getattr(axes, f"set_{name}label")(f"{name}, {prefix}m", labelpad=1)
            getattr(axes, f"{name}axis").set_pane_color((1, 1, 1, 0))
            axes.tick_params(axis=name, pad=0)
            axes.locator_params(axis=name, nbins=5)
        axes.set_aspect("equal")
        axes.view_init(elev=24, azim=-52)
        figure.legend(loc="center left", bbox_to_anchor=(_SHARE + 0.03, 0.5), labelspacing=0.9)
    return figure


def _sphere(axes: Axes3D, radius: float) -> None:
    turns, heights = np.meshgrid(
        np.linspace(0, 2 * np.pi, _SPHERE[0]), np.linspace(0, np.pi, _SPHERE[1])
    )
    axes.plot_surface(
        radius * np.cos(turns) * np.sin(heights),
        radius * np.sin(turns) * np.sin(heights),
        radius * np.cos(heights),
        color="#C9CFD6",
        alpha=0.6,
        linewidth=0,
        antialiased=False,
        rasterized=True,
        label="Brillouin sphere",
    )


def _orbits(axes: Axes3D, data: LearningData, factor: float) -> None:
    unit = data.units.length * factor
    curves = [smooth_orbit(o, data.units).positions * unit for o in data.orbits]
    others = [curves[k] for k in data.extrapolation_orbits]
    train = [x for k, x in enumerate(curves) if k not in data.extrapolation_orbits]
    look = SET_STYLES
    # Many orbits become thin and pale, so that the training orbit stays visible.
    alpha = 0.9 if len(others) <= 2 else 0.45
    for k, x in enumerate(others):
        word = "extrapolation orbit" + (f"s ({len(others)})" if len(others) > 1 else "")
        _line(axes, x, look["extrapolation"].colour, 0.9, alpha, "" if k else word)
        _ends(axes, x, look["extrapolation"].colour)
    for k, x in enumerate(train):
        word = "training orbit" + (f"s ({len(train)})" if len(train) > 1 else "")
        _line(axes, x, look["train"].colour, 0.9, 1.0 / len(train) ** 0.25, "" if k else word)
        _ends(axes, x, look["train"].colour)
    turn = body_fixed_from_inertial(data.interpolation.times, data.learned_spin_rate)
    held = turned(turn.mT, data.interpolation.positions) * unit
    axes.scatter(
        held[:, 0],
        held[:, 1],
        held[:, 2],
        marker=look["interpolation"].marker,
        color=look["interpolation"].colour,
        s=16,
        depthshade=False,
        rasterized=True,
        label=f"interpolation ({len(held)} samples)",
    )
    for marker, word in (("o", "start of an orbit"), ("^", "end of an orbit")):
        axes.plot(
            [],
            [],
            [],
            linestyle="",
            marker=marker,
            color="white",
            markeredgecolor="black",
            label=word,
        )


def _line(axes: Axes3D, x: Array, colour: str, width: float, alpha: float, label: str) -> None:
    axes.plot(
        x[:, 0],
        x[:, 1],
        x[:, 2],
        color=colour,
        linewidth=width,
        alpha=alpha,
        rasterized=True,
        label=label or "_",
    )


def _ends(axes: Axes3D, x: Array, colour: str) -> None:
    for k, marker in ((0, "o"), (-1, "^")):
        axes.plot(
            [x[k, 0]],
            [x[k, 1]],
            [x[k, 2]],
            marker=marker,
            color=colour,
            markeredgecolor="black",
            markeredgewidth=0.6,
            markersize=5,
            linestyle="",
        )
