"""Figures of flown filters: errors in time, errors within three sigmas, the disturbance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unmodeled.core.arrays import Array
from unmodeled.pipeline.navigation.result import Flown, NavigationResult
from unmodeled.reports.figures.comparison_in_time import time_unit
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.numbers import engineering
from unmodeled.reports.style import figure_style, new_figure

__all__ = ["FILTER_COLOURS", "disturbance_figure", "error_figure", "three_sigma_figure"]

#: One colour for each filter throughout: those of the Okabe-Ito scheme, grey for references.
FILTER_COLOURS = {
    "kf": "#4B5563",
    "matched": "#8D99A6",
    "dmc": "#0072B2",
    "dmc2": "#56B4E9",
    "nonlinear": "#CC79A7",
    "exact": "#111111",
    "rbf": "#E69F00",
    "rbf_adaptive": "#8A8A2B",
    "observer": "#B5651D",
    "gradient": "#44AA99",
    "pinn": "#882255",
    "weights": "#D55E00",
    "harmonic": "#009E73",
    "learned": "#332288",
    "network": "#AA4499",
    "periodic": "#6B4C9A",
    "effects": "#C1121F",
}
_BAND, _PHASE, _TRUTH = "#B4C0CC", "#F6E7CF", "#B8C0C8"
_MOST = 1500
_MOST_COLUMNS = 6


def error_figure(result: NavigationResult) -> Figure:
    """Draw the root-mean-square error of position and velocity against time, and the floor."""
    times, per, unit = _time(result)
    at = _thin(len(times))
    with figure_style():
        figure = new_figure(5.2)
        axes = figure.subplots(2, sharex=True)
        for a, what, si, floor in zip(
            axes,
            ("position_rms", "velocity_rms"),
            ("position error, m", "velocity error, m/s"),
            (result.floor[:, :3], result.floor[:, 3:]),
            strict=True,
        ):
            _phases(a, result, per)
            for f in result.flown:
                values = getattr(f, what)
                a.plot(
                    times[at] / per,
                    _blocks(values, at),
                    color=FILTER_COLOURS.get(f.name, "#6B4C9A"),
                    linewidth=1.1,
                    linestyle=":" if f.role == "reference" else "-",
                    label=f.name,
                )
            bound = np.sqrt((floor**2).sum(axis=1))
            a.plot(
                times[at] / per,
                bound[at],
                color="#7B8794",
                linestyle="--",
                linewidth=0.9,
                label="Riccati floor",
            )
            a.set_yscale("log")
            shown = LogRange.around([*(getattr(f, what) for f in result.flown), bound])
            decades(a.yaxis, shown)
            a.set_ylim(*shown.limits)
            a.set_ylabel(si)
        axes[-1].set_xlabel(f"time, {unit}")
        handles, labels = axes[0].get_legend_handles_labels()
        columns = len(labels) if len(labels) <= _MOST_COLUMNS else (len(labels) + 1) // 2
        figure.legend(handles, labels, loc="outside upper center", ncols=columns)
    return figure


def three_sigma_figure(result: NavigationResult, names: tuple[str, ...]) -> Figure:
    """Draw the position error of the first run on each axis within three stated sigmas."""
    times, per, unit = _time(result)
    at = _thin(len(times))
    chosen = [result[name] for name in names]
    with figure_style():
        figure = new_figure(1.2 + 1.35 * 3)
        grid = figure.subplots(3, len(chosen), sharex=True, squeeze=False)
        for column, f in zip(grid.T, chosen, strict=True):
            column[0].set_title(f.name)
            for j, a in enumerate(column):
                _phases(a, result, per, named=j == 0)
                bound = 3.0 * f.sigma[at, j]
                shown = _limit(result, f, j)
                factor, prefix = engineering(1.15 * shown)
                a.fill_between(
                    times[at] / per,
                    -bound * factor,
                    bound * factor,
                    color=_BAND,
                    alpha=0.55,  # a gap must show through
                    linewidth=0,
                )
                a.plot(
                    times[at] / per,
                    f.error[at, j] * factor,
                    linewidth=0.6,
                    color=FILTER_COLOURS.get(f.name, "#6B4C9A"),
                )
                a.set_ylim(-1.15 * shown * factor, 1.15 * shown * factor)
                a.set_ylabel(f"{result.flight.axes[j]}, {prefix}m")
            column[-1].set_xlabel(f"time, {unit}")
    return figure


def disturbance_figure(result: NavigationResult, names: tuple[str, ...]) -> Figure:
    """Draw the true disturbance on each axis, and what filters believe of it (first run)."""
    times, per, unit = _time(result)
    at = _thin(len(times))
    truth = result.flight.disturbance * result.flight.scale.acceleration
    settled = times >= result.flight.settle * result.flight.scale.time
    with figure_style():
        figure = new_figure(5.2)
        axes = figure.subplots(3, sharex=True)
        sizes = np.abs(truth[settled]).max(axis=0)
        factor, prefix = engineering(float(sizes.max()))  # one unit for all three
        for j, a in enumerate(axes):
            # an axis on which nothing acts is drawn on the scale of the others
            largest = float(sizes[j] or sizes.max())
            most = max(3.0 * largest, float(sizes.max()))
            for name in names:
                estimate = result[name].disturbance
                if estimate is not None:
                    spread = float(np.quantile(np.abs(estimate[settled, j]), 0.995))
                    largest = max(largest, min(spread, most))
            _phases(a, result, per, named=j == 0)
            a.plot(
                times[at] / per,
                truth[at, j] * factor,
                color=_TRUTH,
                linewidth=3.0,
                label="truth",
            )
            for name in names:
                estimate = result[name].disturbance
                if estimate is not None:
                    a.plot(
                        times[at] / per,
                        estimate[at, j] * factor,
                        linewidth=0.7,
                        color=FILTER_COLOURS.get(name, "#6B4C9A"),
                        label=name,
                    )
            a.set_ylim(-1.2 * largest * factor, 1.2 * largest * factor)
            a.set_ylabel(f"{result.flight.axes[j]}, {prefix}m/s²")
        axes[-1].set_xlabel(f"time, {unit}")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=5)
    return figure


def _time(result: NavigationResult) -> tuple[Array, float, str]:
    times = result.flight.times * result.flight.scale.time
    per, unit = time_unit(float(np.ptp(times)))
    return times, per, unit


def _thin(count: int) -> npt.NDArray[np.intp]:
    at: npt.NDArray[np.intp] = np.unique(
        np.linspace(0, count - 1, min(count, _MOST)).astype(np.intp)
    )
    return at


def _blocks(values: Array, at: npt.NDArray[np.intp]) -> Array:
    """Root mean square between the epochs that are drawn: nothing is skipped."""
    sums = np.add.reduceat(values**2, at)
    counts = np.diff(np.append(at, len(values)))
    found: Array = np.sqrt(sums / counts)
    return found


def _phases(a: Axes, result: NavigationResult, per: float, named: bool = True) -> None:
    scale = result.flight.scale.time
    for name, (start, end) in result.flight.phases.items():
        a.axvspan(start * scale / per, end * scale / per, color=_PHASE, linewidth=0, zorder=0)
        if not named:
            continue
        a.text(
            0.5 * (start + end) * scale / per,
            0.97,
            name,
            transform=a.get_xaxis_transform(),
            ha="center",
            va="top",
            fontsize=7,
            color="#7A5230",
        )


def _limit(result: NavigationResult, f: Flown, j: int) -> float:
    """Return what a panel shows: the epochs that count; start and gaps would hide the rest."""
    later = result.flight.settled
    size = max(float(np.abs(f.error[later, j]).max()), 3.0 * float(f.sigma[later, j].max()))
    return size if size > 0.0 else 1.0
