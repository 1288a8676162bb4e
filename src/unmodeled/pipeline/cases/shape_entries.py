"""Entries of a case file that describe a shape: its file, its unit of length, its density."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from unmodeled.core.constants import G
from unmodeled.core.errors import ConfigError
from unmodeled.datasets.shape_file import read_shape
from unmodeled.models.physics import Ellipsoid, Mesh, Polyhedron
from unmodeled.pipeline.cases.quantities import parse_quantity, write_quantity

__all__ = ["SHAPE_KEYS", "mesh_keys", "mesh_of", "shape_values"]

#: Keys beside structure and parameters, by effect.
SHAPE_KEYS: Mapping[str, tuple[str, ...]] = {
    "polyhedron": ("file", "scale", "density"),
    "ellipsoid": ("density",),
}
#: What stands for a mesh where only the names of parameters matter.
_ANY = Mesh(
    np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
)


def mesh_of(entry: Mapping[str, Any], where: str, folder: Path | None) -> Mesh:
    """Return the mesh that an entry names.

    Parameters
    ----------
    entry : mapping
        With ``file`` and ``scale``.
    where : str
        For error texts.
    folder : Path or None
        Where relative names start; None: the shape does not matter, and no file is read.

    Raises
    ------
    ConfigError
        If file or scale is missing or the scale is no length.
    DataError
        If the file is no shape.
    """
    for key in ("file", "scale"):
        if key not in entry:
            raise ConfigError(
                f"{where} (polyhedron) lacks {key}",
                do='write e.g. "{effect: polyhedron, file: shape.obj, scale: 1 km}": the mesh, and '
                "the length of its unit",
            )
    scale = parse_quantity(entry["scale"], "m", f"{where}: scale")
    if folder is None:
        return _ANY
    found = read_shape(folder / str(entry["file"]), scale)
    return Mesh(found.vertices, found.faces, str(entry["file"]), scale)


def mesh_keys(mesh: Mesh) -> dict[str, Any]:
    """Return the keys that `mesh_of` turns into the same mesh."""
    return {"file": mesh.name, "scale": write_quantity(mesh.unit, "m")}


def shape_values(
    entry: Mapping[str, Any], effect: object, stated: Mapping[str, float]
) -> dict[str, float]:
    """Return GM from a density, if the entry gives one.

    Raises
    ------
    ConfigError
        If GM is given, too, an axis is missing, or the density is not positive.
    """
    if "density" not in entry or not isinstance(effect, Polyhedron | Ellipsoid):
        return {}
    name = effect.name
    density = parse_quantity(entry["density"], "kg m-3", f"density of {name}")
    if not density > 0:
        raise ConfigError(f"density of {name} is {entry['density']}", allowed="a density > 0")
    if "GM" in stated:
        raise ConfigError(f"{name} has both GM and density", allowed="one of them")
    if isinstance(effect, Polyhedron):
        volume = effect.mesh.volume
    else:
        axes = [f"ellipsoid_{k}" for k in "abc"]
        missing = [a for a in axes if a not in stated]
        if missing:
            raise ConfigError(f"{name} has a density and lacks {missing[0]}", do="give its axes")
        volume = 4.0 / 3.0 * math.pi * math.prod(stated[a] for a in axes)
    return {"GM": G.value * density * volume}
