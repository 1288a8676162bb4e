"""A point that is carried along radial, transverse and normal axes, and how it moves."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.datasets.measurement_geometry import cross_matrix

__all__ = ["antenna_columns", "antenna_jacobian"]


def antenna_columns(states: Array) -> Array:
    """Return d state of the antenna / d its offset (m, along R, T, N), (n, 6, 3).

    The axes turn about the normal at the rate h / r^2; that they also nod, by as much as forces
    across the orbit turn its plane (a thousandth of that near the Earth), is left out.
    """
    axes = np.swapaxes(rtn_from_inertial(states), 1, 2)
    r, v = states[:, :3], states[:, 3:]
    spin = np.cross(r, v) / np.sum(r * r, axis=1, keepdims=True)
    return np.concatenate([axes, cross_matrix(spin) @ axes], axis=1)


def antenna_jacobian(offset: npt.ArrayLike, states: Array) -> Array:
    """Return d state of the antenna / d state of the centre of mass, (n, 6, 6)."""
    across = np.asarray(offset, dtype=np.float64)
    r, v = states[:, :3], states[:, 3:]
    radial, _, normal = np.moveaxis(rtn_from_inertial(states), 1, 0)
    h, size = np.cross(r, v), np.linalg.norm(r, axis=1)[:, None, None]
    unit, zero = np.broadcast_to(np.eye(3), (len(states), 3, 3)), np.zeros((len(states), 3, 3))
    by_h = np.concatenate([-cross_matrix(v), cross_matrix(r)], axis=2)  # d h / d state
    at = np.concatenate([unit, zero], axis=2)
    d_radial = (unit - radial[:, :, None] * radial[:, None]) / size @ at
    length = np.linalg.norm(h, axis=1)[:, None, None]
    d_normal = (unit - normal[:, :, None] * normal[:, None]) / length @ by_h
    d_transverse = cross_matrix(normal) @ d_radial - cross_matrix(radial) @ d_normal
    moved = across[0] * d_radial + across[1] * d_transverse + across[2] * d_normal
    place = (antenna_columns(states) @ across)[:, :3]
    spin = h / size[:, 0] ** 2
    d_spin = by_h / size**2 - 2.0 * h[:, :, None] * (r[:, None] @ at) / size**4
    carried = cross_matrix(spin) @ moved - cross_matrix(place) @ d_spin
    out: Array = np.eye(6) + np.concatenate([moved, carried], axis=1)
    return out
