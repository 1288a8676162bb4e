"""Attraction of a point mass at the body's centre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression, sqrt

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector

__all__ = ["GM", "PointMass"]

#: The gravitational parameter, shared by all gravity effects of a model.
GM = Parameter(
    "GM", unit="m3 s-2", value=1.0, scale=1.0, lower=0.0, description="gravitational parameter"
)


@dataclass(frozen=True)
class PointMass(Effect):
    r"""Point mass: :math:`\mathbf a = -GM\,\mathbf r / r^3`.

    Source: [Scheeres2012] Eq. 2.1. Not to be combined with a spherical-harmonic field that
    starts at degree 0, which contains it.
    """

    name: ClassVar[str] = "point_mass"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM."""
        return (GM,)

    def acceleration(self, s: Symbols) -> Vector:
        """Return -GM r / r^3."""
        x, y, z = s.position
        r2 = x * x + y * y + z * z
        factor = -s["GM"] / (r2 * sqrt(r2))
        return factor * x, factor * y, factor * z

    def potential(self, s: Symbols) -> expression:
        """Return GM / r."""
        x, y, z = s.position
        return s["GM"] / sqrt(x * x + y * y + z * z)

    @property
    def terms(self) -> frozenset[str]:
        """Degree 0 of the gravity field."""
        return frozenset({"gravity C(0,0)"})
