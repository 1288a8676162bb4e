"""The radius inside which each zonal term matters, [Neamati2022] Fig. 1."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from unmodeled.pipeline.trends.zonal_reach import ZonalReach
from unmodeled.reports.numbers import engineering, number
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["zonal_radius"]

# Degrees are no learners: hues that no learner has, and lines that differ in print.
_LINES = (("#C2410C", "-"), ("#0E7490", "--"), ("#6D28D9", "-."), ("#4D7C0F", ":"))
_SPHERE = "#1F2933"


def zonal_radius(reach: ZonalReach) -> Figure:
    """Draw the contours in the meridian plane, to scale, with the Brillouin sphere.

    A panel of radius against co-latitude beside them reads off the numbers.

    Parameters
    ----------
    reach : ZonalReach
        From `zonal_reach`.
    """
    body = reach.body
    factor, prefix = engineering(body.brillouin_radius)
    with figure_style():
        figure = new_figure(3.7)
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.05))
        unit = body.brillouin_radius
        around = np.concatenate([reach.colatitude, 2 * np.pi - reach.colatitude[::-1]])
        for k, (degree, radius) in enumerate(reach.radius.items()):
            colour, line = _LINES[k % len(_LINES)]
            name = (
                f"J{str(degree).translate(_SUBSCRIPT)}: at most {number(reach.largest(degree), 3)}"
            )
            both = np.concatenate([radius, radius[::-1]]) / unit
            style = {"color": colour, "linestyle": line, "linewidth": 1.4}
            left.plot(both * np.sin(around), both * np.cos(around), **style)
            right.plot(np.rad2deg(reach.colatitude), radius / unit, label=name, **style)
        left.add_patch(Circle((0, 0), 1.0, facecolor="#E4E7EB", edgecolor=_SPHERE, linewidth=1.2))
        right.axhspan(0, 1, color="#E4E7EB", zorder=0)
        right.axhline(1.0, color=_SPHERE, linewidth=1.2, label="Brillouin sphere: 1")
        limit = 1.08 * max(1.0, *(reach.largest(n) for n in reach.radius))
        left.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
        left.set_xlabel("distance from the axis, Brillouin radii")
        left.set_ylabel("along the pole, Brillouin radii")
        right.set(xlim=(0, 180), ylim=(0, limit), xticks=range(0, 181, 30))
        right.set_xlabel("co-latitude, degrees")
        right.set_ylabel("radius, Brillouin radii")
        scale = unit * factor
        top = right.secondary_yaxis("right", functions=(lambda r: r * scale, lambda r: r / scale))
        top.set_ylabel(f"radius, {prefix}m")
        figure.legend(
            *right.get_legend_handles_labels(),
            loc="outside upper center",
            ncols=3,
            columnspacing=1.6,
        )
    return figure


_SUBSCRIPT = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
