"""A closed surface of triangles: the shape of a small body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError

__all__ = ["Mesh"]

Faces = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A polyhedron with triangular faces in body axes; equal meshes compare equal.

    Parameters
    ----------
    vertices : ndarray (n, 3)
        Metres.
    faces : ndarray of int (m, 3)
        Rows of ``vertices``, counted from 0, counter-clockwise as seen from outside.
    name : str
        For error texts and reports; no part of the comparison.
    unit : float
        Length of the unit of the file that it came from, m; no part of the comparison.

    Raises
    ------
    DataError
        If a face names no vertex or one twice, the surface is not closed, two faces run along
        an edge in the same direction, or the normals point inwards.

    Examples
    --------
    >>> Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...      [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).volume
    0.16666666666666666
    """

    vertices: Array
    faces: Faces
    name: str = "mesh"
    unit: float = 1.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        vertices = as_array(self.vertices, ("n", 3), f"{self.name}: vertices").copy()
        faces = np.asarray(self.faces)
        if faces.ndim != 2 or faces.shape[1:] != (3,) or not np.issubdtype(faces.dtype, np.integer):
            raise DataError(
                f"{self.name}: faces have shape {faces.shape}", allowed="whole numbers (m, 3)"
            )
        faces = faces.astype(np.intp)
        if len(faces) < 4 or faces.min() < 0 or faces.max() >= len(vertices):
            raise DataError(
                f"{self.name}: {len(faces)} faces of {len(vertices)} vertices",
                allowed="four faces or more, of vertices that exist",
            )
        vertices.flags.writeable = faces.flags.writeable = False
        put(self, "vertices", vertices)
        put(self, "faces", faces)
        self._check_closed()
        put(self, "_key", (vertices.tobytes(), faces.tobytes()))
        if not self.volume > 0:
            raise DataError(
                f"{self.name}: the volume is {self.volume:.6g} m3",
                allowed="faces counter-clockwise as seen from outside",
                do="turn the order of the vertices of every face",
            )

    def _check_closed(self) -> None:
        edges = np.concatenate(
            [self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]]
        )
        if np.any(edges[:, 0] == edges[:, 1]):
            raise DataError(f"{self.name}: a face has a vertex twice", do="drop the empty faces")
        there, count = np.unique(edges, axis=0, return_counts=True)
        back = np.unique(edges[:, ::-1], axis=0)
        if count.max() > 1 or len(there) != len(back) or np.any(there != back):
            raise DataError(
                f"{self.name}: the surface is not closed, or neighbouring faces run opposite ways",
                allowed="every edge in two faces, once each way",
                do="repair the mesh",
            )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mesh) and self._key == other._key  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash(self._key)  # type: ignore[attr-defined]

    def __repr__(self) -> str:
        return f"Mesh({self.name}: {len(self.vertices)} vertices, {len(self.faces)} faces)"

    @property
    def corners(self) -> Array:
        """Corners (m, 3 corners, 3 components) of every face, m."""
        found: Array = self.vertices[self.faces]
        return found

    @property
    def volume(self) -> float:
        """Volume, m3."""
        return float(np.sum(np.linalg.det(self.corners)) / 6.0)

    @property
    def centroid(self) -> Array:
        """Centre of mass for constant density, (3,) m."""
        parts = np.linalg.det(self.corners) / 6.0
        centre: Array = parts @ self.corners.sum(axis=1) / 4.0 / parts.sum()
        return centre

    @property
    def brillouin_radius(self) -> float:
        """Distance of the farthest vertex from the origin, m."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    @property
    def edges(self) -> Faces:
        """Each edge once: its two vertices and the two faces beside it, (e, 4)."""
        sides = ((0, 1), (1, 2), (2, 0))
        found = np.concatenate([self.faces[:, list(s)] for s in sides])
        face = np.tile(np.arange(len(self.faces)), 3)
        owner = {(int(a), int(b)): int(f) for (a, b), f in zip(found, face, strict=True)}
        rows = [(a, b, f, owner[b, a]) for (a, b), f in owner.items() if a < b]
        return np.array(rows, dtype=np.intp)
