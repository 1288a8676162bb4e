"""A statement of a paper beside our numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from unmodeled.reports.reproduction.published import PublishedFigure
from unmodeled.reports.tables import Table

__all__ = ["Drawing", "Found", "as_frame", "as_table", "beside"]

_WORDS = {True: "yes", False: "no", None: "not compared"}


@dataclass(frozen=True)
class Found:
    """What we find where the paper states something.

    Parameters
    ----------
    ours : str
        Our numbers in words.
    agrees : bool or None
        None if it cannot be compared.
    remark : str
        The rule behind `agrees`; where it differs, how.
    """

    ours: str
    agrees: bool | None
    remark: str = ""


@dataclass(frozen=True)
class Drawing:
    """A figure with its words, what was found, and what it was made from.

    Parameters
    ----------
    figure : Figure
    alt, caption : str
    found : dict of str to Found
        By statement.
    basis : str
        In one sentence.
    source : dict
        The configuration, plain data.
    """

    figure: Figure
    alt: str
    caption: str
    found: dict[str, Found]
    basis: str
    source: dict[str, Any]


def beside(figure: PublishedFigure, found: Mapping[str, Found]) -> list[tuple[str, Found]]:
    """Return what was found in the order of the paper's statements.

    Raises
    ------
    KeyError
        If a statement has no answer: then the code is wrong, not the input.
    """
    return [(key, found[key]) for key in figure.statements]


def as_frame(figure: PublishedFigure, found: Mapping[str, Found]) -> pd.DataFrame:
    """Return one row a statement.

    Columns: ``statement``, ``where``, ``paper``, ``ours``, ``agrees``, ``remark``.
    """
    rows = [
        (
            key,
            figure.statements[key].where,
            figure.statements[key].text,
            f.ours,
            _WORDS[f.agrees],
            f.remark,
        )
        for key, f in beside(figure, found)
    ]
    return pd.DataFrame(rows, columns=["statement", "where", "paper", "ours", "agrees", "remark"])


def as_table(figure: PublishedFigure, found: Mapping[str, Found]) -> Table:
    """Return the same as a table of a page."""
    frame = as_frame(figure, found)
    return Table(
        "Paper and ours",
        ("paper", "printed in", "ours", "agrees", "remark"),
        tuple(
            (f"“{r['paper']}”", r["where"], r["ours"], r["agrees"], r["remark"])
            for r in frame.to_dict(orient="records")
        ),
        "The paper's words are quoted from its text and captions.",
        text_columns=(1, 2, 3, 4),
        learners=False,
    )
