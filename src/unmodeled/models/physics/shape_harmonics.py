"""Spherical harmonics of a homogeneous body from its surface, and the force that they make."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from heyoka import expression, model
from numpy.polynomial import legendre

from unmodeled.core.arrays import Array
from unmodeled.models.physics.effect import Symbols, Vector
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.spherical_harmonics import coefficient_names

__all__ = ["mesh_harmonics", "series_force", "series_potential", "solid_harmonics"]

Coefficients = Mapping[str, float | expression]


def solid_harmonics(points: Array, degree: int) -> dict[str, Array]:
    r"""Return :math:`r^n \bar P_{nm}(\sin\varphi) \cos m\lambda` (C) and sine (S), by name.

    Parameters
    ----------
    points : ndarray (n, 3)
    degree : int
        Highest degree; fully normalised, recursions of [MontenbruckGill2000] section 3.2.4.
    """
    x, y, z = points.T
    square, line = x * x + y * y + z * z, x + 1j * y
    table: dict[tuple[int, int], Array] = {(0, 0): np.ones(len(points), dtype=complex)}
    for m in range(degree + 1):
        if m:
            grow = np.sqrt((2 * m + 1) / (2 * m)) if m > 1 else np.sqrt(3.0)
            table[m, m] = grow * line * table[m - 1, m - 1]
        for n in range(m + 1, degree + 1):
            one = np.sqrt((2 * n - 1) * (2 * n + 1) / ((n - m) * (n + m)))
            table[n, m] = one * z * table[n - 1, m]
            if n > m + 1:
                two = (2 * n + 1) * (n - m - 1) * (n + m - 1) / ((2 * n - 3) * (n + m) * (n - m))
                table[n, m] = table[n, m] - np.sqrt(two) * square * table[n - 2, m]
    return {
        name: table[int(n), int(m)].real if kind == "C" else table[int(n), int(m)].imag
        for name in coefficient_names(degree)
        for kind, n, m in [name.split("_")]
    }


def mesh_harmonics(mesh: Mesh, degree: int, radius: float) -> dict[str, float]:
    r"""Return the fully normalised coefficients of a homogeneous polyhedron.

    .. math::
        \bar C_{nm} = \frac{1}{(2n+1) V} \int \left(\frac{r}{R}\right)^n \bar P_{nm}(\sin\varphi)
        \cos m\lambda \, dV

    and the sine for S: [MontenbruckGill2000] Eq. 3.9, fully normalised. The body is the sum of
    the tetrahedra between the origin and its faces [Werner1997a]; along the radius the integral is
    1 / (n + 3), over a face that of a polynomial of degree n, for which a Gauss rule is exact.

    Parameters
    ----------
    mesh : Mesh
    degree : int
        Highest degree.
    radius : float
        Reference radius, m.
    """
    node, weight = legendre.leggauss(degree // 2 + 2)  # exact to degree + 1: one for the map
    u, w = 0.5 * (node + 1.0), 0.5 * weight
    first, second = np.meshgrid(u, u, indexing="ij")
    weights = (w[:, None] * w * first).ravel()  # the square mapped to the triangle
    shares = np.stack([1.0 - first, first * (1.0 - second), first * second], axis=-1).reshape(-1, 3)
    corners = mesh.corners / radius
    sizes = np.linalg.det(corners)
    volume = sizes.sum() / 6.0
    total: dict[str, float] = dict.fromkeys(coefficient_names(degree), 0.0)
    for share, part in zip(shares, weights, strict=True):
        values = solid_harmonics(np.einsum("k,fki->fi", share, corners), degree)
        for name, value in values.items():
            total[name] += part * float(sizes @ value)
    found = {}
    for name, integral in total.items():
        n = int(name.split("_")[1])
        found[name] = float(integral / ((n + 3) * (2 * n + 1) * volume))
    return found


def series_force(
    s: Symbols, coefficients: Coefficients, degree: int, gm: expression, radius: float | expression
) -> Vector:
    """Return the gradient of a field given by its coefficients; those left out are zero."""
    ax, ay, az = model.sh_gravity_acc(
        list(s.position), _pairs(coefficients, degree), mu=gm, a=_symbol(radius), max_degree=degree
    )
    return ax, ay, az


def series_potential(
    s: Symbols, coefficients: Coefficients, degree: int, gm: expression, radius: float | expression
) -> expression:
    """Return the force function of a field given by its coefficients."""
    return model.sh_gravity_pot(
        list(s.position), _pairs(coefficients, degree), mu=gm, a=_symbol(radius), max_degree=degree
    )


def _symbol(value: float | expression) -> expression:
    return value if isinstance(value, expression) else expression(float(value))


def _pairs(coefficients: Coefficients, degree: int) -> list[tuple[expression, expression]]:
    return [
        (
            _symbol(coefficients.get(f"C_{n}_{m}", 0.0)),
            _symbol(coefficients.get(f"S_{n}_{m}", 0.0)),
        )
        for n in range(degree + 1)
        for m in range(n + 1)
    ]
