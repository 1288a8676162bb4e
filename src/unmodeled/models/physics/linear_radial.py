"""A radial acceleration that grows with distance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, dot

__all__ = ["LinearRadial"]

RATE = Parameter(
    "linear_radial_k", unit="s-2", scale=1e-20, description="outward acceleration per distance"
)


@dataclass(frozen=True)
class LinearRadial(Effect):
    r"""Acceleration :math:`\mathbf a = k\,\mathbf r`, outwards for k > 0.

    Source: [Kellogg1929] chapter III: the field of a ring of matter far outside (mass m,
    radius b, in the plane of the orbit) begins with :math:`k = G m / (2 b^3)`; a uniform medium
    of density rho inside the orbit makes :math:`k = -\tfrac43 \pi G \rho`. Off the plane the
    ring's pull is different: this is the form for one orbit in it. The periapsis turns by
    :math:`3 \pi k a^3 \sqrt{1 - e^2} / GM` a revolution. Parameter: ``linear_radial_k``.

    Size: the 43 arcseconds a century of Mercury need k = 3.7e-20 s-2.

    Confused with: relativity, J2 of the central body and a power law, on one orbit: all turn the
    periapsis; a second orbit of another size decides (3 pi k a^3 / GM grows with a, the others
    fall). Not to be combined with those unless several orbits are fitted.
    """

    name: ClassVar[str] = "linear_radial"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The rate k."""
        return (RATE,)

    def acceleration(self, s: Symbols) -> Vector:
        """Return k r."""
        return combine([s["linear_radial_k"]], [s.position])

    def potential(self, s: Symbols) -> expression:
        """Return k r^2 / 2."""
        return 0.5 * s["linear_radial_k"] * dot(s.position, s.position)
