"""Pages about a case: one template, one footer, written beside their figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from unmodeled.core.provenance import Provenance
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.save import case_provenance
from unmodeled.reports.embedding import embed_sections, provenance_rows, render_page, yaml_text
from unmodeled.reports.sections import Section

__all__ = ["write_case_page"]


def write_case_page(
    folder: Path,
    case: Case,
    sections: Sequence[Section],
    provenance: Provenance | None,
    **content: Any,
) -> Path:
    """Write ``report.html`` and the figures of a page about a case; return the page.

    Parameters
    ----------
    folder : Path
        Run folder; made if missing.
    case : Case
        What the page is about.
    sections : sequence of Section
        Below the words.
    provenance : Provenance, optional
        For the footer; collected now if not given.
    **content : object
        Title, question, answer and the rest of what ``diagnosis.html.j2`` shows.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    page = render_page(
        "diagnosis.html.j2",
        name=case.name,
        sections=embed_sections(sections, folder),
        source=yaml_text(case.source) or "made in memory",
        provenance=provenance_rows(provenance or case_provenance(case), "case file"),
        **content,
    )
    target = folder / "report.html"
    target.write_text(page, encoding="utf-8")
    return target
