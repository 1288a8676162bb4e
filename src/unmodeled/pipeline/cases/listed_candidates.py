"""Candidates that a case file describes itself: shapes, which no catalogue can know."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import Dynamics, Ellipsoid, Polyhedron
from unmodeled.pipeline.cases.accepted_values import Surveyed
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.known_effects import read_known

__all__ = ["listed_candidate"]

_TITLES = {"polyhedron": "shape of a mesh", "ellipsoid": "ellipsoid's shape"}


def listed_candidate(
    entry: Mapping[str, Any], surveyed: Surveyed, folder: Path, dynamics: Dynamics
) -> Candidate | None:
    """Return the shape that an entry of ``candidates`` describes; None if the model has it.

    Its scale is estimated: 0 for a point mass, 1 for constant density.

    Parameters
    ----------
    entry : mapping
        As in ``known``, e.g. ``{"effect": "polyhedron", "file": "shape.obj", "scale": "1 km"}``.
    surveyed : Surveyed
        Where GM comes from.
    folder : Path
        Where relative file names start.
    dynamics : Dynamics
        The known model.

    Raises
    ------
    ConfigError
        If the entry is no shape, leaves something free, or the model has harmonics of the same
        degrees.
    """
    name = entry.get("effect")
    if name not in _TITLES:
        raise ConfigError(
            f"a candidate is described as {dict(entry)}",
            allowed="tables of " + ", ".join(_TITLES) + "; names for all others",
        )
    for key in ("free", "density"):
        if key in entry:
            raise ConfigError(
                f"the candidate {name} gives {key}",
                allowed="the shape: its scale is estimated about the model's GM",
            )
    known = read_known([entry], surveyed, folder)
    effect = known.effects[0]
    assert isinstance(effect, Polyhedron | Ellipsoid)
    if any(e.name == name for e in dynamics.effects):
        return None
    double = sorted(effect.terms & {t for e in dynamics.effects for t in e.terms})
    if double:
        raise ConfigError(
            f'the candidate {name} contains "{double[0]}", which the model has',
            do="take that out of known: a shape has all degrees",
        )
    own = {p.name for p in effect.parameters} - {"GM"}
    scale = f"{name}_scale"
    values = {k: v for k, v in known.values.items() if k in own} | {scale: 0.0}
    return Candidate(name, _TITLES[name], effect, (scale,), values, (1.0,), "gravity")
