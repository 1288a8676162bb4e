"""Gravity of a homogeneous ellipsoid with three axes."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial, sqrt
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.polyhedron import check_shape_degree
from unmodeled.models.physics.shape_harmonics import series_force, series_potential

__all__ = ["Ellipsoid"]


@dataclass(frozen=True)
class Ellipsoid(Effect):
    r"""What a homogeneous ellipsoid adds to the point mass, in body axes along its own.

    .. math::
        U = s\,\frac{GM}{r} \sum_{l=1}^{N/2} \sum_{m=0}^{l} \left(\frac{a}{r}\right)^{2l}
        C_{2l,2m} P_{2l,2m}(\sin\varphi) \cos 2m\lambda

    Source: [Balmino1994] for the coefficients, which are exact:

    .. math::
        C_{2l,2m} = \frac{3}{a^{2l}} \frac{l!\,(2l-2m)!}{4^m (2l+3) (2l+1)!} (2 - \delta_{0m})
        \sum_{i} \frac{(a^2-b^2)^{m+2i} (c^2 - \tfrac12 (a^2+b^2))^{l-m-2i}}
        {16^i\,(l-m-2i)!\,(m+i)!\,i!}

    It stands beside a `PointMass`; GM = 4/3 pi G density a b c. Parameters: the semi-axes
    ``ellipsoid_a``, ``_b``, ``_c`` along x, y, z, and the scale s, ``ellipsoid_scale``: 1 for
    constant density, 0 for the point mass alone. Equal axes make no field. The series of the full
    degree converges where r exceeds the focal distance, the root of the difference of the largest
    and smallest axis squared: everywhere outside if the largest axis is less than sqrt(2) times
    the smallest, and always beyond the largest axis.

    Size: Eros as an ellipsoid of 17, 5.5 and 5.5 km: C22 = 0.045 (unnormalised) about 17 km.

    Confused with: C20 and C22, from far away. With equal axes, or s = 0, axes cannot be
    estimated. Not to be combined with zonals or spherical harmonics of the same degrees.

    Parameters
    ----------
    degree : int
        Highest degree N, 2 to 24; odd ones add nothing.
    """

    degree: int = 8
    name: ClassVar[str] = "ellipsoid"
    axes: ClassVar[str] = "body"

    def __post_init__(self) -> None:
        check_shape_degree(self.degree, self.name, 2)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM, the scale and the semi-axes."""
        return (
            GM,
            Parameter(
                "ellipsoid_scale",
                unit="1",
                value=1.0,
                description="field of the shape; 1: constant density, 0: point mass only",
            ),
            *(
                Parameter(
                    f"ellipsoid_{k}",
                    unit="m",
                    value=1.0,
                    lower=0.0,
                    description=f"semi-axis along {axis}",
                )
                for k, axis in zip("abc", "xyz", strict=True)
            ),
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of the series."""
        gm = s["ellipsoid_scale"] * s["GM"]
        return series_force(s, self._coefficients(s), self.degree, gm, s["ellipsoid_a"])

    def potential(self, s: Symbols) -> expression:
        """Return the series."""
        gm = s["ellipsoid_scale"] * s["GM"]
        return series_potential(s, self._coefficients(s), self.degree, gm, s["ellipsoid_a"])

    @property
    def terms(self) -> frozenset[str]:
        """One term for each coefficient that is not zero."""
        return frozenset(f"gravity C({n},{m})" for n, m in self._pairs())

    def _pairs(self) -> list[tuple[int, int]]:
        return [(n, m) for n in range(2, self.degree + 1, 2) for m in range(0, n + 1, 2)]

    def _coefficients(self, s: Symbols) -> dict[str, expression]:
        """Fully normalised coefficients, as functions of the axes."""
        a, b, c = (s[f"ellipsoid_{k}"] for k in "abc")
        # Shares of a squared: the numbers stay near one whatever the units.
        flat = 1.0 - (b / a) * (b / a)
        tall = (c / a) * (c / a) - 0.5 * (1.0 + (b / a) * (b / a))
        return {f"C_{n}_{m}": _coefficient(n // 2, m // 2, flat, tall) for n, m in self._pairs()}


def _coefficient(half: int, order: int, flat: expression, tall: expression) -> expression:
    """C(2l, 2m), fully normalised, l = ``half``, m = ``order``."""
    n, m = 2 * half, 2 * order
    front = 3.0 * factorial(half) * factorial(n - m) / (4.0**order * (n + 3) * factorial(n + 1))
    front *= 2.0 if m else 1.0
    norm = sqrt(factorial(n + m) / ((2.0 if m else 1.0) * (2 * n + 1) * factorial(n - m)))
    total = expression(0.0)
    for i in range((half - order) // 2 + 1):
        rest = half - order - 2 * i
        size = 16.0**i * factorial(rest) * factorial(order + i) * factorial(i)
        total = total + _power(flat, order + 2 * i) * _power(tall, rest) * (1.0 / size)
    return norm * front * total


def _power(x: expression, exponent: int) -> expression:
    # By multiplication: a symbolic power is not finite at zero.
    result = expression(1.0)
    for _ in range(exponent):
        result = result * x
    return result
