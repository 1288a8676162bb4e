"""One figure: error on other orbits against noise, a line for each learner."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from skill.fields import FIELDS
from skill.learners import ORACLE
from unmodeled.pipeline.config import LearnerConfig
from unmodeled.pipeline.use_check import DO_NOT_USE
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.style import LearnerStyle, figure_style, learner_styles, new_figure, short

__all__ = ["error_against_noise", "styles_of"]

_AXES = {
    "sigma_a": "σa: noise of the acceleration, normalised units",
    "sigma_s": "σs: noise of the position, Brillouin radii",
}


def styles_of(cells: pd.DataFrame) -> dict[str, LearnerStyle]:
    """Return the project's style of each learner; every oracle has that of the zonal one."""
    rows = cells[["learner", "kind", "baseline"]].drop_duplicates("learner")
    configs: list[LearnerConfig] = []
    for row in rows.itertuples():
        kind = "zonal_oracle" if row.learner == ORACLE else row.kind
        given = {"kind": kind, "baseline": row.baseline, "label": row.learner}
        configs.append(LearnerConfig.model_validate(given))
    return learner_styles(configs)


def error_against_noise(cells: pd.DataFrame, volume: str) -> Figure:
    """Draw a row of panels a field: against sigma_a on the left, sigma_s on the right.

    A cross through a marker: most of the runs' own reports say "do not use".

    Parameters
    ----------
    cells : DataFrame
        Of `summarize_cells`.
    volume : str
        Which volume is drawn.
    """
    own = cells[cells["volume"] == volume]
    styles = styles_of(cells)
    fields = [name for name in FIELDS if name in set(own["field"])]
    learners = [name for name in styles if name in set(own["learner"])]
    limits = LogRange.around([own["extrapolation_median"]], floor=1e-9, ceiling=1e1)
    with figure_style():
        figure = new_figure(1.2 + 2.05 * len(fields))
        shown = [axis for axis in _AXES if len(set(own[axis])) > 1] or list(_AXES)[:1]
        size = len(fields), len(shown)
        grid = figure.subplots(*size, sharex="col", sharey=True, squeeze=False)
        for name, pair in zip(fields, grid, strict=True):
            for axis, axes in zip(shown, pair, strict=True):
                other = "sigma_s" if axis == "sigma_a" else "sigma_a"
                part = own[(own["field"] == name) & (own[other] == 0)]
                _draw(axes, part, axis, learners, styles, limits)
            pair[0].set_title(FIELDS[name].title)
        for axis, axes in zip(shown, grid[-1], strict=True):
            axes.set_xlabel(_AXES[axis])
        figure.supylabel("median fractional error on another orbit", fontsize=8.5)
        figure.legend(
            handles=_legend(learners, styles),
            loc="outside lower center",
            ncols=3,
            fontsize=7,
        )
    return figure


def _draw(
    axes: Axes,
    part: pd.DataFrame,
    axis: str,
    learners: Sequence[str],
    styles: dict[str, LearnerStyle],
    limits: LogRange,
) -> None:
    levels = sorted(set(part[axis]))
    place = {level: k for k, level in enumerate(levels)}
    for name in learners:
        line = part[part["learner"] == name].sort_values(axis)
        if line.empty:
            continue
        x = np.array([place[v] for v in line[axis]], dtype=float)
        y = limits.clip(line["extrapolation_median"].fillna(np.inf))
        style = styles[name]
        front = 3 if name == ORACLE or "harmonic" in name else 2
        axes.plot(x, y, style.line, color=style.colour, zorder=front, **style.marker_options)
        bad = (line["verdict"] == DO_NOT_USE).to_numpy()
        axes.plot(x[bad], y[bad], "x", color="#111111", markersize=6, mew=0.8, zorder=4)
    axes.set_yscale("log")
    axes.set_ylim(*limits.limits)
    decades(axes.yaxis, limits)
    axes.set_xticks(range(len(levels)), [f"{v:g}" for v in levels])
    axes.set_xlim(-0.25, max(len(levels) - 0.75, 0.25))


def _legend(learners: Sequence[str], styles: dict[str, LearnerStyle]) -> list[Line2D]:
    handles = [
        Line2D(
            [],
            [],
            color=styles[name].colour,
            linestyle=styles[name].line,
            label=short(name, 36),
            **styles[name].marker_options,
        )
        for name in learners
    ]
    cross = Line2D([], [], color="#111111", marker="x", linestyle="", label=f"says: {DO_NOT_USE}")
    return [*handles, cross]
