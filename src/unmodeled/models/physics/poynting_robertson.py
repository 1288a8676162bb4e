"""Sunlight and solar wind brake what circles the Sun."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.relativity import LIGHT
from unmodeled.models.physics.vectors import combine, dot

__all__ = ["PoyntingRobertson"]

PARAMETERS = (
    Parameter("pr_beta", unit="1", scale=1e-3, description="radiation pressure over gravity"),
    Parameter(
        "pr_wind", unit="1", scale=0.1, description="drag of the solar wind over that of the light"
    ),
)


@dataclass(frozen=True)
class PoyntingRobertson(Effect):
    r"""Poynting-Robertson drag: the part of radiation pressure that depends on the velocity.

    .. math::
        \mathbf a = -\beta (1 + w) \frac{GM}{c\, r^2} \left[\frac{\mathbf r \cdot \mathbf v}{r^2}
        \mathbf r + \mathbf v\right]

    Heliocentric. Source: [Burns1979] Eq. 5 (light; its radial part is A1 of
    `NonGravitationalA123`), [Gustafson1994] (w = 0.35, the solar wind). beta is the radiation
    pressure over the Sun's attraction, 7.7e-4 Cr A/m with A/m in m2/kg. Only beta (1 + w) is
    observable: estimate ``pr_beta``.

    Size: a circular orbit falls by da/dt = -2 beta GM/(c a), into the Sun in
    400 a^2 / beta years (au). Dust of 1 micrometre beta = 0.2, a spacecraft 2e-5, a rock of 1 m
    5e-7.

    Confused with: A2 of `NonGravitationalA123` (the same on a circular orbit), `VelocityDrag`. Not
    to be combined with a free one of these on one near-circular orbit.
    """

    name: ClassVar[str] = "poynting_robertson"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Beta, share of the wind, GM of the Sun, speed of light."""
        return (*PARAMETERS, GM, LIGHT)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the drag."""
        square = dot(s.position, s.position)
        size = s["pr_beta"] * (1.0 + s["pr_wind"]) * s["GM"] / (s["c"] * square)
        radial = dot(s.position, s.velocity) / square
        return combine([-size * radial, -size], [s.position, s.velocity])
