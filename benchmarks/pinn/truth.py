"""The true field of the protocol: Eros with two hidden masses, and where it is looked at."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError
from unmodeled.core.seeds import Streams
from unmodeled.datasets.shape_file import read_shape
from unmodeled.models.physics import Dynamics, PointMass, Polyhedron
from unmodeled.models.physics.built_in_shapes import built_in_shape
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.polyhedron_sums import polyhedron_gravity
from unmodeled.pipeline.field_metrics import plane_points, shell_points

__all__ = ["Truth", "eros_mesh", "observations", "test_points"]

#: Reference radius (m) and gravitational parameter (m3/s2) of Eros in the protocol; its volume.
RADIUS, GM, VOLUME = 16_000.0, 4.4631e5, 2.503e12
#: Share of GM of the hidden masses, and their places, in radii.
SHARE, PLACES = 0.1, (0.5, -0.5)
#: Turns a day of the flight.
SPIN_RATE = 10 * 2 * np.pi / 86_400.0
# Closer than this (radii) the closed form is summed; beyond, the series to degree 24 is exact to
# 1e-9: (1.1 / 2.5)^24.
_NEAR, _DEGREE = 2.5, 24


def eros_mesh() -> tuple[Mesh, str]:
    """Return the shape, m, about its centroid, with its volume, and where it is from.

    The mesh of the folder that UNMODELED_DATA names (``shapes/eros_lp.obj``), or a made-up one.
    """
    folder = os.environ.get("UNMODELED_DATA", "")
    path = Path(folder) / "shapes" / "eros_lp.obj"
    if folder and path.exists():
        mesh, source = read_shape(path, 1.0), "Eros (NEAR shape, decimated)"
    else:
        mesh, source = built_in_shape("eros_like"), "eros_like (built-in shape)"
    size = (VOLUME / mesh.volume) ** (1 / 3)
    return Mesh((mesh.vertices - mesh.centroid) * size, mesh.faces, "eros"), source


@dataclass(frozen=True)
class Truth:
    """Homogeneous polyhedron with two hidden masses, +0.1 GM at +R/2 and -0.1 GM at -R/2 on x.

    Parameters
    ----------
    mesh : Mesh
        m, body axes, origin at the centroid.
    """

    mesh: Mesh

    @cached_property
    def _series(self) -> Dynamics:
        return Dynamics([PointMass(), Polyhedron(self.mesh, _DEGREE)], {"GM": GM})

    def acceleration(self, points: Array) -> Array:
        """Return m/s2 at points (n, 3), m, body axes."""
        near = np.linalg.norm(points, axis=1) < _NEAR * RADIUS
        found = np.empty_like(points)
        if near.any():
            found[near] = polyhedron_gravity(self.mesh, points[near], GM).acceleration
        if not near.all():
            found[~near] = self._series.acceleration(points[~near])
        for sign, place in zip((1.0, -1.0), PLACES, strict=True):
            away = points - np.array([place * RADIUS, 0.0, 0.0])
            found -= sign * SHARE * GM * away / np.linalg.norm(away, axis=1)[:, None] ** 3
        return found

    def inside(self, points: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which points lie inside the body."""
        answer = np.zeros(len(points), dtype=bool)
        near = np.linalg.norm(points, axis=1) <= self.mesh.brillouin_radius
        if near.any():
            answer[near] = polyhedron_gravity(self.mesh, points[near], GM).inside
        return answer


def outside_points(truth: Truth, inner: float, outer: float, count: int, name: str) -> Array:
    """Return points between two radii (in R), radii uniform, none inside the body."""
    kept = np.empty((0, 3))
    for attempt in range(60):
        drawn = shell_points(
            inner * RADIUS, outer * RADIUS, count, Streams(7), f"pinn.{name}.{attempt}"
        )
        kept = np.concatenate([kept, drawn[~truth.inside(drawn)]])
        if len(kept) >= count:
            return kept[:count]
    raise DataError(f"no {count} points outside the body between {inner} and {outer} R")


def observations(
    truth: Truth, count: int, noise: float, outer: float = 10.0
) -> tuple[Array, Array]:
    """Return training positions and observed accelerations.

    The noise has a fixed length, a share of that of the acceleration, and a direction drawn from a
    cube, as the protocol's code has it: neither Gaussian nor isotropic.

    Parameters
    ----------
    truth : Truth
    count : int
    noise : float
        Share, e.g. 0.1.
    outer : float
        Largest radius, R.
    """
    x = outside_points(truth, 0.0, outer, count, "train")
    a = truth.acceleration(x)
    direction = Streams(7).generator("pinn.noise").uniform(-1.0, 1.0, a.shape)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return x, a + noise * np.linalg.norm(a, axis=1)[:, None] * direction


def test_points(truth: Truth, planes: int, count: int) -> dict[str, Array]:
    """Return the points of each region, m.

    Parameters
    ----------
    truth : Truth
    planes : int
        Points on an axis of each plane; the protocol has 200.
    count : int
        Points of each shell.
    """
    on_planes = plane_points(3 * RADIUS, planes)
    centres = truth.mesh.corners.mean(axis=1)
    return {
        "planes": on_planes[~truth.inside(on_planes)],
        "interior": outside_points(truth, 0.0, 1.0, count, "interior"),
        "exterior": outside_points(truth, 1.0, 10.0, count, "exterior"),
        "extrapolation": outside_points(truth, 10.0, 100.0, count, "extrapolation"),
        # A hair above the facets, outside for certain.
        "surface": centres * (1 + 1e-6),
    }
