"""Does a predicted uncertainty hold what it says?"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import erf

from unmodeled.core.arrays import Array
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import InputFeatures
from unmodeled.pipeline.inputs import true_inputs
from unmodeled.pipeline.results import CharacterizationResult, LearnerResult
from unmodeled.reports.figures.log_axes import LogRange, decades
from unmodeled.reports.numbers import engineering
from unmodeled.reports.style import SET_STYLES, figure_style, learner_styles, new_figure, short

__all__ = ["calibration"]

_WIDEST = 4.0  # sigma
_ORDER = ("extrapolation", "train", "interpolation")


@dataclass(frozen=True)
class _Pairs:
    """Predicted sigma and actual error of every component of a set, in SI (n,)."""

    sigma: Array
    error: Array


def calibration(result: CharacterizationResult) -> Figure | None:
    """Draw coverage (left) and error against predicted sigma (right), a row a learner.

    Coverage below the diagonal: over-confident; above: cautious. On the right, 68 % of the
    points should lie below the solid line.

    Parameters
    ----------
    result : CharacterizationResult
        What to draw.

    Returns
    -------
    Figure or None
        None if no fitted learner gives a covariance.
    """
    learners = [r for r in result.learners if r.learner is not None and r.calibrations]
    if not learners:
        return None
    with figure_style():
        figure = new_figure(0.6 + 2.7 * len(learners))
        styles = learner_styles(result.config.learners)
        grid = figure.subplots(len(learners), 2, squeeze=False)
        for (left, right), learner in zip(grid, learners, strict=True):
            features = result.field(learner.label).features
            pairs = {s: _pairs(learner, features, result.data, s) for s in _ORDER}
            _coverage(left, pairs)
            left.plot(
                [0.02],
                [1.07],
                transform=left.transAxes,
                linestyle="",
                clip_on=False,
                markersize=6,
                **styles[learner.label].marker_options,
            )
            left.text(0.06, 1.07, short(learner.label), transform=left.transAxes, va="center")
            _scatter(right, pairs)
        handles = grid[0, 0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside upper center", ncols=4)
    return figure


def _pairs(
    learner: LearnerResult, features: InputFeatures, data: LearningData, name: str
) -> _Pairs:
    assert learner.learner is not None
    samples = next(s for s in data.sets if s.name == name)
    covariance = learner.learner.predict_covariance(true_inputs(features, data, samples))
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    error = np.abs(samples.accelerations - learner.predictions[name])
    unit = data.units.acceleration
    return _Pairs(sigma.ravel() * unit, error.ravel() * unit)


def _coverage(axes: Axes, pairs: dict[str, _Pairs]) -> None:
    widths = np.linspace(0.0, _WIDEST, 161)
    nominal = erf(widths / math.sqrt(2))
    axes.plot([0, 100], [0, 100], color="#4B5563", linewidth=0.9, label="as it should be")
    for name in SET_STYLES:
        p, look = pairs[name], SET_STYLES[name]
        inside = p.error[None, :] <= widths[:, None] * p.sigma[None, :]
        actual = inside.mean(axis=1)
        line = {"train": "-", "interpolation": "--", "extrapolation": "-"}[name]
        axes.plot(100 * nominal, 100 * actual, color=look.colour, linestyle=line, label=look.title)
        marks = [float(np.mean(p.error <= w * p.sigma)) for w in (1.0, 1.959964)]
        axes.plot(
            [68.3, 95.0],
            [100 * m for m in marks],
            color=look.colour,
            marker=look.marker,
            linestyle="",
            markersize=5,
        )
    axes.set_xlim(0, 101)
    axes.set_ylim(0, 101)
    axes.set_xlabel("predicted interval, % of probability")
    axes.set_ylabel("components inside, %")


def _scatter(axes: Axes, pairs: dict[str, _Pairs]) -> None:
    largest = max(float(p.sigma.max()) for p in pairs.values())
    factor, prefix = engineering(largest)
    unit = f"{prefix}m/s²"
    limits_x = LogRange.around([p.sigma * factor for p in pairs.values()], floor=1e-9)
    limits_y = LogRange.around([p.error * factor for p in pairs.values()], floor=1e-9)
    for name in _ORDER:
        look, p = SET_STYLES[name], pairs[name]
        axes.scatter(
            limits_x.clip(p.sigma * factor),
            limits_y.clip(p.error * factor),
            s=6,
            marker=look.marker,
            color=look.colour,
            alpha=0.4,
            linewidths=0,
            rasterized=True,
            zorder=3,
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    ends = np.array(limits_x.limits)
    axes.plot(ends, ends, color="#4B5563", linewidth=0.9, zorder=4)
    axes.set_xlim(limits_x.limits)
    axes.set_ylim(limits_y.limits)
    decades(axes.xaxis, limits_x)
    decades(axes.yaxis, limits_y)
    axes.set_xlabel(f"predicted sigma, {unit}")
    axes.set_ylabel(f"actual error, {unit}")
