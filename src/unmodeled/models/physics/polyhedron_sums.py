"""Gravity of a homogeneous polyhedron at many points, summed over its edges and faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.models.physics.mesh import Mesh

__all__ = ["EdgesAndFaces", "PolyhedronGravity", "polyhedron_gravity"]

#: Edge and point pairs that are held at once; bounds the memory.
_CHUNK = 2_000_000


@dataclass(frozen=True)
class EdgesAndFaces:
    """What the sums need of a mesh, once.

    Parameters
    ----------
    start, end : ndarray (e, 3)
        Ends of each edge, m.
    length : ndarray (e,)
        Of each edge, m.
    edge_dyads : ndarray (e, 3, 3)
        Normal of either face times the outward normal of the edge in it, summed.
    corners : ndarray (m, 3, 3)
        Corners of each face, m.
    face_dyads : ndarray (m, 3, 3)
        Normal of each face times itself.
    """

    start: Array
    end: Array
    length: Array
    edge_dyads: Array
    corners: Array
    face_dyads: Array

    @classmethod
    def of(cls, mesh: Mesh) -> EdgesAndFaces:
        """Return the edges and faces of a mesh."""
        corners = mesh.corners
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        edges = mesh.edges
        start, end = mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]]
        length = np.linalg.norm(end - start, axis=1)
        along = (end - start) / length[:, None]
        # The edge runs with its first face and against its second.
        one, two = normals[edges[:, 2]], normals[edges[:, 3]]
        dyads = one[:, :, None] * np.cross(along, one)[:, None, :]
        dyads -= two[:, :, None] * np.cross(along, two)[:, None, :]
        return cls(start, end, length, dyads, corners, normals[:, :, None] * normals[:, None, :])


@dataclass(frozen=True)
class PolyhedronGravity:
    """Field at n points.

    Parameters
    ----------
    potential : ndarray (n,)
        Force function U, acceleration = +grad U, m2/s2.
    acceleration : ndarray (n, 3)
        m/s2, body axes.
    gradient : ndarray (n, 3, 3)
        d acceleration / d position, 1/s2.
    solid_angle : ndarray (n,)
        Of the surface as seen from the point, rad2: 4 pi inside, 0 outside, between on it. The
        Laplacian of U is - G density times it.
    """

    potential: Array
    acceleration: Array
    gradient: Array
    solid_angle: Array

    @property
    def inside(self) -> npt.NDArray[np.bool_]:
        """Which points lie inside the body, (n,)."""
        answer: npt.NDArray[np.bool_] = self.solid_angle > 2.0 * np.pi
        return answer


def polyhedron_gravity(mesh: Mesh, points: npt.ArrayLike, gm: float) -> PolyhedronGravity:
    r"""Return the field of a polyhedron of constant density, inside and outside.

    .. math::
        U = \frac{G\rho}{2} \Big(\sum_e \mathbf r_e \cdot E_e \mathbf r_e\, L_e
        - \sum_f \mathbf r_f \cdot F_f \mathbf r_f\, \omega_f\Big), \quad
        \mathbf a = -G\rho \Big(\sum_e E_e \mathbf r_e L_e - \sum_f F_f \mathbf r_f \omega_f\Big),
        \quad \nabla^2 U = -G\rho \sum_f \omega_f

    Source: [Werner1997] Eq. 10, 15-17; logarithm and solid angle as there.

    Parameters
    ----------
    mesh : Mesh
        The body.
    points : array_like (n, 3)
        Body axes, m. On an edge the logarithm has no value; on a face the field is that of the
        limit.
    gm : float
        Gravitational parameter of the body, m3/s2: density = gm / (G volume).
    """
    x = as_array(points, ("n", 3), "points")
    parts, rate = EdgesAndFaces.of(mesh), gm / mesh.volume
    size = max(1, _CHUNK // len(parts.length))
    pieces = [_sums(parts, x[k : k + size]) for k in range(0, len(x), size)]
    u, a, g, angle = (np.concatenate(p) for p in zip(*pieces, strict=True))
    return PolyhedronGravity(0.5 * rate * u, -rate * a, rate * g, angle)


def _sums(parts: EdgesAndFaces, x: Array) -> tuple[Array, Array, Array, Array]:
    r1, r2 = parts.start - x[:, None], parts.end - x[:, None]
    total = np.linalg.norm(r1, axis=2) + np.linalg.norm(r2, axis=2)
    log = np.log((total + parts.length) / (total - parts.length))
    by_edge = np.einsum("eij,nej->nei", parts.edge_dyads, r1)
    corners = parts.corners - x[:, None, None]
    a, b, c = corners[:, :, 0], corners[:, :, 1], corners[:, :, 2]
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    over = np.einsum("nfi,nfi->nf", a, np.cross(b, c))
    under = la * lb * lc
    for one, two, size in ((a, b, lc), (b, c, la), (c, a, lb)):
        under = under + np.einsum("nfi,nfi->nf", one, two) * size
    omega = 2.0 * np.arctan2(over, under)
    by_face = np.einsum("fij,nfj->nfi", parts.face_dyads, a)
    u = np.einsum("nei,nei,ne->n", r1, by_edge, log) - np.einsum("nfi,nfi,nf->n", a, by_face, omega)
    push = np.einsum("nei,ne->ni", by_edge, log) - np.einsum("nfi,nf->ni", by_face, omega)
    gradient = np.einsum("eij,ne->nij", parts.edge_dyads, log)
    gradient = gradient - np.einsum("fij,nf->nij", parts.face_dyads, omega)
    return u, push, gradient, omega.sum(axis=1)
