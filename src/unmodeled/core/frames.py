r"""Rotations with the direction in their name.

Every function ``b_from_a`` returns matrices that turn the *components* of a vector in frame ``a``
into its components in frame ``b``: ``v_b = b_from_a @ v_a``.  Frames:

inertial
    Axes fixed in space, origin at the body's centre of mass. For a body card, z along its pole
    and x along the ascending node of its equator on the reference plane.
body_fixed
    Turns with the body about z.
perifocal
    x to the periapsis, z along the orbital angular momentum.
rtn
    Radial, transverse (along-track), normal, from a state.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError

__all__ = [
    "body_fixed_from_inertial",
    "inertial_from_perifocal",
    "rotation_about_x",
    "rotation_about_z",
    "rtn_from_inertial",
    "turned",
]


def rotation_about_z(angle: npt.ArrayLike) -> Array:
    """Components in axes turned by ``angle`` (rad) about z; shape (..., 3, 3).

    Examples
    --------
    >>> np.round(rotation_about_z(np.pi / 2) @ [1.0, 0.0, 0.0], 12) + 0.0
    array([ 0., -1.,  0.])
    """
    c, s = np.cos(angle), np.sin(angle)
    zero, one = np.zeros_like(c), np.ones_like(c)
    return _stack([[c, s, zero], [-s, c, zero], [zero, zero, one]])


def rotation_about_x(angle: npt.ArrayLike) -> Array:
    """Components in axes turned by ``angle`` (rad) about x; shape (..., 3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    zero, one = np.zeros_like(c), np.ones_like(c)
    return _stack([[one, zero, zero], [zero, c, s], [zero, -s, c]])


def body_fixed_from_inertial(times: npt.ArrayLike, rate: float, meridian: float = 0.0) -> Array:
    """Rotation into a body that spins uniformly about z.

    Parameters
    ----------
    times : array_like (n,)
        Seconds since the epoch.
    rate : float
        Spin rate, rad/s; positive is right-handed about z.
    meridian : float
        Angle of the prime meridian from the inertial x axis at the epoch, rad.

    Returns
    -------
    ndarray (n, 3, 3)
    """
    return rotation_about_z(meridian + rate * np.asarray(times, dtype=np.float64))


def inertial_from_perifocal(
    inclination: npt.ArrayLike, node: npt.ArrayLike, periapsis: npt.ArrayLike
) -> Array:
    """Rotation from the perifocal to the inertial frame; angles in rad, shape (..., 3, 3).

    Parameters
    ----------
    inclination, node, periapsis : array_like
        Inclination, right ascension of the ascending node, argument of periapsis.
    """
    perifocal_from_inertial = (
        rotation_about_z(periapsis) @ rotation_about_x(inclination) @ rotation_about_z(node)
    )
    return np.swapaxes(perifocal_from_inertial, -1, -2)


def rtn_from_inertial(states: npt.ArrayLike) -> Array:
    """Rotation to radial, transverse, normal axes of each state.

    Parameters
    ----------
    states : array_like (n, 6)
        Position and velocity in any one inertial frame.

    Returns
    -------
    ndarray (n, 3, 3)
        Rows are the unit vectors R, T, N.

    Raises
    ------
    DataError
        If position and velocity of a state are parallel, or one is zero: no orbital plane.
    """
    s = as_array(states, ("n", 6), "states")
    normal = np.cross(s[:, :3], s[:, 3:])
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    if np.any(size == 0.0):
        raise DataError(
            f"state {int(np.argmin(size))} has no orbital plane",
            allowed="position and velocity that are not parallel",
        )
    normal /= size
    radial = s[:, :3] / np.linalg.norm(s[:, :3], axis=1, keepdims=True)
    return np.stack([radial, np.cross(normal, radial), normal], axis=1)


def turned(matrices: Array, vectors: Array) -> Array:
    """Return the products (n, k) of matrices (n, k, 3) and vectors (n, 3), row by row."""
    product: Array = (matrices @ vectors[:, :, None])[:, :, 0]
    return product


def _stack(rows: list[list[Array]]) -> Array:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
