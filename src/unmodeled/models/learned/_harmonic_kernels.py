r"""Closed forms of harmonic covariances, for numpy and torch alike.

With s = c / (|x| |y|), c the square of the radius of the Bjerhammar sphere, and t the cosine of the
angle between x and y, the potentials at x and y have the covariance

.. math:: K = \sum_n \sigma_n^2 s^{n+1} P_n(t)

([Moritz1980]; harmonic outside the sphere, in both). P = |x|^2 |y|^2, w = x.y, Q = P - 2 c w + c^2:

- ``reciprocal``, sigma_n^2 = 1: c Q^(-1/2), the reciprocal distance (Krarup);
- ``abel_poisson``, sigma_n^2 = 2 n + 1: c (P - c^2) Q^(-3/2);
- ``logarithmic``, sigma_n^2 = 1 / (n + 1): ln (z + c)/(z - c), z = sqrt P + sqrt Q. It is the
  integral of the reciprocal one over s, ln(1 + 2 s/(1 - s + L)) with L^2 = Q / P; multiplied by
  |x| |y|, numerator and denominator become polynomials in roots.

Each depends on P and w alone, so that every derivative by x and y follows from those by P and w
(`derivative_block`), the derivatives by log c being kernels of the same kind (`_BY_LOG_C`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError

__all__ = [
    "LAWS",
    "acceleration_covariance",
    "check_law",
    "coefficient_variances",
    "derivative_block",
    "slope_by_log_c",
]

LAWS = ("reciprocal", "abel_poisson", "logarithmic")

#: c dK/dc = sum of factors times kernels: a term of degree n gets the factor n + 1.
_BY_LOG_C = {
    "logarithmic": {"reciprocal": 1.0},
    "reciprocal": {"abel_poisson": 0.5, "reciprocal": 0.5},
    "abel_poisson": {"abel_poisson slope": 1.0},
}


def check_law(learner: str, law: str) -> None:
    """Raise ``ConfigError`` for a law that is not in ``LAWS``."""
    if law not in LAWS:
        raise ConfigError(f'{learner}: kernel is "{law}"', allowed=", ".join(LAWS))


def coefficient_variances(law: str, degrees: Any) -> Array:
    """Return sigma_n^2 / (2n + 1): the prior of each normalised coefficient, but for s^2 q^(2n).

    Coefficients of that variance give s^2 / q^2 times the kernel with c = q^2 (addition theorem).
    """
    n = np.asarray(degrees, dtype=np.float64)
    if law == "abel_poisson":
        return np.ones_like(n)
    by_degree: Array = 1.0 / (2.0 * n + 1.0)
    return by_degree if law == "reciprocal" else by_degree / (n + 1.0)


def derivative_block(law: str, x: Any, y: Any, c: Any, a: int, b: int, xp: Any = np) -> Any:
    """Return the derivative of K, ``a`` times by x and ``b`` times by y.

    Orders 0, 1, 2 are covariances of potential, acceleration and gravity gradient.

    Parameters
    ----------
    law : str
        Of ``LAWS``.
    x, y : array (..., n, 3), (..., m, 3)
        Positions outside the sphere of radius sqrt(c).
    c : float or array (..., 1, 1)
        Its square, in units of length squared.
    a, b : int
        0, 1 or 2.
    xp : module
        ``numpy`` or ``torch``, as the arrays are.

    Returns
    -------
    array (..., n, m, 3, ...)
        ``a`` axes of x, then ``b`` axes of y.
    """
    xx, yy = (x * x).sum(-1), (y * y).sum(-1)
    w = xp.einsum("...nd,...md->...nm", x, y)
    outer = _outer_partials(law, xx[..., :, None] * yy[..., None, :], w, c, a + b)
    eye = xp.eye(3, dtype=x.dtype)
    letters = "ij"[:a] + "kl"[:b]
    total: Any = None
    for blocks in _partitions(letters):
        for kinds in product("Pw", repeat=len(blocks)):
            factors = [
                _inner(kind, part, x, y, xx, yy, eye)
                for kind, part in zip(kinds, blocks, strict=True)
            ]
            if any(f is None for f in factors):
                continue
            terms: list[tuple[str, Any]] = [
                ("...nm", outer[kinds.count("P"), kinds.count("w")]),
                *(t for f in factors if f is not None for t in f),
            ]
            names, arrays = zip(*terms, strict=True)
            term = xp.einsum(f"{','.join(names)}->...nm{letters}", *arrays)
            total = term if total is None else total + term
    return total


def slope_by_log_c(law: str, x: Any, y: Any, c: Any, a: int, b: int, xp: Any = np) -> Any:
    """Return c d/dc of `derivative_block`."""
    return sum(
        factor * derivative_block(other, x, y, c, a, b, xp)
        for other, factor in _BY_LOG_C[law].items()
    )


def acceleration_covariance(law: str, x: Array, y: Array, c: float, *, slope: bool = False) -> Any:
    """Return `derivative_block` of orders 1, 1 as a matrix (3n, 3m), ordered by component.

    The same sum, gathered to x_i (E y_j + F x_j) + y_i (G y_j + H x_j) + K_w delta_ij: ten times
    faster, for fits. With ``slope`` also c times its derivative by c.
    """
    xx, yy = (x * x).sum(axis=-1)[:, None], (y * y).sum(axis=-1)[None, :]
    # Not by BLAS, so that a row does not depend on its batch.
    P, w = xx * yy, sum(x[:, i, None] * y[None, :, i] for i in range(3))
    own = _outer_partials(law, P, w, c, 2)
    kernel = _gathered(own, x, y, xx, yy, P)
    if not slope:
        return kernel
    others = _BY_LOG_C[law].items()
    parts = [(own if o == law else _outer_partials(o, P, w, c, 2), f) for o, f in others]
    by_c = {key: sum(factor * part[key] for part, factor in parts) for key in own}
    return kernel, _gathered(by_c, x, y, xx, yy, P)


def _gathered(
    outer: dict[tuple[int, int], Any], x: Array, y: Array, xx: Array, yy: Array, P: Array
) -> Array:
    e = 4.0 * (outer[1, 0] + P * outer[2, 0])
    f, g, h = 2.0 * yy * outer[1, 1], 2.0 * xx * outer[1, 1], outer[0, 2]
    xs, ys = [x[:, i, None] for i in range(3)], [y[None, :, i] for i in range(3)]
    along_x = [e * ys[j] + f * xs[j] for j in range(3)]
    along_y = [g * ys[j] + h * xs[j] for j in range(3)]
    n, m = P.shape
    out = np.empty((3, n, 3, m))
    for i in range(3):
        for j in range(3):
            np.add(xs[i] * along_x[j], ys[i] * along_y[j], out=out[i, :, j])
        out[i, :, i] += outer[0, 1]
    return out.reshape(3 * n, 3 * m)


def _inner(
    kind: str, letters: str, x: Any, y: Any, xx: Any, yy: Any, eye: Any
) -> list[tuple[str, Any]] | None:
    """Factors whose product is a derivative of P = |x|^2 |y|^2 or w = x.y; None for zero."""
    left, right = [e for e in letters if e in "ij"], [e for e in letters if e in "kl"]
    if kind == "w":
        if len(left) > 1 or len(right) > 1:
            return None
        if left and right:
            return [(letters, eye)]
        return [("...m" + left[0], y)] if left else [("...n" + right[0], x)]
    return [*_square("n", left, x, xx, eye), *_square("m", right, y, yy, eye)]


def _square(row: str, letters: list[str], x: Any, xx: Any, eye: Any) -> list[tuple[str, Any]]:
    """Factors of a derivative of |x|^2."""
    if not letters:
        return [("..." + row, xx)]
    if len(letters) == 1:
        return [(f"...{row}{letters[0]}", 2.0 * x)]
    return [("".join(letters), 2.0 * eye)]


@cache
def _partitions(letters: str) -> tuple[tuple[str, ...], ...]:
    """All ways to part a set (the formula of Faa di Bruno sums over them)."""

    def parts(rest: str) -> Iterator[tuple[str, ...]]:
        if not rest:
            yield ()
            return
        first, others = rest[0], rest[1:]
        for smaller in parts(others):
            yield (first, *smaller)
            for k, block in enumerate(smaller):
                yield (*smaller[:k], first + block, *smaller[k + 1 :])

    return tuple(parts(letters))


def _outer_partials(law: str, P: Any, w: Any, c: Any, order: int) -> dict[tuple[int, int], Any]:
    """Return derivatives of K, m times by P and k times by w, m + k = 0 .. order."""
    Q = P - 2.0 * c * w + c * c
    pairs = [(m, k) for m in range(order + 1) for k in range(order + 1 - m)]
    if law == "logarithmic":
        return {(m, k): _logarithmic(P, Q, c, m, k) for m, k in pairs}
    # c times a sum of polynomials in P, lowest power first, times powers of Q
    by_law: dict[str, list[tuple[tuple[Any, ...], float]]] = {
        "reciprocal": [((1.0,), -0.5)],
        "abel_poisson": [((-c * c, 1.0), -1.5)],
        "abel_poisson slope": [
            ((-1.5 * c * c, -0.5), -1.5),
            ((1.5 * c**4, -3.0 * c * c, 1.5), -2.5),
        ],
    }
    terms, found = by_law[law], {}
    for m, k in pairs:
        total: Any = 0.0
        for polynomial, power in terms:
            for r in range(min(m, len(polynomial) - 1) + 1):
                risen = _derived(polynomial, r, P)
                total = total + math.comb(m, r) * risen * _power(Q, power, m - r + k)
        found[m, k] = c * (-2.0 * c) ** k * total
    return found


def _derived(polynomial: tuple[Any, ...], times: int, P: Any) -> Any:
    return sum(
        math.perm(j, times) * coefficient * P ** (j - times)
        for j, coefficient in enumerate(polynomial)
        if j >= times
    )


def _power(base: Any, power: float, times: int) -> Any:
    """Return a derivative of base^power."""
    return math.prod(power - j for j in range(times)) * base ** (power - times)


def _logarithmic(P: Any, Q: Any, c: Any, m: int, k: int) -> Any:
    """Return a derivative of ln (z + c)/(z - c) with z = sqrt P + sqrt Q."""
    z = P**0.5 + Q**0.5
    near, far = 1.0 / (z - c), 1.0 / (z + c)
    if m + k == 0:
        ratio = 2.0 * c * near
        return ratio.log1p() if hasattr(ratio, "log1p") else np.log1p(ratio)

    def z_by(p: int, q: int) -> Any:
        by = (-2.0 * c) ** q * _power(Q, 0.5, p + q)
        return by if q else by + _power(P, 0.5, p)

    total: Any = 0.0
    for blocks in _partitions("abcd"[:m] + "stuv"[:k]):
        j = len(blocks)
        # far^j - near^j, with the difference of the two taken out: no digit is lost for small c
        powers = sum(far**i * near ** (j - 1 - i) for i in range(j))
        outer = (-1) ** (j - 1) * math.factorial(j - 1) * (-2.0 * c) * far * near * powers
        for block in blocks:
            p = sum(e in "abcd" for e in block)
            outer = outer * z_by(p, len(block) - p)
        total = total + outer
    return total
