"""Frame dragging by a rotating body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.relativity import LIGHT
from unmodeled.models.physics.vectors import combine, cross, norm

__all__ = ["LenseThirring"]

SCALE = Parameter(
    "lense_thirring_scale", unit="1", value=1.0, description="frame dragging; 1: relativity"
)
SPIN = Parameter(
    "lense_thirring_J",
    unit="m2 s-1",
    scale=1e8,
    description="angular momentum of the body over its mass, along z",
)


@dataclass(frozen=True)
class LenseThirring(Effect):
    r"""Lense-Thirring term of a body that turns about z.

    .. math::
        \mathbf a = s \frac{2\,GM}{c^2 r^3} \left[ \frac{3}{r^2} (\mathbf r \times \mathbf v)
        (\mathbf r \cdot \mathbf J) + \mathbf v \times \mathbf J \right], \qquad
        \mathbf J = J \mathbf e_z

    Source: [IERS2010] Eq. 10.12, second line, with :math:`\gamma = 1`. *J* is
    ``lense_thirring_J``, the angular momentum per unit mass, positive for a body that turns
    eastward: 9.8e8 m2/s for the Earth. *s* is ``lense_thirring_scale``; only the product s J is
    observable: estimate one of the two. Inertial axes, z along the spin axis. ``c`` in the units
    of everything else (see `Schwarzschild`).

    Size: 2e-10 m/s2 in low Earth orbit. It does no work; the node moves by
    2 GM J / (c^2 a^3 (1 - e^2)^(3/2)), forwards for every inclination: 31 milliarcseconds a year
    for LAGEOS.

    Confused with: the even zonals, whose node rates change sign with the inclination while this
    one does not. Not to be combined with free even zonals on one orbit only.
    """

    name: ClassVar[str] = "lense_thirring"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM, the speed of light, the scale and the angular momentum."""
        return (GM, LIGHT, SCALE, SPIN)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gravitomagnetic acceleration."""
        spin: Vector = (expression(0.0), expression(0.0), s["lense_thirring_J"])
        r = norm(s.position)
        factor = 2.0 * s["lense_thirring_scale"] * s["GM"] / (s["c"] * s["c"] * r * r * r)
        along = 3.0 * factor * s.position[2] * spin[2] / (r * r)
        return combine([along, factor], [cross(s.position, s.velocity), cross(s.velocity, spin)])
