"""A constant push along the line from the Sun."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, norm

__all__ = ["SunLinePush"]

PUSH = Parameter(
    "sun_line_a", unit="m s-2", scale=1e-9, description="push along the Sun line, away from the Sun"
)


@dataclass(frozen=True)
class SunLinePush(Effect):
    r"""Constant acceleration along the Sun line, the same at every distance.

    .. math::
        \mathbf a = a_\odot \frac{\mathbf r - \mathbf s}{|\mathbf r - \mathbf s|}

    with s the Sun; positive away from it, in light and shadow alike. Source: [Anderson2002] (the
    Pioneer anomaly, later found to be heat of the spacecraft itself). Parameter: ``sun_line_a``.
    Where the Sun is the central body itself, take the radial part of `ConstantRTN`.

    Size: Pioneer 10 and 11 -8.7e-10 m/s2; heat radiated from one side of a satellite 1e-10 to
    1e-9 m/s2.

    Confused with: sunlight without a shadow on any orbit about a planet, constant inertial
    acceleration over less than months. Not to be combined with a free `SolarRadiationPressure`
    unless the orbit has eclipses or goes far towards the Sun and back.
    """

    name: ClassVar[str] = "sun_line_push"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The push."""
        return (PUSH,)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The Sun."""
        return ("sun",)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the push."""
        from_sun = _from_sun(s)
        return combine([s["sun_line_a"] / norm(from_sun)], [from_sun])

    def potential(self, s: Symbols) -> expression:
        """Return push times distance from the Sun."""
        return s["sun_line_a"] * norm(_from_sun(s))


def _from_sun(s: Symbols) -> Vector:
    return combine([expression(1.0), expression(-1.0)], [s.position, s.bodies["sun"]])
