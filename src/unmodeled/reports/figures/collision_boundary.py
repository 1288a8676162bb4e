"""Colliding and collision-free initial conditions in a and e, [Neamati2022] Fig. 4."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from unmodeled.pipeline.trends.collision_boundary import Boundary
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["collision_boundary_figure"]

# Not the colours of learners.
_FREE, _HIT = "#0F766E", "#9F1239"
# More points than this hide each other on a printed page; the boundary is fitted to all.
_MOST_POINTS = 4000


def collision_boundary_figure(screened: pd.DataFrame, boundary: Boundary) -> Figure:
    """Draw every initial condition, the fitted line and Kepler's boundary.

    Parameters
    ----------
    screened : DataFrame
        From `screen`; the first 4,000 are drawn.
    boundary : Boundary
        Fitted to all of them.
    """
    shown = screened.iloc[:_MOST_POINTS]
    hit = shown["entry_periods"].notna()
    size = float(np.clip(3000 / len(shown), 2.5, 14))
    with figure_style():
        figure = new_figure(4.2)
        axes = figure.add_subplot()
        for mask, colour, marker, word in (
            (hit, _HIT, "x", "colliding"),
            (~hit, _FREE, "o", "collision-free"),
        ):
            part = shown[mask]
            axes.scatter(
                part["semi_major_axis"],
                part["eccentricity"],
                s=size,
                color=colour,
                marker=marker,
                linewidths=0.6 if marker == "x" else 0,
                alpha=0.75,
                rasterized=True,
                label=f"{word} ({len(part)})",
            )
        low, high = (float(f(screened["semi_major_axis"])) for f in (np.min, np.max))
        a = np.linspace(low, high, 200)
        sign = "−" if boundary.intercept < 0 else "+"
        line = f"straight line e = {boundary.slope:.3f} a {sign} {abs(boundary.intercept):.3f}"
        axes.plot(a, boundary.slope * a + boundary.intercept, color="#111111", label=line)
        axes.plot(
            a, 1 - 1 / a, color="#111111", linestyle="--", label="Kepler periapsis on the sphere"
        )
        bottom, top = (float(f(screened["eccentricity"])) for f in (np.min, np.max))
        axes.set_xlim(low - 0.02 * (high - low), high + 0.02 * (high - low))
        axes.set_ylim(max(bottom - 0.02, 0.0), top + 0.02)
        axes.set_xlabel("semi-major axis at the start, Brillouin radii")
        axes.set_ylabel("eccentricity at the start, dimensionless")
        figure.legend(loc="outside upper center", ncols=2, markerscale=1.6, columnspacing=1.8)
    return figure
