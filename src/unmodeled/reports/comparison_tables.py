"""Tables of a comparison."""

from __future__ import annotations

import numpy as np

from unmodeled.pipeline.comparison.result import Comparison
from unmodeled.reports.numbers import engineering, number
from unmodeled.reports.tables import Table

__all__ = ["family_table", "map_table", "rms_table", "whiteness_table"]

#: More rows than this are left to the JSON file.
_MOST = 24


def rms_table(comparison: Comparison) -> Table:
    """Return the root mean square of each component, in SI and in sigmas."""
    rows = []
    for r in comparison.rms.to_dict("records"):
        factor, prefix = engineering(float(r["rms"]))
        size = f"{number(float(r['rms']) * factor, 3)} {prefix}{r['unit']}"
        sigmas = number(float(r["rms_in_sigmas"]), 3)
        counts = (str(r["count"]), str(r["edited"]))
        rows.append((f"{r['label']} {r['component']}", size, sigmas, *counts))
    return Table(
        "Root mean square of the residuals",
        ("data", "RMS", "RMS [stated sigmas]", "used [–]", "edited [–]"),
        tuple(rows),
    )


def whiteness_table(comparison: Comparison) -> Table:
    """Return the tests of each series, those that speak first."""
    tests = comparison.whiteness.sort_values("p", kind="stable", na_position="last")
    many = tests["arc"].nunique() > 1
    rows = []
    for r in tests.head(_MOST).to_dict("records"):
        name = f"{r['arc']}, " if many else ""
        name += f"{r['label']} {r['component']}"
        span = f" over {r['lags']} lags" if r["lags"] else ""
        rows.append(
            (
                name,
                f"{r['test']}{span}",
                number(float(r["statistic"]), 3),
                _p(float(r["p"])),
                str(r["verdict"]),
            )
        )
    left = len(tests) - len(rows)
    return Table(
        "Tests of whiteness, size and normality",
        ("series", "test", "statistic [–]", "p [–]", "verdict"),
        tuple(rows),
        note=f"{left} more in comparison.json." if left > 0 else "",
        text_columns=(1, 4),
    )


def map_table(comparison: Comparison) -> Table:
    """Return on what the residuals depend, the most telling variable first."""
    rows = [(m.title, number(m.statistic, 3), str(m.freedom), _p(m.p)) for m in comparison.maps]
    how = (
        "from signs drawn anew for blocks of a quarter of a revolution, because the residuals are "
        "not white"
        if comparison.coloured
        else "of an F-test"
    )
    return Table(
        "On what the residuals depend",
        (
            "variable",
            "drop of chi-square [–]",
            "degrees of freedom [–]",
            "p, all variables counted [–]",
        ),
        tuple(rows),
        note=f"The p-value is {how}, times the number of variables.",
    )


def family_table(comparison: Comparison) -> Table:
    """Return how well each family of forces and instrument errors explains the residuals."""
    e = comparison.explanation
    rows = [
        (
            str(r["title"]),
            str(r["kind"]),
            number(float(r["log_bayes"]), 3),
            f"{round(100 * float(r['skill']))}",
            number(float(r["noise"]), 3),
        )
        for r in e.table.to_dict("records")
    ]
    note = ", ".join(f"{k} {100 * v:.1f} %" for k, v in e.probabilities.items())
    return Table(
        "What it looks like",
        (
            "family",
            "kind",
            "ln Bayes factor against nothing [–]",
            "held-out residuals predicted [%]",
            "noise left [stated sigmas]",
        ),
        tuple(rows),
        note=f"Probability of each kind if one of them is right and all were as likely: {note}. "
        f"Noise allows {100 * e.possible_skill:.0f} % to be predicted.",
        text_columns=(1,),
    )


def _p(value: float) -> str:
    return "–" if np.isnan(value) else "< 1e-9" if value < 1e-9 else number(value)
