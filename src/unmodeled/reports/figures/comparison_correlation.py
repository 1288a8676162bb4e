"""Autocorrelation of the residuals over one revolution."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from unmodeled.pipeline.comparison.result import Comparison, SeriesCorrelation
from unmodeled.reports.figures.comparison_in_time import COMPONENT_COLOURS, time_unit
from unmodeled.reports.style import figure_style, new_figure, short

__all__ = ["comparison_correlation"]

_MOST = 6
#: More lags than this are drawn as a line.
_STEMS = 150


def comparison_correlation(comparison: Comparison) -> Figure | None:
    """Draw the autocorrelation of each series with the band of 95 % for white noise.

    Of several arcs the longest series of each component is drawn, at most six in all.

    Returns
    -------
    Figure or None
        None if all series are too short.
    """
    longest: dict[tuple[str, str], SeriesCorrelation] = {}
    for c in comparison.correlations:
        now = longest.get((c.label, c.component))
        if now is None or len(c.lags) > len(now.lags):
            longest[c.label, c.component] = c
    shown = list(longest.values())[:_MOST]
    if not shown:
        return None
    per, unit = time_unit(max(float(c.lags[-1]) for c in shown))
    with figure_style():
        figure = new_figure(0.6 + 1.25 * len(shown))
        axes = figure.subplots(len(shown), sharex=True, squeeze=False)[:, 0]
        for k, (a, c) in enumerate(zip(axes, shown, strict=True)):
            t = c.lags / per
            a.fill_between(t, -c.band, c.band, color="#D5DAE0", linewidth=0, zorder=0)
            a.axhline(0.0, color="#7B8794", linewidth=0.6)
            colour = COMPONENT_COLOURS[k % len(COMPONENT_COLOURS)]
            if len(t) <= _STEMS:
                a.vlines(t, np.zeros_like(t), c.values, color=colour, linewidth=1.0)
                a.plot(t, c.values, linestyle="", marker=".", markersize=3, color=colour)
            else:
                a.plot(t, c.values, color=colour, linewidth=0.8)
            if comparison.period <= c.lags[-1] * 1.02:
                a.axvline(comparison.period / per, color="#111111", linewidth=0.8, linestyle=":")
            reach = max(float(np.abs(c.values).max()), float(c.band.max())) * 1.1
            a.set_ylim(-reach, reach)
            arc = f"{c.arc}, " if len({x.arc for x in comparison.correlations}) > 1 else ""
            a.set_title(f"{arc}{short(c.label, 22)} {c.component.replace('_', ' ')}")
            a.set_ylabel("correlation, –")
        axes[-1].set_xlabel(f"lag, {unit}; band: 95 % for white noise; dotted: one revolution")
    return figure
