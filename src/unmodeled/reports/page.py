"""The HTML page of a run folder: one file that needs nothing else, figures beside it."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure
from ruamel.yaml import YAML

from unmodeled.core.errors import InputError
from unmodeled.datasets.bodies import load_body
from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.reports.baseline import point_mass_summaries
from unmodeled.reports.data_words import data_sentences, elsewhere
from unmodeled.reports.sections import Drawn, Section, sections
from unmodeled.reports.style import learner_styles, render
from unmodeled.reports.words import learner_sentence, overview, ranked, verdict

__all__ = ["write_report"]

# Above this size a figure goes into the page as PNG: 200 dpi is sharp enough, and 4 MB are kept.
_LARGEST_SVG = 600_000


@dataclass(frozen=True, slots=True)
class _Embedded:
    """A figure as the template sees it."""

    name: str
    alt: str
    caption: str
    source: str
    width: int
    height: int


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
    figures = folder / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    parts = [_embed_section(s, figures) for s in sections(result)]
    environment = jinja2.Environment(
        loader=jinja2.BaseLoader(),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    reference = point_mass_summaries(result.data)
    where = elsewhere(result)
    page = environment.from_string(_resource("report.html.j2")).render(
        name=result.config.name,
        body=_body_title(result),
        where=where,
        css=Markup(_resource("report.css")),
        styles=learner_styles(result.config.learners),
        overview=overview(result),
        findings=[
            {
                "label": r.label,
                "text": learner_sentence(
                    r, reference, where, simulated=result.config.data.simulated
                ).removeprefix(r.label),
                "unfit": bool(r.failure) or verdict(r.summaries, reference).unfit,
            }
            for r in ranked(result)
        ],
        basis=data_sentences(result),
        sections=parts,
        config=_yaml(result.config.as_dict()),
        provenance=_provenance(result),
    )
    target = folder / "report.html"
    target.write_text(page, encoding="utf-8")
    return target


def _embed_section(section: Section, figures: Path) -> dict[str, Any]:
    return {
        "id": section.id,
        "title": section.title,
        "words": section.words,
        "figures": [_save(f, figures) for f in section.figures],
        "tables": section.tables,
    }


def _save(drawn: Drawn, folder: Path) -> _Embedded:
    png, svg = (render(drawn.figure, kind) for kind in ("png", "svg"))
    (folder / f"{drawn.name}.png").write_bytes(png)
    (folder / f"{drawn.name}.svg").write_bytes(svg)
    content, kind = (svg, "svg+xml") if len(svg) <= _LARGEST_SVG else (png, "png")
    width, height = _size(drawn.figure)
    return _Embedded(
        drawn.name,
        drawn.alt,
        drawn.caption,
        f"data:image/{kind};base64,{base64.b64encode(content).decode()}",
        width,
        height,
    )


def _size(figure: Figure) -> tuple[int, int]:
    """Return width and height in CSS pixels."""
    width, height = figure.get_size_inches()
    return round(96 * float(width)), round(96 * float(height))


def _resource(name: str) -> str:
    return (resources.files("unmodeled.reports") / "templates" / name).read_text(encoding="utf-8")


def _body_title(result: CharacterizationResult) -> str:
    try:
        return load_body(result.config.body).title
    except InputError:  # a card of the user's own that is not here any more
        return result.config.body


def _yaml(content: dict[str, Any]) -> str:
    text = io.StringIO()
    yaml = YAML()
    yaml.default_flow_style = False
    yaml.width = 100
    yaml.dump(content, text)
    return text.getvalue()


def _provenance(result: CharacterizationResult) -> list[tuple[str, str]]:
    p = result.provenance
    return [
        ("configuration (SHA-256)", p.config_hash),
        ("seed", str(p.seed)),
        ("versions", ", ".join(f"{k} {v}" for k, v in p.versions.items())),
        ("commit", p.commit or "installed package"),
        ("Python and system", f"{p.python}, {p.system}, {p.processors} processors"),
        ("host", p.host),
        ("finished (UTC)", p.finished),
    ]
