"""Figures beside the tables of [Marchese2023]: integrators, fitted networks, learning rules."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from unmodeled.core.arrays import Array
from unmodeled.pipeline.navigation.disturbance_errors import DisturbanceError
from unmodeled.pipeline.navigation.disturbance_fit import DisturbanceFit
from unmodeled.pipeline.navigation.integration_error import IntegrationError
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.figures.navigation import FILTER_COLOURS
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["fits_figure", "integration_figure", "learning_figure"]

_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#4B5563")
_HOUR = 3600.0


def integration_figure(errors: Mapping[str, IntegrationError]) -> Figure:
    """Draw position and velocity errors of integrators against time."""
    with figure_style():
        figure = new_figure(5.2)
        axes = figure.subplots(2, sharex=True)
        for a, what, label in zip(
            axes,
            ("position", "velocity"),
            ("position error, m", "velocity error, m/s"),
            strict=True,
        ):
            for colour, (name, error) in zip(_COLOURS, errors.items(), strict=False):
                a.plot(
                    error.times / _HOUR, getattr(error, what), color=colour, label=name, linewidth=1
                )
            a.set_yscale("log")
            shown = LogRange.around([getattr(e, what) for e in errors.values()])
            decades(a.yaxis, shown)
            a.set_ylim(*shown.limits)
            a.set_ylabel(label)
        axes[-1].set_xlabel("time, h")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def fits_figure(fits: Mapping[str, DisturbanceFit], times: Array, axes: tuple[str, ...]) -> Figure:
    """Draw what fitted networks make of the disturbance less the truth, and the labels' noise.

    Parameters
    ----------
    fits : mapping of str to DisturbanceFit
        By the words of the legend.
    times : ndarray (k,)
        s.
    axes : tuple of str
        Names of the three axes.
    """
    noise = next(iter(fits.values())).noise
    with figure_style():
        figure = new_figure(5.2)
        panels = figure.subplots(3, sharex=True)
        for j, a in enumerate(panels):
            a.axhspan(
                -1e9 * noise,
                1e9 * noise,
                color="#E2E7EC",
                linewidth=0,
                label="one sigma of the labels",
            )
            for colour, (name, fit) in zip(_COLOURS, fits.items(), strict=False):
                a.plot(
                    times / _HOUR,
                    1e9 * (fit.said - fit.truth)[:, j],
                    color=colour,
                    linewidth=0.8,
                    label=name,
                )
            a.set_ylabel(f"{axes[j]}, nm/s²")
        panels[-1].set_xlabel("time, h")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


def learning_figure(
    errors: Mapping[str, DisturbanceError], truth: Array, times: Array, settle: float
) -> Figure:
    """Draw the length of the error of the disturbance against time, mean over runs.

    Parameters
    ----------
    errors : mapping of str to DisturbanceError
        By filter.
    truth : ndarray (k, 3)
        The disturbance itself, m/s2.
    times : ndarray (k,)
        s.
    settle : float
        Errors count from there, s.
    """
    with figure_style():
        figure = new_figure(3.6)
        a = figure.subplots()
        for name, error in errors.items():
            a.plot(
                times / _HOUR,
                1e6 * error.length.mean(axis=1),
                color=FILTER_COLOURS.get(name, "#6B4C9A"),
                linewidth=1,
                label=name,
            )
        size = 1e6 * np.linalg.norm(truth, axis=1)
        a.plot(
            times / _HOUR,
            size,
            color="black",
            linewidth=1,
            linestyle="--",
            label="size of the disturbance",
        )
        a.axvline(settle / _HOUR, color="#7B8794", linewidth=0.9, linestyle=":")
        a.set_ylim(0.0, 1.3 * float(size.max()))
        a.set_ylabel("error of the disturbance, µm/s²")
        a.set_xlabel("time, h")
        handles, labels = a.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure
