"""The pages of `diagnose` and `add`: verdict, waterfall, residuals, candidates, tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from unmodeled.core.provenance import Provenance
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.add_effect import Addition
from unmodeled.pipeline.diagnosis.result import Diagnosis
from unmodeled.reports import diagnosis_tables as tables
from unmodeled.reports import diagnosis_words as words
from unmodeled.reports.case_page import write_case_page
from unmodeled.reports.families import family_colour
from unmodeled.reports.figures.candidate_scores import candidate_scores
from unmodeled.reports.figures.residuals_in_time import residuals_in_time
from unmodeled.reports.figures.waterfall import Bar, waterfall
from unmodeled.reports.numbers import number
from unmodeled.reports.remainder_section import remainder_section
from unmodeled.reports.sections import Drawn, Section
from unmodeled.reports.tables import Table

__all__ = ["write_addition_report", "write_diagnosis_report"]


def write_diagnosis_report(
    diagnosis: Diagnosis, folder: Path, provenance: Provenance | None = None
) -> Path:
    """Write ``report.html`` and ``figures/*.png``, ``figures/*.svg``.

    Parameters
    ----------
    diagnosis : Diagnosis
        What to report.
    folder : Path
        Run folder; made if missing.
    provenance : Provenance, optional
        For the footer; collected now if not given.

    Returns
    -------
    Path
        The page, which asks for nothing over the network and runs no script.
    """
    d = diagnosis
    sections = [s for s in diagnosis_sections(d) if s.figures or any(t.rows for t in s.tables)]
    return write_case_page(
        folder,
        d.case,
        sections,
        provenance,
        title="what is the model missing?",
        kicker=f"Diagnosis, {d.case.body.title}",
        question="What is the force model missing, and how sure is that?",
        answer_title="What was found",
        answer=d.sentence,
        findings=[
            {
                "title": f.title,
                "text": words.finding_sentence(f).removeprefix(f.title),
                "colour": family_colour(f.family),
            }
            for f in d.findings
        ],
        basis=[
            words.residual_sentence(d),
            words.noise_sentence(d),
            words.remainder_sentence(d),
            *([] if d.findings else [words.detectable_sentence(d)]),
        ],
    )


def write_addition_report(
    addition: Addition, folder: Path, provenance: Provenance | None = None
) -> Path:
    """Write the page of one added effect, as `write_diagnosis_report` does.

    Parameters
    ----------
    addition : Addition
        What to report.
    folder : Path
        Made if missing.
    provenance : Provenance, optional
        For the footer.
    """
    a = addition
    title = a.candidate.title
    bars = (
        Bar("model as given", a.rms_before, a.held_out_before),
        Bar(f"+ {title}", a.rms_after, a.held_out_after),
    )
    sections = [
        Section(
            "error",
            "The error before and after",
            figures=(_waterfall(bars),),
            tables=(
                tables.addition_table(a),
                tables.estimate_table([(title, e) for e in a.estimates]),
            ),
        ),
        Section("residuals", "Residuals", figures=(_residuals(a.case, a.fit, a.final_fit),)),
    ]
    return write_case_page(
        folder,
        a.case,
        sections,
        provenance,
        title=f"{title} added",
        kicker=f"One effect added, {a.case.body.title}",
        question=f"How does the error change with {title}?",
        answer_title="What changed",
        answer=f"The residual RMS goes from {number(a.rms_before, 3)} to "
        f"{number(a.rms_after, 3)} σ; chi-square falls by {number(a.delta_chi_square, 3)}.",
        findings=[
            {
                "title": title,
                "text": f": {words.estimates_text(a.estimates)}.",
                "colour": family_colour(a.candidate.family),
            }
        ],
        basis=[],
    )


def diagnosis_sections(d: Diagnosis) -> list[Section]:
    """Return all sections of a diagnosis, empty ones too."""
    titles = {c.name: c.title for c in d.case.candidates}
    bars = [Bar(words.step_label(s.added, titles), s.rms, s.held_out_rms) for s in d.steps]
    scores = candidate_scores(d.candidates, [f.name for f in d.findings], d.noise)
    return [
        Section(
            "waterfall",
            "The error falls",
            figures=(_waterfall(bars, d.noise),),
            tables=(tables.step_table(d),),
        ),
        Section("residuals", "Residuals", figures=(_residuals(d.case, d.fit, d.final_fit),)),
        remainder_section(d.remainder),
        Section(
            "findings",
            "Findings",
            tables=_filled(
                tables.estimate_table(
                    [(f.title, e) for f in d.findings for e in (*f.estimates, *f.place)]
                ),
                tables.finding_table(d),
                tables.class_table(d),
                tables.alternative_table(d),
                tables.dismissed_table(d),
            ),
        ),
        Section(
            "further",
            "Which further data would decide",
            tables=_filled(tables.further_table(d)),
        ),
        Section(
            "candidates",
            "All candidates",
            figures=()
            if scores is None
            else (
                Drawn(
                    "candidate-scores",
                    scores,
                    "A bar for each candidate effect: fall of chi-square with it alone, with the "
                    "threshold",
                    "What each candidate explains alone, before anything is added; strong bars "
                    "pass what was needed (black ticks, at the false-alarm level of the case). "
                    "Candidates overlap: one hidden effect raises many bars, and the set that "
                    "explains most with the fewest parameters is found.",
                ),
            ),
        ),
        Section(
            "detectable",
            "What these data would have shown",
            tables=_filled(tables.detectable_table(d)),
        ),
        Section(
            "whiteness",
            "Is what is left noise?",
            tables=_filled(tables.whiteness_table(d.whiteness)) if len(d.whiteness) else (),
        ),
    ]


def _filled(*found: Table) -> tuple[Table, ...]:
    return tuple(t for t in found if t.rows)


def _waterfall(bars: Sequence[Bar], noise: float | None = None) -> Drawn:
    """Draw with the noise as found, or as stated if it is not known yet."""
    arcs = (
        ", on the fitted arcs and on those that were held out"
        if any(b.held_out is not None for b in bars)
        else ""
    )
    floor = (
        "as stated"
        if noise is None
        else "as found: a fit ends a little below it, for it absorbs some noise"
    )
    return Drawn(
        "waterfall",
        waterfall(bars, noise or 1.0, "" if noise else "noise as stated"),
        f"Residual RMS after each addition, beside the noise {floor.partition(':')[0]}",
        f"Residual RMS over the stated standard deviations after each addition{arcs}. The dotted "
        f"line is the noise {floor}.",
    )


def _residuals(case: Case, before: Any, after: Any) -> Drawn:
    return Drawn(
        "residuals",
        residuals_in_time(before.residuals, after.residuals),
        "Normalised residuals in time before and after",
        f"Measured minus predicted over the stated standard deviation, since {case.epoch}; bands "
        "at one and three sigmas. Crosses were edited out.",
    )
