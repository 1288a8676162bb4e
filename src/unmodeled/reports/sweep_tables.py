"""Tables of the page of a sweep: plain text in cells, a unit in every header."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import pandas as pd

from unmodeled.pipeline.select.select import Choice, Selection
from unmodeled.pipeline.trends.bands import bands
from unmodeled.pipeline.trends.outliers import FAR_OBSERVED, OUTLIER_FACTOR, outliers
from unmodeled.reports.figures.sweep_calibration import calibrated_labels
from unmodeled.reports.figures.train_against_test import fits_of
from unmodeled.reports.numbers import number
from unmodeled.reports.style import SET_STYLES
from unmodeled.reports.sweep_view import SweepView, axis_words
from unmodeled.reports.tables import Table

__all__ = [
    "cost_front_table",
    "coverage_table",
    "failure_table",
    "fit_table",
    "level_table",
    "median_table",
    "outlier_table",
    "pair_table",
]

_METRICS = ("train_median", "interpolation_median", "extrapolation_median")
_MOST_FAILURES = 20


def median_table(choice: Choice) -> Table:
    """Return the median error of each learner in a regime, with its interval and mean rank."""
    rows = tuple(
        (
            str(row["learner"]),
            number(row["median"]),
            f"{number(row['low'])} to {number(row['high'])}",
            f"{choice.ranks.mean[row['learner']]:.2f}",
            str(int(row["failures"])),
            "–" if math.isnan(row["over_point_mass"]) else number(row["over_point_mass"]),
            str(row["use"]),
        )
        for row in choice.medians.to_dict(orient="records")
    )
    problems = int(choice.medians["problems"].iloc[0])
    return Table(
        f"Errors over {problems} problems, {choice.regime}",
        (
            "learner",
            "median error [–]",
            "95 % interval [–]",
            "mean rank [–]",
            "failed fits [–]",
            "extrapolation over point mass [–]",
            "advice",
        ),
        rows,
        "A problem is an initial condition at one point of the grid. Intervals by resampling "
        "problems. Critical difference of mean ranks at 5 %: "
        f"{choice.ranks.critical_difference:.2g}. Extrapolation over point mass is the median over "
        "problems of the ratio to the bare point mass; above 2: do not use.",
        text_columns=(6,),
    )


def pair_table(choice: Choice) -> Table:
    """Return the paired comparisons of a regime."""
    rows = tuple(
        (
            str(row["better"]),
            str(row["worse"]),
            number(row["ratio"]),
            f"{100 * row['share']:.0f}",
            f"{row['effect']:.2f}".replace("-", "−"),
            number(row["p_holm"]),
        )
        for row in choice.pairs.to_dict(orient="records")
    )
    return Table(
        f"Pairs, {choice.regime}",
        (
            "better by the median",
            "than",
            "median ratio of errors [–]",
            "problems won [%]",
            "rank-biserial correlation [–]",
            "P, adjusted [–]",
        ),
        rows,
        "Wilcoxon's signed-rank test of log errors, problem by problem; P adjusted by Holm.",
        text_columns=(1,),
    )


def level_table(view: SweepView, axis: str) -> Table:
    """Return median errors by level of an axis: the numbers behind its figure."""
    found = [bands(view.table, axis, metric) for metric in _METRICS]
    rows = []
    for k, row in enumerate(found[0].to_dict(orient="records")):
        cells = [f"{number(b['median'][k])}" for b in found]
        rows.append((str(row["learner"]), f"{row['level']:g}", str(row["runs"]), *cells))
    title, _, unit = axis_words(axis, si=view.si).rpartition(", ")
    title = title.partition(" σ")[0] if title else axis
    return Table(
        f"Median errors by {title}",
        (
            "learner",
            f"{title} [{unit if title != axis else '–'}]",
            "runs [–]",
            *(f"{SET_STYLES[m.removesuffix('_median')].title} [–]" for m in _METRICS),
        ),
        tuple(rows),
    )


def fit_table(view: SweepView) -> Table:
    """Return the log-log fits of test against training errors."""
    rows = []
    for label in view.labels:
        for name, fit in fits_of(view, label).items():
            if fit is not None:
                rows.append(
                    (
                        label,
                        name,
                        f"{fit.slope:.4f} ± {fit.slope_sigma:.4f}".replace("-", "−"),
                        f"{fit.intercept:.4f}".replace("-", "−"),
                        f"{fit.r_squared:.4f}",
                        str(fit.count),
                        str(fit.left_out),
                    )
                )
    return Table(
        "Test against training error, lines in the logarithms",
        (
            "learner",
            "test",
            "slope [–]",
            "intercept [–]",
            "R² [–]",
            "runs [–]",
            "left out [–]",
        ),
        tuple(rows),
        "log₁₀ of the test error = slope · log₁₀ of the training error + intercept; medians of the "
        "fractional error of each run. Zero and infinite errors are left out.",
        text_columns=(1,),
    )


def coverage_table(view: SweepView) -> Table:
    """Return the median coverage over all runs."""
    rows = []
    for label in calibrated_labels(view):
        mine = view.table[view.table["learner"] == label]
        for name, look in SET_STYLES.items():
            c68, c95 = (100 * mine[f"{name}_coverage_{k}"].median() for k in (68, 95))
            rows.append((label, look.title, f"{c68:.1f}", f"{c95:.1f}"))
    return Table(
        "Coverage of predicted intervals, median over all runs",
        (
            "learner",
            "set",
            "within 1 sigma, 68.3 expected [%]",
            "within 1.96 sigma, 95.0 expected [%]",
        ),
        tuple(rows),
        text_columns=(1,),
    )


def cost_front_table(selection: Selection) -> Table:
    """Return medians of error and costs, and who is on the front of all of them."""
    rows = tuple(
        (
            str(row["learner"]),
            number(row[selection.metric]),
            _cost(row, "cost_train_s", 1.0),
            _cost(row, "cost_evaluate_one_s", 1e6),
            _cost(row, "model_bytes", 1e-3),
            "yes" if row["front"] else "no",
        )
        for row in selection.pareto.to_dict(orient="records")
    )
    return Table(
        "Error and costs, medians over all runs",
        (
            "learner",
            "error [–]",
            "training [s]",
            "one evaluation [µs]",
            "fitted arrays [kB]",
            "on the front of all four",
        ),
        rows,
        "On the front: no other learner is as good in all four and better in one. Wall times "
        "differ from run to run and from machine to machine.",
        text_columns=(5,),
    )


def failure_table(table: pd.DataFrame, axes: Sequence[str]) -> Table:
    """Return the runs whose fit failed, the first 20 of them."""
    failed = table[table["failure"] != ""]
    rows = []
    for row in failed.head(_MOST_FAILURES).to_dict(orient="records"):
        where = ", ".join(f"{a} {row[a]}" for a in axes)
        rows.append(
            (str(row["learner"]), str(row["initial_condition"]), where, str(row["failure"]))
        )
    more = len(failed) - len(rows)
    return Table(
        "Failed fits",
        ("learner", "initial condition", "point of the grid", "reason"),
        tuple(rows),
        f"And {more} more; `unmodeled export` has all." if more > 0 else "",
        text_columns=(1, 2, 3),
    )


def outlier_table(table: pd.DataFrame, axes: Sequence[str]) -> Table:
    """Return the runs far above the median of their cell, the first 20, and what explains them."""
    found = outliers(table, axes)
    rows = []
    for row in found.head(_MOST_FAILURES).to_dict(orient="records"):
        rows.append(
            (
                str(row["learner"]),
                str(row["initial_condition"]),
                ", ".join(f"{a} {row[a]}" for a in axes),
                number(row["interpolation_median"]),
                number(row["times_cell"]),
                number(row.get("train_largest_observed", math.nan)),
                "a sample beside the centre" if row["explained"] else "not known",
            )
        )
    known = int(found["explained"].sum())
    more = len(found) - len(rows)
    rest = len(found) - known
    words = (
        f"{len(found)} of {len(table)} runs have an interpolation error above {OUTLIER_FACTOR:g} "
        f"times the median of the same learner at the same point of the grid. In {known} of them "
        f"noise drew a position so deep that an observed acceleration is {FAR_OBSERVED:g} or more "
        "times the largest true one: that sample rules the fit. "
        f"Runs without such a sample: {rest}."
    )
    return Table(
        "Outliers",
        (
            "learner",
            "initial condition",
            "point of the grid",
            "interpolation error [–]",
            "over the median of the cell [–]",
            "largest observed / true acceleration [–]",
            "why",
        ),
        tuple(rows),
        words + (f" The worst {len(rows)} are shown; {more} more." if more > 0 else ""),
        text_columns=(1, 2, 6),
    )


def _cost(row: Mapping[Hashable, Any], name: str, scale: float) -> str:
    value = float(row.get(name, math.nan))
    return "–" if math.isnan(value) else number(scale * value)
