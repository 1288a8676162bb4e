"""Constant acceleration in inertial axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import dot

__all__ = ["ConstantInertial"]


@dataclass(frozen=True)
class ConstantInertial(Effect):
    r"""Constant acceleration :math:`\mathbf a = (a_x, a_y, a_z)`, inertial axes.

    Source: [MontenbruckGill2000] section 3.7.4 (empirical forces). The force function is
    :math:`U = \mathbf a \cdot \mathbf r`. The parameters are ``inertial_a_x``, ``inertial_a_y``,
    ``inertial_a_z``.

    Size: radiation pressure at 1 au is 4.6e-6 m/s2 for 1 m2/kg; about 1e-7 m/s2 for a
    spacecraft. It keeps the semi-major axis on average and drives the eccentricity vector.

    Confused with: radiation pressure and a distant third body on arcs short beside the year;
    thermal recoil of a spacecraft that keeps its attitude. Not to be combined with free radiation
    pressure on such an arc.
    """

    name: ClassVar[str] = "constant_inertial"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Three components."""
        return tuple(
            Parameter(f"inertial_a_{k}", unit="m s-2", scale=1e-9, description=f"constant {k} part")
            for k in "xyz"
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the constant vector."""
        return s["inertial_a_x"], s["inertial_a_y"], s["inertial_a_z"]

    def potential(self, s: Symbols) -> expression:
        """Return a . r."""
        return dot(self.acceleration(s), s.position)
