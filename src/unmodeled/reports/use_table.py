"""Is a learner any use off its training orbit: its two comparisons with the bare point mass."""

from __future__ import annotations

from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.pipeline.use_check import DO_NOT_USE, UNFIT_RATIO
from unmodeled.reports.numbers import number
from unmodeled.reports.tables import Table
from unmodeled.reports.words import ranked

__all__ = ["training_check_sentence", "use_table"]


def use_table(result: CharacterizationResult) -> Table:
    """Return both checks, the most robust learner first.

    Parameters
    ----------
    result : CharacterizationResult
        Learners whose fit failed have no row here.
    """
    checks = result.use_checks()
    rows = []
    for r in ranked(result):
        own = checks[checks["learner"] == r.label] if len(checks) else checks
        for check in own.to_dict(orient="records"):
            rows.append(
                (
                    r.label,
                    str(check["held_out"]),
                    number(check["median"]),
                    number(check["point_mass_median"]),
                    number(check["over_point_mass"]),
                    str(check["use"]),
                )
            )
    return Table(
        "Is it any use?",
        (
            "learner",
            "samples that it has not seen",
            "median [–]",
            "bare point mass [–]",
            "ratio [–]",
            "advice",
        ),
        tuple(rows),
        f"Above {UNFIT_RATIO:g} times the median error of the bare point mass: {DO_NOT_USE}. "
        "Training data held back need no truth; their errors count from the observed "
        "accelerations, noise included, and are an easier test than other orbits: to pass it "
        "proves little.",
        text_columns=(1, 5),
    )


def training_check_sentence(result: CharacterizationResult) -> str:
    """Return which learners failed on training data held back, or an empty text."""
    failed = [
        f"{r.label} ({number(r.training_check.median)} against "
        f"{number(r.training_check.point_mass)})"
        for r in ranked(result)
        if r.training_check is not None and r.training_check.unfit
    ]
    if not failed:
        return ""
    return (
        "Known at training already, without any truth: where a part of the training data was held "
        f"back, more than {UNFIT_RATIO:g} times the median error of the bare point mass: "
        f"{', '.join(failed)}; {DO_NOT_USE}."
    )
