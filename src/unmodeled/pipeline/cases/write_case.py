"""Case files written: the next one after an effect was added."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.known_effects import build_effect, entry_of, parameter_names
from unmodeled.pipeline.yaml12 import write_yaml

__all__ = ["add_to_source", "write_case"]


def write_case(mapping: Mapping[str, Any], path: Path | str) -> Path:
    """Write a case file that `load_case` reads back; it appears whole or not at all.

    Parameters
    ----------
    mapping : mapping
        Content, e.g. ``Case.source``.
    path : path
        Where to; its folder must exist.

    Raises
    ------
    ConfigError
        If it cannot be written.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write_yaml(_plain(mapping), part)
        part.replace(path)
    except OSError as exc:
        part.unlink(missing_ok=True)
        raise ConfigError(f"{path} cannot be written ({exc})", do="check folder and disk") from exc
    return path


def add_to_source(
    mapping: Mapping[str, Any],
    candidate: Candidate,
    values: Mapping[str, float],
    sigmas: Mapping[str, float | None] | None = None,
) -> dict[str, Any]:
    """Return the content of a case file whose known model also has a candidate.

    Parameters
    ----------
    mapping : mapping
        Content of the case file so far; not changed.
    candidate : Candidate
        What to add. If the model has its effect already (A2 after A1, an error of GM), that
        entry gets the values.
    values : mapping of str to float
        Estimates, SI; parameters not given keep the candidate's values.
    sigmas : mapping of str to float or None, optional
        Parameters that stay free, with the sigma of their priors or None.

    Raises
    ------
    ConfigError
        If a value belongs to no effect of the model.
    """
    fresh: dict[str, Any] = copy.deepcopy(_plain(mapping))
    known: list[dict[str, Any]] = fresh["known"]
    given = {**candidate.values, **values}
    free = dict(sigmas or {})
    built = [build_effect(entry) for entry in known]
    own = set(parameter_names(candidate.effect))
    turns = {n: v for n, v in values.items() if n not in own}
    if turns:  # errors of spin and pole belong to the rotation, which is no effect
        entry = next((e for e, b in zip(known, built, strict=True) if b is None), None)
        if entry is None:
            entry = {"effect": "rotation"}
            known.append(entry)
        _merge(entry, entry_of(None, turns, {n: s for n, s in free.items() if n in turns}))
    rest = {n: v for n, v in given.items() if n in own}
    loose = {n: s for n, s in free.items() if n in own}
    if candidate.effect in built:
        changed = {n: v for n, v in rest.items() if n in values}
        entry = known[built.index(candidate.effect)]
        _merge(entry, entry_of(candidate.effect, changed, loose))
        return fresh
    held = {n for b in built if b is not None for n in parameter_names(b)}
    shared = {n: v for n, v in rest.items() if n in held}
    # What another entry states (GM, R_ref) is not stated twice, unless it was estimated.
    for name, value in shared.items():
        if name in values:
            owner = next(
                e
                for e, b in zip(known, built, strict=True)
                if b is not None and name in parameter_names(b)
            )
            moved = {n: s for n, s in loose.items() if n == name}
            _merge(owner, entry_of(build_effect(owner), {name: value}, moved))
    mine = {n: v for n, v in rest.items() if n not in held}
    if set(candidate.estimate) - held:
        loose = {n: s for n, s in loose.items() if n in mine}
        known.append(entry_of(candidate.effect, mine, loose))
    return fresh


def _merge(entry: dict[str, Any], more: Mapping[str, Any]) -> None:
    """Put the values and freedom of one entry into another."""
    values = dict(entry.get("values", {}))
    for name, value in more.get("values", {}).items():
        entry.pop(name, None)  # it may stand there directly
        values[name] = value
    if values:
        entry["values"] = values
    free = entry.get("free", {})
    free = dict.fromkeys(free) if isinstance(free, list) else dict(free)
    free |= more.get("free", {})
    if free:
        entry["free"] = free


def _plain(value: Any) -> Any:
    """Tables and lists of numbers and text only, as YAML holds them."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value
