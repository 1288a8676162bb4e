"""Small meshes for tests; real ones never enter the repository."""

import itertools

import numpy as np

from unmodeled.models.physics import Mesh


def cube(half=1.0):
    """Cube about the origin, each side two triangles."""
    vertices = half * np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Mesh(vertices, np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]))


def sphere(rounds):
    """An octahedron, every face cut in four ``rounds`` times and pushed out to radius 1."""
    points = [np.array(p, dtype=float) for p in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    points += [-p for p in points]
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    for _ in range(rounds):
        middle, finer = {}, []

        def between(a, b, middle=middle):
            key = frozenset((a, b))
            if key not in middle:
                point = points[a] + points[b]
                points.append(point / np.linalg.norm(point))
                middle[key] = len(points) - 1
            return middle[key]

        for a, b, c in faces:
            ab, bc, ca = between(a, b), between(b, c), between(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    return np.array(points), np.array(faces)


def ellipsoid_mesh(axes, rounds=3):
    """A mesh whose vertices lie on an ellipsoid."""
    points, faces = sphere(rounds)
    return Mesh(points * np.array(axes), faces, "ellipsoid")
