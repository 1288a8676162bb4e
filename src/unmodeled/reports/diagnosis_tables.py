"""Tables of a diagnosis: findings, what cannot be told apart, what would have been seen."""

from __future__ import annotations

import math

import pandas as pd

from unmodeled.pipeline.diagnosis.add_effect import Addition
from unmodeled.pipeline.diagnosis.result import Diagnosis, Estimate
from unmodeled.reports.diagnosis_words import detectable, estimate_text, step_label
from unmodeled.reports.numbers import number
from unmodeled.reports.tables import Table

__all__ = [
    "addition_table",
    "alternative_table",
    "class_table",
    "detectable_table",
    "dismissed_table",
    "estimate_table",
    "finding_table",
    "further_table",
    "step_table",
    "whiteness_table",
]


#: Alternatives that are listed.
_MOST_SETS = 12


def finding_table(d: Diagnosis) -> Table:
    """Return one row a finding: how sure it is; the agreement of arcs if there are several."""
    arcs = any(f.consistency_p is not None for f in d.findings)
    return Table(
        "How sure each finding is",
        (
            "effect",
            "fall of chi-square [–]",
            "needed [–]",
            "log10 p [–]",
            "ln evidence [–]",
            "confidence [–]",
            *(("agreement of arcs, p [–]",) if arcs else ()),
            "largest change [σ]",
        ),
        tuple(
            (
                f"{f.title} ({f.name})",
                number(f.drop, 3),
                number(f.threshold, 3),
                f"{f.log10_p:.1f}",
                f"{f.evidence:.1f}",
                number(f.confidence, 3),
                *((_or_dash(f.consistency_p),) if arcs else ()),
                number(f.largest_change, 2),
            )
            for f in d.findings
        ),
        note="Fall of chi-square: by how much it rises without the effect, in stated sigmas. "
        "Largest change: of an estimate when one twelfth of the time is left out. "
        "Evidence: against the other findings alone, with the expected sizes as priors. In "
        "brackets: the name for `unmodeled add`.",
        learners=False,
    )


def estimate_table(rows: list[tuple[str, Estimate]], title: str = "Estimates") -> Table:
    """Return one row a parameter: title of its effect, and its estimate."""
    return Table(
        title,
        ("parameter", "effect", "estimate ± sigma", "expected size", "accepted", "pull [σ]"),
        tuple(
            (
                e.name,
                effect,
                estimate_text(e.value, e.sigma, e.unit),
                _sized(e.expected, e.unit),
                "–" if e.accepted is None else _sized(e.accepted, e.unit, 6),
                "–" if e.pull is None else f"{e.pull:+.1f}",
            )
            for effect, e in rows
        ),
        note="Sigmas are with the noise as found. Pull: distance from the accepted value in "
        "sigmas of both.",
        text_columns=(1, 2),
        learners=False,
    )


def class_table(d: Diagnosis) -> Table:
    """Return the rivals of each finding."""
    return Table(
        "What these data cannot tell apart",
        (
            "found",
            "could be instead",
            "correlation [–]",
            "odds against it [–]",
            "chance to tell apart [–]",
        ),
        tuple(
            (
                f.title,
                r.title,
                _close_to_one(r.correlation),
                number(r.odds, 2),
                number(r.probability, 2),
            )
            for f in d.findings
            for r in f.rivals
        ),
        note="Correlation: cosine between both signals after orbit and free parameters are fitted. "
        "Chance: Φ(√(λ(1 − ρ)/2)); no method does better with these data.",
        text_columns=(1,),
        learners=False,
    )


def alternative_table(d: Diagnosis) -> Table:
    """Return the other sets of effects that explain as much, at most the first twelve."""
    left = len(d.alternatives) - _MOST_SETS
    return Table(
        "Other sets that fit as well",
        ("in place of all findings", "odds against it [–]", "fall of chi-square [–]"),
        tuple(
            (" + ".join(a.titles), number(a.odds, 2), number(a.drop, 4))
            for a in d.alternatives[:_MOST_SETS]
        ),
        note="Sets beyond exchanging a finding by one of its rivals, each member needed. Odds: by "
        "evidence, with the expected sizes as priors; below one the set is the likelier, but its "
        "exact fit was not better." + (f" {left} more are in diagnosis.json." if left > 0 else ""),
        learners=False,
    )


def dismissed_table(d: Diagnosis) -> Table:
    """Return what was taken out again because what remains is not white."""
    return Table(
        "Not believed",
        ("effect", "fall of chi-square [–]", "significance by stretches of time [σ]"),
        tuple((x.title, number(x.drop, 3), number(x.strength, 2)) for x in d.dismissed),
        note="These pass the threshold of white noise; what remains is not white. Counted by whole "
        "stretches of time, a twenty-fourth of the data each, they have less than 4 sigma.",
        learners=False,
    )


def detectable_table(d: Diagnosis) -> Table:
    """Return the least size of each single parameter that these data would have shown."""
    return Table(
        "Smallest detectable sizes",
        (
            "effect",
            "parameter",
            "smallest detectable",
            "expected size",
            "smallest / expected [–]",
        ),
        tuple(
            (
                str(row["title"]),
                str(row["parameter"]),
                _sized(float(row["smallest_detectable"]), str(row["unit"])),
                _sized(float(row["expected"]), str(row["unit"])),
                number(float(row["share"]), 2),
            )
            for _, row in detectable(d).iterrows()
        ),
        note="With 90 % power at the false-alarm level of the case, each effect alone. Below one: "
        "it would have been seen at its expected size. Many times one: the orbit that is fitted "
        "absorbs the effect.",
        text_columns=(1,),
        learners=False,
    )


def step_table(d: Diagnosis) -> Table:
    """Return the waterfall in numbers."""
    titles = {c.name: c.title for c in d.case.candidates}
    return Table(
        "Residual RMS after each addition",
        ("step", "fitted arcs [σ]", "held-out arcs [σ]"),
        tuple(
            (
                step_label(s.added, titles).replace("\n", ", "),
                number(s.rms, 4),
                "–" if s.held_out_rms is None else number(s.held_out_rms, 4),
            )
            for s in d.steps
        ),
        learners=False,
    )


def further_table(d: Diagnosis) -> Table:
    """Return which further data would decide."""
    return Table(
        "Further arcs",
        ("found", "rival", "further data", "correlation then [–]", "chance to tell apart [–]"),
        tuple(
            (
                str(row["finding"]),
                str(row["rival"]),
                str(row["data"]),
                _close_to_one(float(row["correlation"])),
                number(float(row["probability"]), 2),
            )
            for _, row in d.further.iterrows()
        ),
        text_columns=(1, 2),
        learners=False,
    )


def whiteness_table(tests: pd.DataFrame) -> Table:
    """Return the tests of the final residuals."""
    many = "arc" in tests and len(set(tests["arc"])) > 1
    return Table(
        "Tests of the final residuals",
        ("series", "test", "statistic [–]", "p [–]", "verdict"),
        tuple(
            (
                " ".join(
                    [*([str(row["arc"])] if many else []), str(row["label"]), str(row["component"])]
                ),
                str(row["test"]),
                number(float(row["statistic"]), 3),
                number(float(row["p"]), 2),
                str(row["verdict"]),
            )
            for _, row in tests.iterrows()
        ),
        text_columns=(1, 4),
        learners=False,
    )


def addition_table(a: Addition) -> Table:
    """Return the residual RMS before and after, a row a data set."""
    return Table(
        "Residual RMS",
        ("data", "unit", "before", "after", "before [σ]", "after [σ]", "components [–]"),
        tuple(
            (
                str(row["label"]),
                str(row["unit"]),
                number(float(row["before"]), 4),
                number(float(row["after"]), 4),
                number(float(row["before_in_sigmas"]), 4),
                number(float(row["after_in_sigmas"]), 4),
                str(int(row["count"])),
            )
            for _, row in a.rms().iterrows()
        ),
        text_columns=(1,),
        learners=False,
    )


def _sized(value: float, unit: str, digits: int = 2) -> str:
    return number(value, digits) + ("" if unit == "1" else f" {unit}")


def _or_dash(value: float | None) -> str:
    return "–" if value is None else number(value, 2)


def _close_to_one(value: float) -> str:
    """Return a correlation with the digits that matter near one."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.3f}" if abs(value) < 0.999 else f"{value:.6f}"
