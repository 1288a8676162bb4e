"""Pages that need nothing else: templates, figures inside the page and as files beside it."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure
from ruamel.yaml import YAML

from unmodeled.core.provenance import Provenance
from unmodeled.reports.sections import Drawn, Section
from unmodeled.reports.style import render

__all__ = ["Embedded", "embed", "embed_sections", "provenance_rows", "render_page", "yaml_text"]

# Above this size a figure goes into the page as PNG: 200 dpi is sharp enough, and 4 MB are kept.
_LARGEST_SVG = 600_000


@dataclass(frozen=True, slots=True)
class Embedded:
    """A figure as a template sees it: its words, a data address, and CSS pixels."""

    name: str
    alt: str
    caption: str
    source: str
    width: int
    height: int


def embed(drawn: Drawn, folder: Path) -> Embedded:
    """Write a figure as PNG and SVG into a folder; return it for the page."""
    png, svg = (render(drawn.figure, kind) for kind in ("png", "svg"))
    (folder / f"{drawn.name}.png").write_bytes(png)
    (folder / f"{drawn.name}.svg").write_bytes(svg)
    content, kind = (svg, "svg+xml") if len(svg) <= _LARGEST_SVG else (png, "png")
    width, height = _size(drawn.figure)
    return Embedded(
        drawn.name,
        drawn.alt,
        drawn.caption,
        f"data:image/{kind};base64,{base64.b64encode(content).decode()}",
        width,
        height,
    )


def embed_sections(sections: Sequence[Section], folder: Path) -> list[dict[str, Any]]:
    """Return sections for a template; their figures are written into ``folder / "figures"``."""
    figures = folder / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    return [
        {
            "id": s.id,
            "title": s.title,
            "words": s.words,
            "figures": [embed(f, figures) for f in s.figures],
            "tables": s.tables,
        }
        for s in sections
    ]


def render_page(template: str, **content: Any) -> str:
    """Return a page from a template of ``reports/templates``; text is escaped.

    Parameters
    ----------
    template : str
        File name.
    **content : object
        What the template shows; ``css`` is added.
    """
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_resource),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page: str = environment.get_template(template).render(
        css=Markup(_resource("report.css")), **content
    )
    return page


def provenance_rows(provenance: Provenance, hashed: str) -> list[tuple[str, str]]:
    """Return the footer of a page: names and values.

    Parameters
    ----------
    provenance : Provenance
        Of the run.
    hashed : str
        What its hash is of, e.g. "configuration".
    """
    p = provenance
    return [
        (f"{hashed} (SHA-256)", p.config_hash),
        ("seed", str(p.seed)),
        ("versions", ", ".join(f"{k} {v}" for k, v in p.versions.items())),
        ("commit", p.commit or "installed package"),
        ("Python and system", f"{p.python}, {p.system}, {p.processors} processors"),
        ("host", p.host),
        ("finished (UTC)", p.finished),
    ]


def yaml_text(content: Mapping[str, Any]) -> str:
    """Return a table as YAML for a page, one key a line; empty for an empty table."""
    if not content:
        return ""
    text = io.StringIO()
    yaml = YAML()
    yaml.default_flow_style = False
    yaml.width = 100
    yaml.dump(dict(content), text)
    return text.getvalue()


def _resource(name: str) -> str:
    return (resources.files("unmodeled.reports") / "templates" / name).read_text(encoding="utf-8")


def _size(figure: Figure) -> tuple[int, int]:
    """Return width and height in CSS pixels."""
    width, height = figure.get_size_inches()
    return round(96 * float(width)), round(96 * float(height))
