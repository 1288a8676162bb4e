"""The case file after effects were found: the known model with them, their parameters free."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.cases.write_case import add_to_source

__all__ = ["moved", "next_case", "plain_name", "renamed"]


def next_case(fitted: Case, added: Sequence[Candidate]) -> dict[str, Any]:
    """Return the content of the case file whose known model also has what was added.

    The estimates become the values of the model and stay free, without a prior: the data decide
    again, and later candidates cannot profit from an effect held fixed at its estimate. A place
    that was searched keeps the prior of the search.

    Parameters
    ----------
    fitted : Case
        With the effects added, at the values of its fit.
    added : sequence of Candidate
        What was added to ``fitted.source``, in this order.
    """
    now = {**fitted.dynamics.values, **fitted.instrument_values}
    content: dict[str, Any] = dict(fitted.source)
    for candidate in added:
        names = (*candidate.estimate, *candidate.searched)
        values = {n: float(now[n]) for n in names}
        free = {n: fitted.estimate.get(n) for n in names}
        content = add_to_source(content, candidate, values, free)
        content = _without_candidate(content, candidate.name)
    return content


def renamed(content: Mapping[str, Any], end: str) -> dict[str, Any]:
    """Return a case file under a longer name: its run folder is not that of the case before."""
    return {**content, "name": f"{content['name']}-{end}"}


def plain_name(effect: str) -> str:
    """Return a name of an effect as part of the name of a file or case.

    Examples
    --------
    >>> plain_name("time_tag[goldstone]")
    'time_tag-goldstone'
    """
    return "".join(c if c.isalnum() or c == "_" else "-" for c in effect).strip("-")


def moved(content: Mapping[str, Any], old: Path, new: Path) -> dict[str, Any]:
    """Return a case file for another folder: names of files beside it are made to fit.

    Names that are not found in the old folder (card names, files looked for in a data folder)
    stay as they are.

    Parameters
    ----------
    content : mapping
        Of the case file.
    old, new : Path
        Folder that it lay in, and folder that it will lie in.
    """

    def name(given: Any) -> Any:
        if not isinstance(given, str) or not (old / given).is_file():
            return given
        return Path(os.path.relpath((old / given).resolve(), new.resolve())).as_posix()

    fresh = dict(content)
    for key in ("body", "ephemeris"):
        if key in fresh:
            fresh[key] = name(fresh[key])
    for key in ("measurements", "known"):
        fresh[key] = [e | {"file": name(e["file"])} if "file" in e else e for e in fresh[key]]
    return fresh


def _without_candidate(content: dict[str, Any], name: str) -> dict[str, Any]:
    """Drop a name: what is in the model is neither looked for nor left out any more."""
    listed = content.get("candidates")
    if isinstance(listed, Mapping):
        kept = [n for n in listed.get("exclude", ()) if n != name]
        return content | {"candidates": {"exclude": kept}}
    if isinstance(listed, list | tuple):
        return content | {"candidates": [n for n in listed if n != name]}
    return content
