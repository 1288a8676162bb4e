"""Two closed shapes made by formula: meshes for truths that need no data file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.physics.mesh import Mesh

__all__ = ["bennu_like", "eros_like", "geodesic_sphere", "write_obj"]

#: Cuts of an icosahedron's faces: 20 x 4^3 = 1,280 faces.
_CUTS = 3


def geodesic_sphere(cuts: int = _CUTS) -> Mesh:
    """Return the unit sphere as an icosahedron whose faces are cut in four, ``cuts`` times."""
    g = (1 + np.sqrt(5)) / 2
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)]
    corners += [(c, a, b) for a, b, c in corners] + [(b, c, a) for a, b, c in corners]
    points = np.array(corners, dtype=float)
    points /= np.linalg.norm(points, axis=1)[:, None]
    near = np.linalg.norm(points[:, None] - points[None], axis=2) < 1.1  # edges are 1.0515 long
    faces = [
        (i, j, k) if np.linalg.det(points[[i, j, k]]) > 0 else (i, k, j)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    vertices = list(points)
    for _ in range(cuts):
        middle: dict[tuple[int, int], int] = {}

        def halfway(a: int, b: int, middle: dict[tuple[int, int], int] = middle) -> int:
            key = (min(a, b), max(a, b))
            if key not in middle:
                point = vertices[a] + vertices[b]
                vertices.append(point / np.linalg.norm(point))
                middle[key] = len(vertices) - 1
            return middle[key]

        cut = []
        for a, b, c in faces:
            ab, bc, ca = halfway(a, b), halfway(b, c), halfway(c, a)
            cut += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = cut
    return Mesh(np.array(vertices), np.array(faces), "sphere")


def eros_like(cuts: int = _CUTS) -> Mesh:
    """Return a bent spindle, 3.1 times as long as thick; farthest point at 1 from the centroid."""

    def shape(u: Array) -> Array:
        x, y, z = u.T
        # The bend and the thicker end are those of a banana; no axis of symmetry is left.
        return np.stack(
            [1.0 * x, (0.32 + 0.04 * x) * y - 0.12 * x**2, (0.32 - 0.02 * x) * z], axis=1
        )

    return _moulded(shape, "eros-like", cuts)


def bennu_like(cuts: int = _CUTS) -> Mesh:
    """Return a spinning top with an equatorial ridge; farthest point at 1 from the centroid."""

    def shape(u: Array) -> Array:
        x, y, z = u.T
        longitude = np.arctan2(y, x)
        ridge = 0.10 * np.exp(-((z / 0.25) ** 2)) * (1 + 0.25 * np.cos(4 * longitude))
        lumps = 0.03 * x * y + 0.04 * z * x**2 - 0.03 * z
        return u * (0.9 + ridge + lumps)[:, None] * [1.0, 0.97, 0.9]

    return _moulded(shape, "bennu-like", cuts)


def _moulded(shape: Callable[[Array], Array], name: str, cuts: int) -> Mesh:
    sphere = geodesic_sphere(cuts)
    mesh = Mesh(shape(sphere.vertices), sphere.faces, name)
    centred = mesh.vertices - mesh.centroid
    return Mesh(centred / np.linalg.norm(centred, axis=1).max(), mesh.faces, name)


def write_obj(mesh: Mesh, path: Path) -> None:
    """Write a mesh as a Wavefront file, 17 digits; the same mesh gives the same bytes."""
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in mesh.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
