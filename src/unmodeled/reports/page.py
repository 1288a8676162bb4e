"""The HTML page of a run folder: one file that needs nothing else, figures beside it."""

from __future__ import annotations

from pathlib import Path

from unmodeled.core.errors import InputError
from unmodeled.datasets.bodies import load_body
from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.pipeline.use_check import point_mass_summaries
from unmodeled.reports.data_words import data_sentences, elsewhere
from unmodeled.reports.embedding import embed_sections, provenance_rows, render_page, yaml_text
from unmodeled.reports.sections import sections
from unmodeled.reports.style import learner_styles
from unmodeled.reports.use_table import training_check_sentence
from unmodeled.reports.words import learner_sentence, overview, ranked, verdict, zonal_truth

__all__ = ["write_report"]


def write_report(result: CharacterizationResult, folder: Path) -> Path:
    """Write ``report.html`` and ``figures/*.png``, ``figures/*.svg``.

    The page asks for nothing over the network and runs no script. The same result gives the same
    bytes.

    Parameters
    ----------
    result : CharacterizationResult
        What to report.
    folder : Path
        Run folder; made if missing.

    Returns
    -------
    Path
        The page.
    """
    folder = Path(folder)
    reference = point_mass_summaries(result.data)
    where = elsewhere(result)
    page = render_page(
        "report.html.j2",
        name=result.config.name,
        body=_body_title(result),
        where=where,
        styles=learner_styles(result.config.learners),
        overview=overview(result),
        findings=[
            {
                "label": r.label,
                "text": learner_sentence(
                    r, reference, where, simulated=zonal_truth(result)
                ).removeprefix(r.label),
                "unfit": bool(r.failure) or verdict(r.summaries, reference).unfit,
            }
            for r in ranked(result)
        ],
        basis=[text for text in (training_check_sentence(result),) if text]
        + data_sentences(result),
        sections=embed_sections(sections(result), folder),
        config=yaml_text(result.config.as_dict()),
        provenance=provenance_rows(result.provenance, "configuration"),
    )
    target = folder / "report.html"
    target.write_text(page, encoding="utf-8")
    return target


def _body_title(result: CharacterizationResult) -> str:
    try:
        return load_body(result.config.body).title
    except InputError:  # a card of the user's own that is not here any more
        return result.config.body
