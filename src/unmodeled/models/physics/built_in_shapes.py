"""Shapes of small bodies by formula: closed meshes for truths and tests that need no data file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.models.physics.mesh import Faces, Mesh

__all__ = ["SHAPE_NAMES", "built_in_shape"]


@lru_cache(maxsize=16)
def built_in_shape(name: str, radius: float = 1.0, detail: int = 16) -> Mesh:
    """Return a shape that resembles a small body without being it.

    ==============  =========================================================================
    eros_like       elongated 1 : 0.36 : 0.33, bent, with a saddle in the middle
    bennu_like      spinning top: ridge at the equator, flattened to 0.93, four-lobed
    comet_like      two tilted ellipsoids of different size that share a neck
    contact_binary  two unequal lobes that touch: a flattened oval of Cassini about x
    ==============  =========================================================================

    Each is a map of the unit sphere, so it is closed and does not cross itself; the sphere is an
    octahedron whose faces are cut into ``detail`` squared triangles. The centroid is the origin;
    principal axes are along x (longest) to z, about which a body spins steadily.

    Parameters
    ----------
    name : str
        Of `SHAPE_NAMES`.
    radius : float
        Distance of the farthest vertex from the centroid, m: the Brillouin radius.
    detail : int
        Cuts of each edge of the octahedron, 2 to 32: 8 detail^2 faces, 2,048 by default.

    Raises
    ------
    ConfigError
        For an unknown name, a radius that is not positive or another detail.

    Examples
    --------
    >>> built_in_shape("comet_like", 2000.0, detail=8)
    Mesh(comet_like: 258 vertices, 512 faces)
    """
    if name not in _MAPS:
        raise ConfigError(
            f'there is no built-in shape "{name}"',
            allowed=", ".join(SHAPE_NAMES),
            do=nearest(name, SHAPE_NAMES),
        )
    if not (np.isfinite(radius) and radius > 0):
        raise ConfigError(f"radius of {name} is {radius} m", allowed="a length > 0")
    if isinstance(detail, bool) or not isinstance(detail, int) or not 2 <= detail <= 32:
        raise ConfigError(f"detail of {name} is {detail!r}", allowed="2 to 32")
    points, faces = _sphere(detail)
    rough = Mesh(_MAPS[name](points), faces, name)
    vertices = _principal(Mesh(rough.vertices - rough.centroid, faces, name))
    farthest = float(np.linalg.norm(vertices, axis=1).max())
    return Mesh(vertices * (radius / farthest), faces, name)


def _sphere(detail: int) -> tuple[Array, Faces]:
    """Octahedron with every edge cut in ``detail``, pushed out to the unit sphere."""
    index: dict[tuple[int, int, int], int] = {}
    faces: list[tuple[int, ...]] = []

    def number(*corner: int) -> int:
        return index.setdefault((corner[0], corner[1], corner[2]), len(index))

    signs = [(a, b, c) for a in (1, -1) for b in (1, -1) for c in (1, -1)]
    for sx, sy, sz in signs:
        for i in range(detail):
            for j in range(detail - i):
                k = detail - i - j
                up = [(i, j, k), (i + 1, j, k - 1), (i, j + 1, k - 1)]
                cells = [up]
                if k > 1:
                    cells.append([(i + 1, j, k - 1), (i + 1, j + 1, k - 2), (i, j + 1, k - 1)])
                for cell in cells:
                    corners = tuple(number(sx * a, sy * b, sz * c) for a, b, c in cell)
                    # A reflection turns the order of the corners round.
                    faces.append(corners if sx * sy * sz > 0 else corners[::-1])
    points = np.array(list(index), dtype=np.float64)
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points, np.array(faces, dtype=np.intp)


def _principal(mesh: Mesh) -> Array:
    """Vertices along the principal axes of the constant density, turned as little as can be."""
    corners = mesh.corners
    total = corners.sum(axis=1)
    # Second moments of the tetrahedron between the origin and a face.
    parts = np.einsum("fki,fkj->fij", corners, corners) + total[:, :, None] * total[:, None, :]
    moments = np.einsum("f,fij->ij", np.linalg.det(corners) / 120.0, parts)
    axes = np.linalg.eigh(moments)[1][:, ::-1]
    axes *= np.where(np.diagonal(axes) < 0.0, -1.0, 1.0)
    axes[:, 1] *= np.sign(np.linalg.det(axes))
    turned: Array = mesh.vertices @ axes
    return turned


def _eros_like(u: Array) -> Array:
    x, y, z = u.T
    # The saddle, and one end thicker than the other.
    waist = (1.0 - 0.22 * np.exp(-((x / 0.3) ** 2))) * (1.0 + 0.12 * x)
    return np.stack([x, 0.36 * waist * y + 0.16 * x * x, 0.33 * waist * z], axis=1)


def _bennu_like(u: Array) -> Array:
    x, y, z = u.T
    round_, longitude = np.hypot(x, y), np.arctan2(y, x)
    # Exponent 1 would be a double cone, 2 an ellipsoid.
    profile = (round_**1.7 + (np.abs(z) / 0.93) ** 1.7) ** (-1.0 / 1.7)
    lobes = 1.0 + round_**4 * (
        0.03 * np.cos(4.0 * longitude)
        + 0.015 * np.cos(2.0 * longitude - 0.7)
        + 0.01 * np.cos(3.0 * longitude + 0.4)
    )
    grown: Array = (profile * lobes * (1.0 + 0.02 * z))[:, None] * u
    return grown


def _comet_like(u: Array) -> Array:
    body = _exit(u, np.array([-0.42, 0.06, -0.05]), (0.62, 0.50, 0.34), 0.15)
    head = _exit(u, np.array([0.40, 0.08, 0.07]), (0.48, 0.38, 0.33), -0.45)
    # A smooth largest of the two: the neck is a groove, not an edge.
    longest = (body**8 + head**8) ** 0.125
    return longest[:, None] * u


def _contact_binary(u: Array) -> Array:
    along = u[:, 0]
    double = 2.0 * along**2 - 1.0  # cosine of twice the angle from x
    square = 0.96 * double + np.sqrt(1.0 - 0.96**2 * (1.0 - double**2))
    # Flattened, so that no two principal axes are alike.
    length: Array = np.sqrt(square) * (1.0 + 0.12 * along)
    grown: Array = length[:, None] * u * np.array([1.0, 1.0, 0.88])
    return grown


def _exit(u: Array, centre: Array, axes: tuple[float, ...], turn: float) -> Array:
    """Distance along ``u`` (n, 3) from the origin out of an ellipsoid, turned about z, round it."""
    c, s = np.cos(turn), np.sin(turn)
    A = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) / np.array(axes)[:, None]
    along, middle = u @ A.T, A @ centre
    a, b, rest = (along**2).sum(axis=1), along @ middle, float(middle @ middle) - 1.0
    out: Array = (b + np.sqrt(b * b - a * rest)) / a
    return out


_MAPS: Mapping[str, Callable[[Array], Array]] = MappingProxyType(
    {
        "eros_like": _eros_like,
        "bennu_like": _bennu_like,
        "comet_like": _comet_like,
        "contact_binary": _contact_binary,
    }
)
#: Names of the built-in shapes.
SHAPE_NAMES = tuple(_MAPS)
