"""What the page of a sweep shows, in order: who wins, head to head, trends, calibration, cost."""

from __future__ import annotations

from dataclasses import replace

from matplotlib.figure import Figure

from unmodeled.pipeline.select.select import Selection
from unmodeled.pipeline.trends.bands import slices
from unmodeled.reports import sweep_tables as tables
from unmodeled.reports.figures.critical_difference import critical_difference_figure
from unmodeled.reports.figures.error_against_noise import error_against_noise
from unmodeled.reports.figures.error_against_volume import error_against_volume
from unmodeled.reports.figures.head_to_head import head_to_head
from unmodeled.reports.figures.pareto_front import pareto_front
from unmodeled.reports.figures.sweep_calibration import sweep_calibration
from unmodeled.reports.figures.train_against_test import train_against_test
from unmodeled.reports.sections import Drawn, Section
from unmodeled.reports.sweep_view import (
    NOISE_AXES,
    VOLUME_AXES,
    SweepView,
    ordered_by_error,
    where_words,
)
from unmodeled.reports.tables import Table

__all__ = ["captions", "sweep_sections"]

_MOST_PAIRS = 3
_MOST_SLICES = 4
_METRIC_WORDS = {
    "extrapolation_median": "extrapolation",
    "interpolation_median": "interpolation",
    "train_median": "training",
}


def captions(view: SweepView) -> dict[str, tuple[str, str]]:
    """Return alternative text and caption of each figure, from the runs in force."""
    basis = f"{len(view.table)} runs on {view.orbits} initial conditions."
    median = "Median over the runs and quartile band of the median fractional acceleration error"
    return {
        "head-to-head": (
            "Error of one learner against that of another, a point a problem",
            "Median fractional acceleration error |a − â| / |a| of two learners on the same "
            "problems: (a) held-out samples of the training orbit, (b) other orbits. Above the "
            f"diagonal the learner of the horizontal axis is better. {basis}",
        ),
        "train-against-test": (
            "Test error against training error of each run, a panel a learner; the table below "
            "holds the fitted lines",
            "Median fractional acceleration error of each run on test samples against that on its "
            "training samples, with straight lines fitted to the logarithms. On the dotted line "
            f"the training error tells the test error. {basis}",
        ),
        "noise": (
            "Median and quartile band of the errors of each learner against the noise level",
            f"{median} of each learner against noise of the training data. (a) and (c) share their "
            f"axis; test errors are against the truth without noise. {basis}",
        ),
        "volume": (
            "Errors and training time of each learner against data volume",
            f"{median} on held-out samples (a) and other orbits (b), and training time (c), "
            f"against the length of the training orbit. {basis}",
        ),
        "calibration": (
            "Coverage of the predicted intervals of each learner that predicts an uncertainty",
            "Share of acceleration components whose error lies inside the predicted interval, "
            "median and quartiles over runs; markers are moved apart sideways. Below the line a "
            f"learner is over-confident. {basis}",
        ),
        "pareto-front": (
            "Median error against training time, evaluation time and size",
            "Median error of each learner against what it costs, with quartiles over runs of both. "
            f"The step line joins what no other learner beats in error and that cost. {basis}",
        ),
        "critical-difference": (
            "Mean rank of each learner; bars join learners that the data do not tell apart",
            "Mean rank over problems. Learners joined by a bar differ by less than Nemenyi's "
            "critical difference at 5 %; the paired tests in the table are sharper for one pair.",
        ),
    }


def sweep_sections(view: SweepView, selection: Selection | None, metric: str) -> list[Section]:
    """Return all sections that have something to show.

    Parameters
    ----------
    view : SweepView
        The finished runs.
    selection : Selection, optional
        From `select`, if the learners can be compared.
    metric : str
        What learners are ordered by.
    """
    everything = [
        _winner(view, selection),
        _pairs(view, selection, metric),
        Section(
            "train-test",
            "Does the training error tell the test error?",
            figures=(_drawn(view, "train-against-test", train_against_test(view)),),
            tables=(tables.fit_table(view),),
        ),
        *(_along(view, axis) for axis in view.varied(*NOISE_AXES, *VOLUME_AXES)),
        _calibration(view),
        _cost(view, selection, metric),
        Section("outliers", "Outliers", tables=(tables.outlier_table(view.table, view.axes),)),
        Section("failures", "Failed fits", tables=(tables.failure_table(view.table, view.axes),)),
    ]
    kept = []
    for s in everything:
        filled = tuple(t for t in s.tables if t.rows)
        if s.figures or filled:
            kept.append(Section(s.id, s.title, s.words, s.figures, filled))
    return kept


def _winner(view: SweepView, selection: Selection | None) -> Section:
    if selection is None:
        return Section("winner", "Who wins")
    found: list[Table] = []
    for choice in selection.choices:
        found += [tables.median_table(choice), tables.pair_table(choice)]
    figure = critical_difference_figure(view, selection.choices)
    words = f"Compared by the median {_METRIC_WORDS[selection.metric]} error of each run."
    return Section(
        "winner",
        "Who wins",
        (words,),
        (_drawn(view, "critical-difference", figure),),
        tuple(found),
    )


def _pairs(view: SweepView, selection: Selection | None, metric: str) -> Section:
    """Show the learner with the lowest median against the next ones."""
    if selection is None:
        return Section("head-to-head", "Head to head")
    first, *others = ordered_by_error(view, metric)
    figures = []
    for k, other in enumerate(others[:_MOST_PAIRS], start=1):
        name = "head-to-head" + (f"-{k}" if len(others) > 1 else "")
        figures.append(_drawn(view, "head-to-head", head_to_head(view, first, other), name))
    left = len(others) - len(figures)
    words = (f"{left} more pairs are in the tables above.",) if left > 0 else ()
    return Section("pairs", "Head to head", words, tuple(figures))


def _along(view: SweepView, axis: str) -> Section:
    draw, kind = (
        (error_against_noise, "noise") if axis in NOISE_AXES else (error_against_volume, "volume")
    )
    titles = {
        "noise.state": "State noise",
        "noise.acceleration": "Acceleration noise",
    }
    parts = slices(view.table, axis, view.axes)
    figures, found = [], []
    for k, (where, part) in enumerate(parts[:_MOST_SLICES], start=1):
        one = view.only(part)
        name = axis.replace(".", "-") + (f"-{k}" if len(parts) > 1 else "")
        words = where_words(where, si=view.si)
        figures.append(_drawn(one, kind, draw(one, axis), name, words))
        table = tables.level_table(one, axis)
        found.append(replace(table, title=", ".join(filter(None, (table.title, words)))))
    more = len(parts) - len(figures)
    words_more = (
        (f"{more} more combinations of the other axes are not drawn; `unmodeled export` has them.",)
        if more > 0
        else ()
    )
    title = titles.get(axis, "Data volume")
    return Section(axis.replace(".", "-"), title, words_more, tuple(figures), tuple(found))


def _calibration(view: SweepView) -> Section:
    axis = next(iter(view.varied(*NOISE_AXES)), None)
    figure = sweep_calibration(view, axis)
    drawn = () if figure is None else (_drawn(view, "calibration", figure),)
    title = "Can the predicted uncertainty be believed?"
    return Section("calibration", title, (), drawn, (tables.coverage_table(view),))


def _cost(view: SweepView, selection: Selection | None, metric: str) -> Section:
    if selection is None:
        return Section("cost", "Error against cost")
    figure = pareto_front(view, metric)
    return Section(
        "cost",
        "Error against cost",
        (),
        (_drawn(view, "pareto-front", figure),),
        (tables.cost_front_table(selection),),
    )


def _drawn(view: SweepView, kind: str, figure: Figure, name: str = "", where: str = "") -> Drawn:
    alt, caption = captions(view)[kind]
    return Drawn(name or kind, figure, alt, caption + (f" At {where}." if where else ""))
