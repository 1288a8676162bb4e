"""State of one spacecraft as seen from another, in the other's turning axes.

The axes are radial, transverse (along-track), normal of the *target*: RTN, also called local
vertical local horizontal (LVLH). Their origin moves with the target and they turn with it, so
velocities and accelerations are those that an observer who turns along would see.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.frames import rtn_from_inertial

__all__ = ["inertial_from_relative", "relative_acceleration", "relative_from_inertial"]


def relative_from_inertial(
    target: npt.ArrayLike, chaser: npt.ArrayLike, target_acceleration: npt.ArrayLike | None = None
) -> Array:
    """Return the chaser's state in the target's RTN axes.

    Parameters
    ----------
    target, chaser : array_like (n, 6)
        Position and velocity in one inertial frame (EME2000, ICRF), m and m/s.
    target_acceleration : array_like (n, 3), optional
        Of the target, inertial, m/s2. With it the velocity is the exact rate of change of the RTN
        components; without, that seen from axes of the osculating orbit.

    Returns
    -------
    ndarray (n, 6)
        Chaser minus target: radial, transverse, normal, and their rates of change.

    Raises
    ------
    DataError
        If a target state has no orbital plane.

    Notes
    -----
    [Marchese2023] Eq. 3.7 and 3.8. The axes turn with h / r^2 about the normal and, where a force
    has a component a_N out of the plane, with r a_N / h about the radius. J2 makes the second part
    4e-7 rad/s in low Earth orbit: 4e-6 m/s at 10 m, which a filter with good velocities sees.

    Examples
    --------
    >>> relative_from_inertial([[1.0, 0, 0, 0, 1, 0]], [[1.0, 0.5, 0, 0, 1, 0]])
    array([[0. , 0.5, 0. , 0.5, 0. , 0. ]])
    """
    a = as_array(target, ("n", 6), "target")
    b = as_array(chaser, ("n", 6), "chaser")
    turn = rtn_from_inertial(a)
    omega = _axes_rate(a, target_acceleration)
    position = b[:, :3] - a[:, :3]
    velocity = b[:, 3:] - a[:, 3:] - np.cross(omega, position)
    return np.hstack([_apply(turn, position), _apply(turn, velocity)])


def inertial_from_relative(
    target: npt.ArrayLike,
    relative: npt.ArrayLike,
    target_acceleration: npt.ArrayLike | None = None,
) -> Array:
    """Return the chaser's inertial state (n, 6); the inverse of `relative_from_inertial`.

    Parameters
    ----------
    target : array_like (n, 6)
        Inertial state of the target, m and m/s.
    relative : array_like (n, 6)
        Chaser minus target in the target's RTN axes.
    target_acceleration : array_like (n, 3), optional
        As given there.
    """
    a = as_array(target, ("n", 6), "target")
    s = as_array(relative, ("n", 6), "relative")
    back = np.swapaxes(rtn_from_inertial(a), 1, 2)
    position = _apply(back, s[:, :3])
    velocity = _apply(back, s[:, 3:]) + np.cross(_axes_rate(a, target_acceleration), position)
    return a + np.hstack([position, velocity])


def relative_acceleration(
    target: npt.ArrayLike,
    chaser: npt.ArrayLike,
    target_acceleration: npt.ArrayLike,
    chaser_acceleration: npt.ArrayLike,
) -> Array:
    r"""Return the chaser's acceleration in the target's turning axes.

    .. math::
        \mathbf a_{rel} = \mathbf a_B - \mathbf a_A - \dot{\boldsymbol\Omega}\times\mathbf r
        - \boldsymbol\Omega\times(\boldsymbol\Omega\times\mathbf r)
        - 2\,\boldsymbol\Omega\times\mathbf v_{rel}

    Parameters
    ----------
    target, chaser : array_like (n, 6)
        Inertial states, m and m/s.
    target_acceleration, chaser_acceleration : array_like (n, 3)
        Inertial, m/s2.

    Returns
    -------
    ndarray (n, 3)
        RTN components, m/s2.

    Notes
    -----
    [Marchese2023] Eq. 3.9 to 3.11. Omega = r x v / r^2 is that of the osculating orbit, as in
    `relative_from_inertial` without the target's acceleration; its rate is exact.
    """
    a, b = (as_array(s, ("n", 6), name) for s, name in ((target, "target"), (chaser, "chaser")))
    pull = as_array(target_acceleration, ("n", 3), "target acceleration")
    other = as_array(chaser_acceleration, ("n", 3), "chaser acceleration")
    omega = _orbital_rate(a)
    r2 = (a[:, :3] ** 2).sum(axis=1)[:, None]
    radial_speed = (a[:, :3] * a[:, 3:]).sum(axis=1)[:, None]
    rate = np.cross(a[:, :3], pull) / r2 - 2.0 * radial_speed / r2 * omega
    position = b[:, :3] - a[:, :3]
    velocity = b[:, 3:] - a[:, 3:] - np.cross(omega, position)
    found = (
        other
        - pull
        - np.cross(rate, position)
        - np.cross(omega, np.cross(omega, position))
        - 2.0 * np.cross(omega, velocity)
    )
    return _apply(rtn_from_inertial(a), found)


def _orbital_rate(states: Array) -> Array:
    """Angular velocity of the radius, h / r^2 (n, 3)."""
    h = np.cross(states[:, :3], states[:, 3:])
    rate: Array = h / (states[:, :3] ** 2).sum(axis=1)[:, None]
    return rate


def _axes_rate(states: Array, acceleration: npt.ArrayLike | None) -> Array:
    """Angular velocity of the RTN axes (n, 3)."""
    if acceleration is None:
        return _orbital_rate(states)
    pull = as_array(acceleration, (len(states), 3), "target acceleration")
    h = np.cross(states[:, :3], states[:, 3:])
    out_of_plane = (pull * h).sum(axis=1) / (h * h).sum(axis=1)
    rate: Array = _orbital_rate(states) + out_of_plane[:, None] * states[:, :3]
    return rate


def _apply(turn: Array, vectors: Array) -> Array:
    turned: Array = np.einsum("nij,nj->ni", turn, vectors)
    return turned
