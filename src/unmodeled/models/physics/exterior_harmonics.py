"""Exterior solid harmonics and their derivatives at many points, as plain arrays."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError

__all__ = ["column", "column_degrees", "column_names", "derivative", "exterior_harmonics"]

Integers = npt.NDArray[np.intp]
_Harmonic = tuple[int, int, bool]  # degree, order, sine


def column(n: int, m: int, sine: bool = False) -> int:
    """Return the row of a harmonic: degree by degree, C_n_0, C_n_1, S_n_1, C_n_2, ..."""
    return n * n + (2 * m - 1 + int(sine) if m else 0)


def column_names(degree: int) -> list[str]:
    """Return ``C_n_m`` and ``S_n_m`` in the order of `column`.

    Examples
    --------
    >>> column_names(1)
    ['C_0_0', 'C_1_0', 'C_1_1', 'S_1_1']
    """
    return [
        f"{kind}_{n}_{m}"
        for n in range(degree + 1)
        for m in range(n + 1)
        for kind in ("CS" if m else "C")
    ]


def column_degrees(degree: int) -> Integers:
    """Return the degree of each row, ((degree + 1)^2,)."""
    return np.repeat(np.arange(degree + 1), 2 * np.arange(degree + 1) + 1)


def exterior_harmonics(X: Array, degree: int) -> Array:
    r"""Return :math:`r^{-(n+1)} \bar P_{nm}(\sin\varphi) \{\cos, \sin\} m\lambda` by row.

    Parameters
    ----------
    X : ndarray (n, 3)
        Positions, in reference radii.
    degree : int
        Highest degree; fully normalised (mean square 1 on the unit sphere), no Condon-Shortley
        phase; recursions of [MontenbruckGill2000] section 3.2.4, regular at the poles.

    Returns
    -------
    ndarray ((degree + 1)^2, n)
        Rows in the order of `column`.

    Raises
    ------
    DataError
        At the origin.
    """
    square = (X**2).sum(axis=1)
    if (square == 0.0).any():
        raise DataError(
            f"position {int(np.argmin(square))} is the origin, where the field is singular",
            allowed="positions outside the body",
        )
    x, y, z = X.T / square
    table = np.zeros(((degree + 1) ** 2, len(X)))
    table[0] = 1.0 / np.sqrt(square)
    for m in range(degree + 1):
        c, s = column(m, m), column(m, m, True)
        if m:
            grow = math.sqrt((2 * m + 1) / (2 * m)) if m > 1 else math.sqrt(3.0)
            before_c = table[column(m - 1, m - 1)]
            before_s = table[column(m - 1, m - 1, True)] if m > 1 else np.zeros(len(X))
            table[c] = grow * (x * before_c - y * before_s)
            table[s] = grow * (x * before_s + y * before_c)
        for n in range(m + 1, degree + 1):
            one = math.sqrt((2 * n - 1) * (2 * n + 1) / ((n - m) * (n + m)))
            two = math.sqrt(
                (2 * n + 1) * (n - m - 1) * (n + m - 1) / ((2 * n - 3) * (n + m) * (n - m))
            )
            for sine in (False, True) if m else (False,):
                row = table[column(n, m, sine)]
                row[:] = one * z * table[column(n - 1, m, sine)]
                if n > m + 1:
                    row -= two / square * table[column(n - 2, m, sine)]
    return table


def derivative(table: Array, axis: int) -> Array:
    """Return the derivative along an axis of all harmonics but those of the highest degree.

    The derivative of an exterior harmonic of degree n is a sum of two of degree n + 1: no
    quotient, no special case, and derivatives of any order by repetition.

    Parameters
    ----------
    table : ndarray ((N + 1)^2, ...)
        From `exterior_harmonics`, or any linear image of it along its rows.
    axis : int
        0, 1, 2 for x, y, z.

    Returns
    -------
    ndarray (N^2, ...)
        [MontenbruckGill2000] Eq. 3.33, with the factors of full normalisation.
    """
    rows, weights = _maps(math.isqrt(len(table)) - 2)[axis]
    shape = (-1,) + (1,) * (table.ndim - 1)
    total = table[rows[0]]
    total *= weights[0].reshape(shape)
    if axis != 2:
        total += weights[1].reshape(shape) * table[rows[1]]
    out: Array = total
    return out


@cache
def _maps(degree: int) -> tuple[tuple[Integers, Array], ...]:
    """Rows (2, p) and weights (2, p) whose sum is the derivative, for each axis."""
    size = (degree + 1) ** 2
    maps = tuple((np.zeros((2, size), dtype=np.intp), np.zeros((2, size))) for _ in range(3))

    def put(axis: int, place: int, source: _Harmonic, m: int, sine: bool, w: float) -> None:
        n, own, _ = source
        rows, weights = maps[axis]
        rows[place, column(*source)] = column(n + 1, m, sine)
        weights[place, column(*source)] = w * _norm_ratio(n, own, m)

    for n in range(degree + 1):
        for m in range(n + 1):
            for sine in (False, True) if m else (False,):
                source = (n, m, sine)
                put(2, 0, source, m, sine, -(n - m + 1.0))
                if m == 0:
                    put(0, 0, source, 1, False, -1.0)
                    put(1, 0, source, 1, True, -1.0)
                    continue
                back = 0.5 * (n - m + 2) * (n - m + 1)
                put(0, 0, source, m + 1, sine, -0.5)
                put(1, 0, source, m + 1, not sine, 0.5 if sine else -0.5)
                # the sine of order 0 is nothing
                if m > 1 or not sine:
                    put(0, 1, source, m - 1, sine, back)
                if m > 1 or sine:
                    put(1, 1, source, m - 1, not sine, back if sine else -back)
    return maps


def _norm_ratio(n: int, m: int, target: int) -> float:
    """Return the norm of (n, m) over that of (n + 1, target)."""

    def square(n: int, m: int) -> tuple[int, int]:
        return (1 if m == 0 else 2) * (2 * n + 1) * math.factorial(n - m), math.factorial(n + m)

    (a, b), (c, d) = square(n, m), square(n + 1, target)
    return math.sqrt((a * d) / (b * c))
