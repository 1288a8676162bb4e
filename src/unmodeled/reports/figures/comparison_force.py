"""The acceleration that the residuals ask for, along the orbit."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from unmodeled.pipeline.comparison.free_force import FreeForce
from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.reports.figures.comparison_in_time import COMPONENT_COLOURS, time_unit
from unmodeled.reports.numbers import engineering
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["comparison_force", "force_along_orbit"]

_TITLES = {"R": "radial", "T": "transverse", "N": "normal"}


def comparison_force(comparison: Comparison) -> Figure | None:
    """Draw the reconstructed acceleration on R, T, N with its band of two sigmas.

    The dashed lines are two sigmas of the prior: where the band reaches them the data say nothing.

    Returns
    -------
    Figure or None
        None if no force is as likely as none.
    """
    return force_along_orbit(comparison.force)


def force_along_orbit(force: FreeForce, learned: pd.DataFrame | None = None) -> Figure | None:
    """Draw the same, and what was learned of it.

    Parameters
    ----------
    force : FreeForce
        Reconstructed acceleration.
    learned : DataFrame, optional
        Columns R, T, N, m/s2, at its nodes.

    Returns
    -------
    Figure or None
        None if no force is as likely as none.
    """
    if force.prior_sigma == 0:
        return None
    table = force.table
    per, unit = time_unit(float(np.ptp(table["t_s"])))
    top = 2 * force.prior_sigma
    if learned is not None:
        top = max(top, float(learned.abs().to_numpy().max()))
    for axis in "RTN":
        top = max(top, float((table[axis].abs() + 2 * table[f"sigma_{axis}"]).max()))
    factor, prefix = engineering(top)
    with figure_style():
        figure = new_figure(4.9)
        panels = figure.subplots(3, sharex=True, sharey=True)
        for a, axis, colour in zip(panels, "RTN", COMPONENT_COLOURS, strict=False):
            for _, arc in table.groupby("arc", sort=False):
                t = arc["t_s"].to_numpy() / per
                value = arc[axis].to_numpy() * factor
                band = 2 * arc[f"sigma_{axis}"].to_numpy() * factor
                a.fill_between(t, value - band, value + band, color=colour, alpha=0.2, linewidth=0)
                a.plot(t, value, color=colour, marker="." if len(t) < 20 else None)
                if learned is not None:
                    curve = learned.loc[arc.index, axis].to_numpy() * factor
                    a.plot(t, curve, color="#111827", linewidth=1.1, linestyle=":")
            a.axhline(0.0, color="#7B8794", linewidth=0.6, zorder=1)
            for sign in (-2, 2):
                level = sign * force.prior_sigma * factor
                a.axhline(level, color="#7B8794", linewidth=0.9, linestyle="--", zorder=1)
            a.set_ylabel(f"{prefix}m/s²")
            a.set_title(_TITLES[axis])
        panels[-1].set_xlabel(f"time since the epoch, {unit}")
        handles = [
            Line2D([], [], color="#4B5563", label="reconstructed acceleration"),
            Patch(color="#4B5563", alpha=0.2, label="2 sigmas"),
            Line2D([], [], color="#7B8794", linestyle="--", label="2 sigmas of the prior"),
        ]
        if learned is not None:
            dotted = Line2D([], [], color="#111827", linestyle=":", label="learned")
            handles.insert(1, dotted)
        figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))
    return figure
