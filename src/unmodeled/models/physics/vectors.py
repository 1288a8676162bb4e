"""Vector algebra on symbols, and the orbit's own axes."""

from __future__ import annotations

from collections.abc import Sequence

from heyoka import expression, sqrt

from unmodeled.models.physics.effect import Vector

__all__ = ["combine", "cross", "dot", "norm", "rtn_axes"]


def dot(a: Vector, b: Vector) -> expression:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm(a: Vector) -> expression:
    """Return the length of a."""
    return sqrt(dot(a, a))


def combine(factors: Sequence[expression], vectors: Sequence[Vector]) -> Vector:
    """Return the sum of factor times vector."""
    x, y, z = (
        sum((f * v[k] for f, v in zip(factors[1:], vectors[1:], strict=True)), factors[0] * v0)
        for k, v0 in enumerate(vectors[0])
    )
    return x, y, z


def rtn_axes(position: Vector, velocity: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the unit vectors radial, transverse, normal.

    R is along the position, N along position x velocity, T = N x R completes the right-handed
    frame: it lies in the orbit plane, on the side of the velocity, and is along the velocity only
    where the radial velocity is zero. There is no such frame on a straight line through the
    centre.
    """
    h = cross(position, velocity)
    one = expression(1.0)
    radial = combine([one / norm(position)], [position])
    normal = combine([one / norm(h)], [h])
    return radial, cross(normal, radial), normal
