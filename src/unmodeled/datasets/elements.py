"""Keplerian elements and states."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import OrbitError
from unmodeled.core.frames import inertial_from_perifocal

__all__ = ["ELEMENT_NAMES", "kepler_period", "osculating_period", "state_from_elements"]

#: Order of the columns of an element array.
ELEMENT_NAMES = (
    "semi_major_axis",
    "eccentricity",
    "inclination",
    "node",
    "periapsis",
    "true_anomaly",
)


def kepler_period(semi_major_axis: npt.ArrayLike, gm: float) -> Array:
    """Return the Keplerian period, [Neamati2022] Eq. 1, in the units of the arguments."""
    period: Array = 2 * math.pi * np.sqrt(np.asarray(semi_major_axis, dtype=np.float64) ** 3 / gm)
    return period


def state_from_elements(elements: npt.ArrayLike, gm: float) -> Array:
    """Return inertial states of osculating elements.

    Parameters
    ----------
    elements : array_like (n, 6)
        Semi-major axis (length), eccentricity, then inclination, right ascension of the node,
        argument of periapsis and true anomaly in **radians**.
    gm : float
        Gravitational parameter, in the same length unit.

    Returns
    -------
    ndarray (n, 6)
        Position and velocity.

    Raises
    ------
    OrbitError
        If an eccentricity is not in [0, 1) or a semi-major axis is not positive.

    Examples
    --------
    >>> state_from_elements([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]], gm=1.0)
    array([[1., 0., 0., 0., 1., 0.]])
    """
    el = as_array(elements, ("n", 6), "elements")
    a, e, inclination, node, periapsis, nu = el.T
    if np.any((e < 0) | (e >= 1)):
        raise OrbitError(
            f"eccentricity {e[(e < 0) | (e >= 1)][0]:g}",
            allowed="0 <= e < 1",
            do="only bound orbits can be sampled period by period",
        )
    if np.any(a <= 0):
        raise OrbitError(f"semi-major axis {a[a <= 0][0]:g}", allowed="a number > 0")
    p = a * (1 - e**2)
    r = p / (1 + e * np.cos(nu))
    speed = np.sqrt(gm / p)
    zero = np.zeros_like(r)
    position = np.stack([r * np.cos(nu), r * np.sin(nu), zero], axis=1)
    velocity = np.stack([-speed * np.sin(nu), speed * (e + np.cos(nu)), zero], axis=1)
    turn = inertial_from_perifocal(inclination, node, periapsis)
    states: Array = np.hstack(
        [np.einsum("nij,nj->ni", turn, position), np.einsum("nij,nj->ni", turn, velocity)]
    )
    return states


def osculating_period(states: npt.ArrayLike, gm: float, label: str = "the orbit") -> float:
    """Return the Keplerian period of the median orbital energy of some states (n, 6).

    Raises
    ------
    OrbitError
        If the orbit is not bound.
    """
    s = as_array(states, ("n", 6), "states")
    energy = float(
        np.median(0.5 * np.sum(s[:, 3:] ** 2, axis=1) - gm / np.linalg.norm(s[:, :3], axis=1))
    )
    if energy >= 0:
        raise OrbitError(
            f"{label} is not bound (median specific energy {energy:.4g})",
            allowed="a closed orbit about the body",
            do="check the body, the units and that velocities are relative to inertial axes",
        )
    return float(kepler_period(-gm / (2 * energy), gm))
