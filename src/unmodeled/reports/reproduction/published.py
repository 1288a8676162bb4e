"""What a paper says about its figures, from the data files in ``reports/published``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

from ruamel.yaml import YAML

from unmodeled.core.errors import ConfigError, nearest

__all__ = ["PublishedFigure", "Statement", "published_figure", "published_names"]


@dataclass(frozen=True)
class Statement:
    """One statement.

    Parameters
    ----------
    where : str
        Section or caption that it is printed in.
    text : str
        Word for word.
    values : mapping of str to float
        The numbers that it prints, if any.
    """

    where: str
    text: str
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class PublishedFigure:
    """A figure and what is said about it.

    Parameters
    ----------
    name : str
        As for ``unmodeled reproduce``.
    source : str
        Key into REFERENCES.md.
    key : str
        Number of the figure.
    title : str
        What it shows.
    statements : mapping of str to Statement
        By a name.
    sweep : str
        Sweep file without ending; empty if the figure needs no runs.
    beside : str
        Sweep whose runs some statements are compared with; empty for none.
    scenario : str
        Scenario file without ending that filters are flown on; empty for none.
    """

    name: str
    source: str
    key: str
    title: str
    statements: Mapping[str, Statement]
    sweep: str = ""
    beside: str = ""
    scenario: str = ""


@cache
def _figures() -> dict[str, PublishedFigure]:
    found: dict[str, PublishedFigure] = {}
    folder = resources.files("unmodeled.reports") / "published"
    for path in sorted(folder.iterdir(), key=lambda p: p.name):
        if not path.name.endswith(".yaml"):
            continue
        content: dict[str, Any] = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
        for name, figure in content["figures"].items():
            statements = {k: Statement(**v) for k, v in figure.pop("statements").items()}
            found[name] = PublishedFigure(name, content["source"], statements=statements, **figure)
    return found


def published_names() -> tuple[str, ...]:
    """Return the names of all figures, in the order of the data files."""
    return tuple(_figures())


def published_figure(name: str) -> PublishedFigure:
    """Return a figure by its name.

    Raises
    ------
    ConfigError
        With the nearest name.
    """
    if name not in _figures():
        raise ConfigError(
            f'no figure "{name}" to reproduce',
            allowed=", ".join(published_names()),
            do=nearest(name, published_names()),
        )
    return _figures()[name]
