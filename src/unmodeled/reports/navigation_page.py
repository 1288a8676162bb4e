"""The page of `navigate`: which filter flies best, how sure it is, and what it cost."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd

from unmodeled.pipeline.navigation.result import NavigationResult
from unmodeled.reports.embedding import embed_sections, provenance_rows, render_page, yaml_text
from unmodeled.reports.figures.navigation import (
    FILTER_COLOURS,
    disturbance_figure,
    error_figure,
    three_sigma_figure,
)
from unmodeled.reports.numbers import number
from unmodeled.reports.sections import Drawn, Section
from unmodeled.reports.tables import Table

__all__ = ["navigation_words", "write_navigation_report"]

_SIMPLE = ("kf", "matched", "dmc", "dmc2", "nonlinear")
_MOST_PANELS = 3


def write_navigation_report(result: NavigationResult, folder: Path) -> Path:
    """Write ``report.html`` and ``figures/*.png``, ``figures/*.svg``; return the page.

    Parameters
    ----------
    result : NavigationResult
    folder : Path
        Run folder; made if missing.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    words = navigation_words(result)
    verdicts = [
        {
            "title": f.name,
            "text": f", {f.title}: {f.verdict}",
            "colour": FILTER_COLOURS.get(f.name, "#6B4C9A"),
        }
        for f in result.flown
    ]
    page = render_page(
        "diagnosis.html.j2",
        name=result.config.name,
        title="which filter flies best?",
        kicker=f"Navigation, {result.flight.title}",
        question="How well does each filter navigate, and does it know how well?",
        answer_title="Result",
        answer=words[0],
        findings=verdicts,
        basis=list(words[1:]),
        sections=embed_sections(_sections(result), folder),
        source=yaml_text(result.config.as_dict()),
        provenance=provenance_rows(result.provenance, "scenario"),
    )
    target = folder / "report.html"
    target.write_text(page, encoding="utf-8")
    return target


def navigation_words(result: NavigationResult) -> list[str]:
    """Return the answer in a sentence, then what it rests on."""
    table = result.table[result.table["failure"] == ""]
    runs = result.config.runs
    basis = [
        f"{runs} Monte-Carlo runs on one true flight, {len(result.flight.times)} epochs; the same "
        f"draws for all filters, seed {result.config.seed}.",
        f"The Riccati floor, {_metres(result.floor_position_m)} in position and "
        f"{number(result.floor_velocity_m_s)} m/s, is what a filter with the true forces and a "
        "little white acceleration beside them can expect of itself.",
        *result.notes,
    ]
    for row in result.table[result.table["failure"] != ""].to_dict(orient="records"):
        basis.append(f"{row['filter']} failed: {row['failure']}")
    if table.empty:
        return ["Every filter failed.", *basis]
    simple = table[table["filter"].isin(_SIMPLE) & (table["role"] == "simple")]
    learned = table[table["role"] == "learned"]
    if simple.empty or learned.empty:
        best = table[table["role"] != "reference"]
        row = _least(best if not best.empty else table, "position_rmse_m")
        return [
            f"{row['filter']} has the smallest position error, {_metres(row['position_rmse_m'])} "
            f"root mean square and {number(row['velocity_rmse_m_s'])} m/s.",
            *basis,
        ]
    one = _least(simple, "position_rmse_m")
    other = _least(learned, "position_rmse_m")
    sentence = (
        f"The best learned filter, {other['filter']}, has {_metres(other['position_rmse_m'])} and "
        f"{number(other['velocity_rmse_m_s'])} m/s root mean square; the best simple one, "
        f"{one['filter']}, has {_metres(one['position_rmse_m'])} and "
        f"{number(one['velocity_rmse_m_s'])} m/s."
    )
    for phase in result.flight.phases:
        key = f"max_in_{phase}_m"
        one = _least(simple, key)
        other = _least(learned, key)
        sentence += (
            f" In the {phase} the largest error is {_metres(other[key])} ({other['filter']}) "
            f"against {_metres(one[key])} ({one['filter']})."
        )
    return [sentence, *basis]


def _least(table: pd.DataFrame, key: str) -> dict[Any, Any]:
    """Return the row with the smallest value."""
    rows: list[dict[Any, Any]] = table.to_dict(orient="records")
    return min(rows, key=lambda row: float(row[key]))


def _sections(result: NavigationResult) -> list[Section]:
    made = [
        Section(
            "errors",
            "Errors",
            figures=(
                Drawn(
                    "errors",
                    error_figure(result),
                    "Position and velocity error of each filter against time, with the floor",
                    "Root mean square over runs of the length of the error; between the drawn "
                    "points the root mean square in time."
                    + (" Shaded: without measurements." if result.flight.phases else ""),
                ),
            ),
            tables=(_table(result),),
        )
    ]
    names = tuple(f.name for f in result.flown)
    if names:
        shown = _chosen(result, names)
        made.append(
            Section(
                "sigmas",
                "Does it know how wrong it is?",
                figures=(
                    Drawn(
                        "three-sigma",
                        three_sigma_figure(result, shown),
                        "Position error on three axes within three stated standard deviations",
                        "First run. Grey: three stated standard deviations. The scale is that of "
                        "the errors after settling with measurements; in gaps a line may leave it.",
                    ),
                ),
                tables=(_consistency(result),),
            )
        )
    estimating = tuple(f.name for f in result.flown if f.disturbance is not None)
    if estimating:
        made.append(
            Section(
                "disturbance",
                "What the model lacks",
                figures=(
                    Drawn(
                        "disturbance",
                        disturbance_figure(result, _chosen(result, estimating)),
                        "True and estimated disturbance on three axes",
                        "What truly acts beyond the filters' base model, and what filters make of "
                        "it: states of DMC, networks, harmonics. First run; what lies outside the "
                        "panel is noise of an estimate.",
                    ),
                ),
            )
        )
    return made


def _chosen(result: NavigationResult, names: tuple[str, ...]) -> tuple[str, ...]:
    """Put the best simple and the best learned one first; three fit on a page."""
    error = result.table.set_index("filter")["position_rmse_m"]
    role = result.table.set_index("filter")["role"]
    first = [
        min((n for n in names if role[n] == kind), key=lambda n: error[n], default=None)
        for kind in ("simple", "learned")
    ]
    order = [n for n in first if n] + [n for n in names if n not in first]
    return tuple(order[:_MOST_PANELS])


def _table(result: NavigationResult) -> Table:
    phases = tuple(result.flight.phases)
    columns = (
        *("filter", "position RMSE [m]", "velocity RMSE [m/s]", "mean error [m]"),
        *(f"largest in {p} [m]" for p in phases),
        *("disturbance RMSE [m/s²]", "time a step and run [µs]"),
    )
    keys = (
        *("position_rmse_m", "velocity_rmse_m_s", "mean_position_error_m"),
        *(f"max_in_{p}_m" for p in phases),
        *("disturbance_rmse_m_s2", "us_per_step"),
    )
    rows = [
        (str(row["filter"]), *(_cell(row.get(key)) for key in keys))
        for row in result.table.to_dict(orient="records")
    ]
    floor = ["Riccati floor", _cell(result.floor_position_m), _cell(result.floor_velocity_m_s)]
    rows.append(tuple(floor + ["–"] * (len(columns) - 3)))
    note = (
        "Lengths of error vectors after settling, outside gaps. Largest: of each run, then the "
        "mean over runs."
    )
    return Table("Errors after settling", columns, tuple(rows), note, learners=False)


def _consistency(result: NavigationResult) -> Table:
    columns = (
        "filter",
        "NEES [–]",
        "epochs with NEES in bounds [%]",
        "NIS a component [–]",
        "mean error [m]",
        "mean stated sigma [m]",
    )
    rows = tuple(
        (
            str(row["filter"]),
            _cell(row.get("nees")),
            _cell(100.0 * row.get("nees_inside", math.nan)),
            _cell(row.get("nis")),
            _cell(row.get("mean_position_error_m")),
            _cell(row.get("mean_position_sigma_m")),
        )
        for row in result.table.to_dict(orient="records")
    )
    free = int(result.flight.free.sum())
    note = (
        f"NEES of {free} states is {free}, NIS a component 1 for a filter that knows how wrong it "
        "is. The list at the top counts gaps, too."
    )
    if free < 6:
        note += " The flight stays in its plane: there is nothing to be wrong about across it."
    return Table("Consistency", columns, rows, note, learners=False)


def _cell(value: float | None) -> str:
    if value is None or pd.isna(value):
        return "–"
    return number(float(value), 3)


def _metres(value: float) -> str:
    if value >= 1e3:
        return f"{number(value / 1e3, 3)} km"
    return f"{number(1e3 * value, 3)} mm" if value < 0.1 else f"{number(value, 3)} m"
