"""One figure: error on other orbits by learner, field and noise, against the bare point mass."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from skill.fields import FIELDS
from skill.learners import ORACLE, REFERENCES
from unmodeled.pipeline.config import LearnerConfig
from unmodeled.pipeline.use_check import DO_NOT_USE
from unmodeled.reports.style import LearnerStyle, figure_style, learner_styles, new_figure, short

__all__ = ["error_map", "styles_of"]

#: Ratios to the point mass are coloured up to so many decades on either side.
_DECADES = 2.0
_ROW, _HEAD = 0.152, 0.62  # inches


def styles_of(cells: pd.DataFrame) -> dict[str, LearnerStyle]:
    """Return the project's style of each learner; every oracle has that of the zonal one."""
    rows = cells[["learner", "kind", "baseline"]].drop_duplicates("learner")
    configs: list[LearnerConfig] = []
    for row in rows.itertuples():
        kind = "zonal_oracle" if row.learner == ORACLE else row.kind
        given = {"kind": kind, "baseline": row.baseline, "label": row.learner}
        configs.append(LearnerConfig.model_validate(given))
    return learner_styles(configs)


def error_map(cells: pd.DataFrame, volume: str) -> Figure:
    """Draw a table for each field: learners down, noise across, the median error in each cell.

    The colour is the error over the bare point mass's on the same pairs of orbits. Bold: most of
    the runs' own reports say "do not use". Learners are in the order of their median ratio over
    all cells, references first.

    Parameters
    ----------
    cells : DataFrame
        Of `summarize_cells`.
    volume : str
        Which volume is drawn.
    """
    own = cells[cells["volume"] == volume]
    own = own.assign(ratio=own["extrapolation_median"] / own["extrapolation_point_mass"])
    styles = styles_of(cells)
    fields = [name for name in FIELDS if name in set(own["field"])]
    learners = _order(own)
    levels = sorted(set(zip(own["sigma_s"], own["sigma_a"], strict=True)))
    columns = min(2, len(fields))
    rows = -(-len(fields) // columns)
    with figure_style():
        figure = new_figure(0.45 + rows * (_HEAD + _ROW * len(learners)))
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat[len(fields) :]:
            axes.set_visible(False)
        for k, (axes, name) in enumerate(zip(grid.flat, fields, strict=False)):
            drawn = _table(axes, own[own["field"] == name], learners, levels)
            axes.set_title(short(FIELDS[name].title, 46), fontsize=7.5)
            axes.grid(visible=False)
            axes.set_xticks(range(len(levels)), [_level(*v) for v in levels], fontsize=5.5)
            axes.tick_params(length=0, labelbottom=True)
            if k % columns == 0:
                _names(axes, learners, styles)
        bar = figure.colorbar(drawn, ax=grid, location="bottom", fraction=0.02, pad=0.01, aspect=50)
        ticks = np.arange(-_DECADES, _DECADES + 1)
        bar.set_ticks(ticks, labels=[f"{10.0**t:g}" for t in ticks])
        bar.ax.tick_params(labelsize=6.5)
        bar.set_label(
            "colour: error over the bare point mass's; number: median error on another orbit, "
            f"bold: says “{DO_NOT_USE}”\nnoise: σs in Brillouin radii, σa in normalised units",
            fontsize=7,
        )
    return figure


def _order(own: pd.DataFrame) -> list[str]:
    """Return the learners, references first, then by their median ratio to the point mass."""
    median = own.groupby("learner")["ratio"].median().sort_values(kind="stable")
    kinds = own.drop_duplicates("learner").set_index("learner")["kind"]
    reference = [n for n in median.index if n == ORACLE or kinds[n] in REFERENCES]
    return [*reference, *(n for n in median.index if n not in reference)]


def _table(
    axes: Axes,
    own: pd.DataFrame,
    learners: Sequence[str],
    levels: Sequence[tuple[float, float]],
) -> mpl.image.AxesImage:
    ratio = np.full((len(learners), len(levels)), np.nan)
    for cell in own.itertuples():
        row, column = learners.index(cell.learner), levels.index((cell.sigma_s, cell.sigma_a))
        ratio[row, column] = np.log10(max(cell.ratio, 1e-300))
        bad = cell.verdict == DO_NOT_USE
        strong = abs(ratio[row, column]) > 0.65 * _DECADES
        axes.text(
            column,
            row,
            _number(cell.extrapolation_median),
            ha="center",
            va="center",
            fontsize=5.2,
            fontweight="bold" if bad else "normal",
            color="white" if strong else "#111111",
        )
    colours = mpl.colormaps["BrBG_r"].with_extremes(bad="#E5E7EB")
    return axes.imshow(ratio, cmap=colours, vmin=-_DECADES, vmax=_DECADES, aspect="auto")


def _names(axes: Axes, learners: Sequence[str], styles: dict[str, LearnerStyle]) -> None:
    """Write the learners beside the rows, each with its marker."""
    axes.set_yticks(range(len(learners)), [short(n, 32) for n in learners], fontsize=6)
    axes.tick_params(axis="y", pad=9)
    place = axes.get_yaxis_transform()
    for row, name in enumerate(learners):
        mark = Line2D([-0.025], [row], transform=place, linestyle="", clip_on=False, markersize=4)
        mark.set(**styles[name].marker_options)
        if "color" not in styles[name].marker_options:
            mark.set_color(styles[name].colour)
        axes.add_line(mark)


def _level(state: float, acceleration: float) -> str:
    if state:
        return f"σs\n{state:g}"
    return f"σa\n{acceleration:g}" if acceleration else "no\nnoise"


def _number(value: float) -> str:
    """Return two digits in as few characters as possible.

    Examples
    --------
    >>> [_number(v) for v in (4.4e-16, 0.0123, 0.46, 8.2, float("inf"))]
    ['4e-16', '.012', '.46', '8.2', '∞']
    """
    if not np.isfinite(value):
        return "∞"
    if value < 1e-3:
        mantissa, power = f"{value:.0e}".split("e")
        return f"{mantissa}e{int(power)}"
    return f"{value:.2g}".lstrip("0") or "0"
