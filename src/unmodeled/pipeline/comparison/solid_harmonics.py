"""Accelerations of single terms of a potential outside or inside its sources."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array

__all__ = ["outer_gradients", "surface_harmonics", "tidal_gradients"]


def outer_gradients(positions: Array, degree: int, radius: float, lowest: int = 1) -> Array:
    """Return gradients of the terms of degree ``lowest`` to ``degree`` of an outer potential.

    Parameters
    ----------
    positions : ndarray (n, 3)
        Body axes, m.
    degree, lowest : int
        At least 1, and at most ``degree``.
    radius : float
        R of the series, m.

    Returns
    -------
    ndarray (n, 3, p)
        Of (R/r)^(n+1) P_nm(sin lat) cos m lon and sin m lon, m = 0 ... n; p = sum of 2 n + 1.

    Notes
    -----
    Recursions and derivatives of [MontenbruckGill2000] Eq. 3.29, 3.30 and 3.33.
    """
    v, w = _recursion(positions, degree + 1, radius)
    parts = []
    for n in range(lowest, degree + 1):
        for m in range(n + 1):
            for c, s in ((1.0, 0.0), (0.0, 1.0)) if m else ((1.0, 0.0),):
                parts.append(_gradient(v, w, n, m, c, s))
    return np.stack(parts, axis=2) / radius


def tidal_gradients(positions: Array, size: float) -> Array:
    """Return gradients of the five inner terms of degree 2: the pull of a body far away.

    Parameters
    ----------
    positions : ndarray (n, 3)
        m.
    size : float
        Length that makes them dimensionless, m.
    """
    x, y, z = positions.T / size
    nil = np.zeros_like(x)
    parts = [(-x, -y, 2 * z), (x, -y, nil), (y, x, nil), (z, nil, x), (nil, z, y)]
    return np.stack([np.stack(p, axis=1) for p in parts], axis=2)


def surface_harmonics(directions: Array, degree: int) -> Array:
    """Return the real harmonics of degree 0 to ``degree`` of unit vectors (n, 3), (n, q)."""
    v, w = _recursion(directions, degree, 1.0)
    parts = []
    for n in range(degree + 1):
        parts += [v[n][m] for m in range(n + 1)] + [w[n][m] for m in range(1, n + 1)]
    return np.stack(parts, axis=1)


def _recursion(positions: Array, degree: int, radius: float) -> tuple[list[Array], list[Array]]:
    r2 = np.sum(positions**2, axis=1)
    x, y, z = (positions * radius).T / r2
    rho = radius**2 / r2
    v = [np.zeros((n + 1, len(r2))) for n in range(degree + 1)]
    w = [np.zeros((n + 1, len(r2))) for n in range(degree + 1)]
    v[0][0] = radius / np.sqrt(r2)
    for n in range(1, degree + 1):
        v[n][n] = (2 * n - 1) * (x * v[n - 1][n - 1] - y * w[n - 1][n - 1])
        w[n][n] = (2 * n - 1) * (x * w[n - 1][n - 1] + y * v[n - 1][n - 1])
        for m in range(n):
            v[n][m] = (2 * n - 1) / (n - m) * z * v[n - 1][m]
            w[n][m] = (2 * n - 1) / (n - m) * z * w[n - 1][m]
            if n - 2 >= m:
                v[n][m] -= (n + m - 1) / (n - m) * rho * v[n - 2][m]
                w[n][m] -= (n + m - 1) / (n - m) * rho * w[n - 2][m]
    return v, w


def _gradient(v: list[Array], w: list[Array], n: int, m: int, c: float, s: float) -> Array:
    up_v, up_w = v[n + 1], w[n + 1]
    if m == 0:
        x, y = -c * up_v[1], -c * up_w[1]
    else:
        f = (n - m + 2) * (n - m + 1)
        x = 0.5 * (-c * up_v[m + 1] - s * up_w[m + 1] + f * (c * up_v[m - 1] + s * up_w[m - 1]))
        y = 0.5 * (-c * up_w[m + 1] + s * up_v[m + 1] + f * (-c * up_w[m - 1] + s * up_v[m - 1]))
    z = (n - m + 1) * (-c * up_v[m] - s * up_w[m])
    return np.stack([x, y, z], axis=1)
