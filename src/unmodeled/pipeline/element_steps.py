"""Steps of orbit states along their Kepler elements instead of straight lines.

A step that leaves the mean motion as it is to first order bends the orbit's size to second order,
and so the phase, by more the longer the orbit is followed. In elements it does not.
"""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array

__all__ = ["step_in_elements"]

#: Share of a step over which elements are differentiated, and of a radius that it is at most.
_SHORT = 1e-4
_NEWTON = 30


def step_in_elements(states: Array, steps: Array, gm: float) -> Array:
    """Return states whose elements moved as the steps say to first order.

    Parameters
    ----------
    states, steps : ndarray (n, 6)
        Position and velocity, inertial axes. States that are not bound, and those whose new
        eccentricity would be 1 or more, are moved straight.
    gm : float
        Of the body.

    Returns
    -------
    ndarray (n, 6)
        ``states + steps`` but for terms of second order in the steps.

    Notes
    -----
    Elements are equinoctial [BrouckeCefola1972], about the plane and the place of each state:
    regular for circles, and for any plane but the one turned over.
    """
    x, v = states[:, :3], states[:, 3:]
    up = np.cross(x, v)
    out = np.linalg.norm(x, axis=1, keepdims=True)
    axes = np.stack([x / out, np.cross(up, x), up], axis=1)
    with np.errstate(all="ignore"):  # states without elements are found by being not finite
        axes[:, 1:] /= np.linalg.norm(axes[:, 1:], axis=2, keepdims=True)
        own, moves = _turned(states, axes), _turned(steps, axes)
        size = np.maximum(
            np.linalg.norm(moves[:, :3], axis=1) / out[:, 0],
            np.linalg.norm(moves[:, 3:], axis=1) / np.linalg.norm(v, axis=1),
        )
        short = _SHORT / np.maximum(1.0, size)[:, None]
        ahead, back = (_elements(own + sign * short * moves, gm) for sign in (1.0, -1.0))
        there = _states(_elements(own, gm) + (ahead - back) / (2.0 * short), gm)
        moved = _turned(there, axes.mT)
    return np.where(np.isfinite(moved).all(axis=1, keepdims=True), moved, states + steps)


def _turned(states: Array, axes: Array) -> Array:
    parts = [(axes @ part[:, :, None])[..., 0] for part in (states[:, :3], states[:, 3:])]
    return np.hstack(parts)


def _plane(p: Array, q: Array) -> tuple[Array, Array]:
    """Return the two axes (n, 3) in the plane whose pole is as far off z as p and q say."""
    whole = 1.0 + p * p + q * q
    f = np.stack([1.0 - p * p + q * q, 2.0 * p * q, -2.0 * p], axis=1) / whole[:, None]
    g = np.stack([2.0 * p * q, 1.0 + p * p - q * q, 2.0 * q], axis=1) / whole[:, None]
    return f, g


def _elements(states: Array, gm: float) -> Array:
    """Return mean motion, h = e sin, k = e cos of the pericentre, p, q and mean longitude."""
    x, v = states[:, :3], states[:, 3:]
    r = np.linalg.norm(x, axis=1)
    axis = 1.0 / (2.0 / r - (v * v).sum(axis=1) / gm)
    up = np.cross(x, v)
    w = up / np.linalg.norm(up, axis=1)[:, None]
    p, q = w[:, 0] / (1.0 + w[:, 2]), -w[:, 1] / (1.0 + w[:, 2])
    f, g = _plane(p, q)
    to_pericentre = np.cross(v, up) / gm - x / r[:, None]
    h, k = (to_pericentre * g).sum(axis=1), (to_pericentre * f).sum(axis=1)
    root = np.sqrt(1.0 - h * h - k * k)
    b = 1.0 / (1.0 + root)
    X, Y = (x * f).sum(axis=1) / axis, (x * g).sum(axis=1) / axis
    cos = k + ((1.0 - k * k * b) * X - h * k * b * Y) / root
    sin = h + ((1.0 - h * h * b) * Y - h * k * b * X) / root
    longitude = np.arctan2(sin, cos) + h * cos - k * sin
    return np.stack([np.sqrt(gm / axis**3), h, k, p, q, longitude], axis=1)


def _states(elements: Array, gm: float) -> Array:
    n, h, k, p, q, longitude = elements.T
    axis = np.cbrt(gm / n**2)
    F = longitude.copy()
    for _ in range(_NEWTON):
        sin, cos = np.sin(F), np.cos(F)
        F = F - (F + h * cos - k * sin - longitude) / (1.0 - h * sin - k * cos)
    sin, cos = np.sin(F), np.cos(F)
    b = 1.0 / (1.0 + np.sqrt(1.0 - h * h - k * k))
    f, g = _plane(p, q)
    across, one, two = h * k * b, 1.0 - h * h * b, 1.0 - k * k * b
    X, Y = one * cos + across * sin - k, two * sin + across * cos - h
    turn = n / (1.0 - h * sin - k * cos)
    U, V = turn * (across * cos - one * sin), turn * (two * cos - across * sin)
    place = axis[:, None] * (X[:, None] * f + Y[:, None] * g)
    rate = axis[:, None] * (U[:, None] * f + V[:, None] * g)
    return np.hstack([place, rate])
