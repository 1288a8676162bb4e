"""Places inside a body on a cubic lattice: where a field may have its masses."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.physics.built_in_shapes import built_in_shape
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.polyhedron_sums import polyhedron_gravity

__all__ = ["ellipsoid_lattice", "mesh_lattice", "shape_lattice"]

#: Of the mesh that decides what is inside a built-in shape: its faces lie within the shape.
_DETAIL = 8


def mesh_lattice(mesh: Mesh, count: int) -> Array:
    """Return about ``count`` places (m, 3) inside a mesh, of equal volume, units of the mesh.

    Raises
    ------
    DataError
        If the mesh is so thin that fewer than four lattice points are inside.
    """
    grid = _grid(mesh.vertices.min(axis=0), mesh.vertices.max(axis=0), mesh.volume, count)
    inside: Array = grid[polyhedron_gravity(mesh, grid, 1.0).inside]
    if len(inside) < 4:
        raise DataError(
            f"{mesh.name}: {len(inside)} lattice points of {count} wanted lie inside",
            allowed="4 or more",
            do="ask for more",
        )
    return inside


def ellipsoid_lattice(axes: tuple[float, float, float], count: int) -> Array:
    """Return about ``count`` places (m, 3) inside an ellipsoid with semi-axes along x, y, z.

    Examples
    --------
    >>> ellipsoid_lattice((0.8, 0.6, 0.5), 200).shape
    (192, 3)
    """
    half = np.array(axes, dtype=np.float64)
    if half.shape != (3,) or not (np.isfinite(half).all() and (half > 0).all()):
        raise ConfigError(f"semi-axes are {axes}", allowed="three lengths > 0")
    grid = _grid(-half, half, 4.0 / 3.0 * np.pi * float(half.prod()), count)
    inside: Array = grid[((grid / half) ** 2).sum(axis=1) < 1.0]
    return inside


@lru_cache(maxsize=16)
def shape_lattice(shape: str, radius: float, count: int) -> Array:
    """Return about ``count`` places (m, 3) inside a built-in shape; see `built_in_shape`."""
    places = mesh_lattice(built_in_shape(shape, radius, _DETAIL), count)
    places.flags.writeable = False
    return places


def _grid(low: Array, high: Array, volume: float, count: int) -> Array:
    """Cubic lattice of a box, symmetric about its middle, one cell for each share of the volume."""
    if isinstance(count, bool) or not isinstance(count, int) or count < 8:
        raise ConfigError(f"{count!r} masses", allowed="a whole number of 8 or more")
    step = (volume / count) ** (1.0 / 3.0)
    lines = []
    for a, b in zip(low, high, strict=True):
        cells = int(np.ceil((b - a) / step))
        lines.append(0.5 * (a + b) + step * (np.arange(cells) - 0.5 * (cells - 1)))
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
