"""First post-Newtonian acceleration of a spherical mass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from unmodeled.core.constants import SPEED_OF_LIGHT
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.vectors import combine, dot, norm

__all__ = ["LIGHT", "Schwarzschild"]

#: The speed of light, shared by all relativistic effects of a model.
LIGHT = Parameter(
    "c",
    unit="m s-1",
    value=SPEED_OF_LIGHT.value,
    scale=SPEED_OF_LIGHT.value,
    lower=1e-6,
    description="speed of light",
)
SCALE = Parameter(
    "schwarzschild_scale", unit="1", value=1.0, description="1PN term; 1: general relativity"
)


@dataclass(frozen=True)
class Schwarzschild(Effect):
    r"""Schwarzschild term, an addition to the Newtonian point mass.

    .. math::
        \mathbf a = s \frac{GM}{c^2 r^3} \left[ \left(4 \frac{GM}{r} - v^2\right) \mathbf r
        + 4 (\mathbf r \cdot \mathbf v) \mathbf v \right]

    Source: [IERS2010] Eq. 10.12, first line, with :math:`\beta = \gamma = 1`; *s* is
    ``schwarzschild_scale``: 1 for general relativity, 0 for none. Inertial axes, harmonic
    coordinates, velocity relative to the non-rotating frame of the body.

    Units: ``c`` is a parameter with the SI value as default. Working in other units, give it in
    those (173.1446 au/day), or the term is wrong without a word.

    Size: 1.6e-8 m/s2 in low Earth orbit (6878 km), 2.8e-10 m/s2 for GNSS; radially outwards,
    3 GM^2 / (c^2 r^3), on a circular orbit. Periapsis advances by 6 pi GM / (c^2 a (1 - e^2)) a
    revolution: 42.98 arcseconds a century for Mercury.

    Confused with: J2 of the same body (same drift of the periapsis on one orbit), a power law
    (`PowerLawGravity`), and on a circular orbit with GM or a constant radial acceleration. Not to
    be combined with `PowerLawGravity` unless several orbits of different size are fitted.
    """

    name: ClassVar[str] = "schwarzschild"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM, the speed of light and the scale."""
        return (GM, LIGHT, SCALE)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the post-Newtonian correction."""
        r, rv = norm(s.position), dot(s.position, s.velocity)
        factor = s["schwarzschild_scale"] * s["GM"] / (s["c"] * s["c"] * r * r * r)
        radial = 4.0 * s["GM"] / r - dot(s.velocity, s.velocity)
        return combine([factor * radial, 4.0 * factor * rv], [s.position, s.velocity])
