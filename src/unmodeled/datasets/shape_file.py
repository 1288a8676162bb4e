"""Shape models: meshes of triangles from .obj files and plate models (.tab)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from unmodeled.core.errors import ConfigError, DataError, nearest
from unmodeled.models.physics.mesh import Mesh

__all__ = ["read_shape"]

_SUFFIXES = (".obj", ".tab", ".txt")
#: Words of an .obj file that say nothing about the shape.
_IGNORED = {"#", "o", "g", "s", "vn", "vt", "vp", "mtllib", "usemtl", "l"}


def read_shape(path: str | Path, scale: float) -> Mesh:
    """Read the shape of a body.

    Two layouts are read whatever the suffix: lines ``v x y z`` and ``f i j k`` (Wavefront .obj;
    ``f i/t/n`` and polygons, which are cut into triangles, too), and the counted table of the
    Planetary Data System's plate models: the number of vertices, the vertices, the number of
    plates (or both numbers in the first line), the plates; rows may begin with their own number.

    Parameters
    ----------
    path : str or Path
        ``.obj``, ``.tab`` or ``.txt``.
    scale : float
        Length of the file's unit, m: 1000 for a file in kilometres. Never assumed.

    Returns
    -------
    Mesh
        Metres, in the file's axes, which should be the body's.

    Raises
    ------
    ConfigError
        If the scale is not positive.
    DataError
        If the file is missing, no shape, or its surface is not closed; see `Mesh`.
    """
    path = Path(path)
    if not (np.isfinite(scale) and scale > 0):
        raise ConfigError(f"scale of {path.name} is {scale} m", allowed="a length > 0")
    if path.suffix.lower() not in _SUFFIXES:
        raise DataError(
            f'{path.name} has suffix "{path.suffix}"',
            allowed=", ".join(_SUFFIXES),
            do=nearest(path.suffix, _SUFFIXES),
        )
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError as exc:
        raise DataError(f"there is no shape {path}", do="check the path") from exc
    except (OSError, UnicodeDecodeError) as exc:
        raise DataError(f"{path.name} cannot be read ({exc})") from exc
    rows = [(k, line.split()) for k, line in enumerate(lines, start=1) if line.split()]
    lettered = any(words[0] in ("v", "f") for _, words in rows)
    read = _lettered if lettered else _counted
    vertices, faces = read(rows, path.name)
    return Mesh(scale * np.array(vertices), np.array(faces), path.name, scale)


Rows = list[tuple[int, list[str]]]
Surface = tuple[list[list[float]], list[list[int]]]


def _lettered(rows: Rows, file: str) -> Surface:
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for number, words in rows:
        if words[0] == "v" and len(words) >= 4:
            vertices.append(_numbers(words[1:4], number, file))
        elif words[0] == "f" and len(words) >= 4:
            # i, i/t or i/t/n; negative numbers count back from the last vertex.
            corners = _whole([w.split("/")[0] for w in words[1:]], number, file)
            fan = [c - 1 if c > 0 else len(vertices) + c for c in corners]
            faces += [[fan[0], fan[k], fan[k + 1]] for k in range(1, len(fan) - 1)]
        elif words[0][0] != "#" and words[0] not in _IGNORED:
            raise _damaged(number, file, "v x y z or f i j k")
    if not vertices or not faces:
        raise DataError(f"{file} has {len(vertices)} vertices and {len(faces)} faces")
    return vertices, faces


def _counted(rows: Rows, file: str) -> Surface:
    rows = [(k, words) for k, words in rows if words[0][0] != "#"]
    if not rows:
        raise DataError(f"{file} is empty", allowed="a shape")
    number, words = rows[0]
    counts, rest = _whole(words, number, file), rows[1:]
    vertices = [_numbers(w[-3:], k, file) for k, w in _block(rest, counts[0], file)]
    rest = rest[counts[0] :]
    if len(counts) == 1:
        if not rest:
            raise DataError(f"{file} ends after {counts[0]} vertices", do="get the whole file")
        counts.append(_whole(rest[0][1], rest[0][0], file)[0])
        rest = rest[1:]
    faces = [_whole(w[-3:], k, file) for k, w in _block(rest, counts[1], file)]
    if len(rest) > counts[1]:
        raise _damaged(rest[counts[1]][0], file, f"an end after {counts[1]} plates")
    first = min(min(f) for f in faces)
    return vertices, [[c - min(first, 1) for c in face] for face in faces]


def _block(rows: Rows, count: int, file: str) -> Rows:
    if count < 4 or len(rows) < count:
        raise DataError(
            f"{file} states {count} rows and has {len(rows)} left",
            allowed="four or more vertices and plates, all of them there",
            do="get the whole file",
        )
    for number, words in rows[:count]:
        if len(words) not in (3, 4):
            raise _damaged(number, file, "three numbers, with or without the row's own before them")
    return rows[:count]


def _numbers(words: list[str], number: int, file: str) -> list[float]:
    try:
        return [float(w) for w in words]
    except ValueError as exc:
        raise _damaged(number, file, "numbers") from exc


def _whole(words: list[str], number: int, file: str) -> list[int]:
    try:
        return [int(w) for w in words]
    except ValueError as exc:
        raise _damaged(number, file, "whole numbers") from exc


def _damaged(number: int, file: str, allowed: str) -> DataError:
    return DataError(f"{file}, line {number} is not part of a shape", allowed=allowed)
