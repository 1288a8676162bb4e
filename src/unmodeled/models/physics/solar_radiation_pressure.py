"""Push of sunlight on a sphere, with the shadow of the central body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.constants import ASTRONOMICAL_UNIT
from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.shadow import (
    OCCULTER_RADIUS,
    SHADOW_RADIUS,
    SUN_RADIUS,
    shadow_edges,
    sunlit_share,
)
from unmodeled.models.physics.vectors import combine, norm

__all__ = ["SUNLIGHT", "SolarRadiationPressure"]

#: Area over mass, pressure at one astronomical unit, and that unit; shared by all that shines.
SUNLIGHT = (
    Parameter("srp_CrA_m", unit="m2 kg-1", scale=1e-2, description="Cr A / m"),
    Parameter(
        "srp_pressure",
        unit="N m-2",
        value=4.56e-6,
        scale=1e-8,
        lower=0.0,
        description="pressure of sunlight at one au",
    ),
    Parameter(
        "au",
        unit="m",
        value=ASTRONOMICAL_UNIT.value,
        scale=ASTRONOMICAL_UNIT.value,
        lower=1e-6,
        description="distance at which the pressure is given",
    ),
)


@dataclass(frozen=True)
class SolarRadiationPressure(Effect):
    r"""Solar radiation pressure on a sphere ("cannonball").

    .. math::
        \mathbf a = \nu P_0 \left(\frac{au}{d}\right)^2 C_r\frac{A}{m}\,\frac{\mathbf r -
        \mathbf s}{d}, \qquad d = |\mathbf r - \mathbf s|

    away from the Sun at s. Source: [MontenbruckGill2000] Eq. 3.75 and section 3.4.2;
    the share of sunlight nu is that of `sunlit_share`, a smooth form of the conical shadow of the
    central body, times that of the ``occulter`` (where both shadows fall on one place, the product
    counts what both hide twice). The Sun stands where it is, not where it was when its light left:
    shadows at the Moon come 40 s late. Only the product of ``srp_CrA_m`` and ``srp_pressure``
    is observable: estimate the first. The pressure's default is that of the source, 4.56e-6 N/m2
    (a solar constant of 1367 W/m2), with which published coefficients go; the newer 1361 W/m2
    [KoppLean2011] makes 4.54e-6. ``shadow_radius`` must be given with a shadow. Units: ``au``
    and ``sun_radius`` are parameters with SI values as defaults; give them in other units yourself.

    Size: LAGEOS (7.85e-4 m2/kg) 3.6e-9 m/s2, a GNSS satellite (0.02 m2/kg) 9e-8, Bennu orbiter
    (0.02 m2/kg) 9e-8 m/s2.

    Confused with: constant inertial acceleration and the Sun-line push over less than months,
    albedo, once-per-revolution terms. Not to be combined with a free `SunLinePush`, nor with free
    `ConstantInertial` over days.

    Parameters
    ----------
    shadow : bool
        False: always in sunlight.
    occulter : str
        Another body that throws a shadow: ``"earth"`` for orbits of the Moon (lunar eclipses),
        ``"moon"`` for orbits of the Earth. Needs its track and ``occulter_radius``.
    """

    shadow: bool = True
    occulter: str = ""
    name: ClassVar[str] = "solar_radiation_pressure"

    def __post_init__(self) -> None:
        if self.occulter == "sun" or (self.occulter and not self.shadow):
            raise ConfigError(
                f'occulter is "{self.occulter}" and shadow is {self.shadow}',
                allowed="another body than the Sun, with shadow: true",
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Area over mass, pressure, astronomical unit; radii of body and Sun for the shadow."""
        other = (OCCULTER_RADIUS,) if self.occulter else ()
        return (*SUNLIGHT, *((SHADOW_RADIUS, SUN_RADIUS) if self.shadow else ()), *other)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The Sun, and the occulter."""
        return ("sun", self.occulter) if self.occulter else ("sun",)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the push away from the Sun."""
        from_sun = _from_sun(s)
        d = norm(from_sun)
        push = _strength(s) / (d * d * d)
        if self.shadow:
            push = push * sunlit_share(s)
        if self.occulter:
            push = push * sunlit_share(s, self.occulter)
        return combine([push], [from_sun])

    def edges(self, s: Symbols) -> tuple[expression, ...]:
        """Zero at entry into the penumbra and at exit from it, where an integrator must stop."""
        other = (shadow_edges(s, self.occulter),) if self.occulter else ()
        return (shadow_edges(s), *other) if self.shadow else ()

    def potential(self, s: Symbols) -> expression | None:
        """Return that of a repelling Sun; None with a shadow."""
        return None if self.shadow else -_strength(s) / norm(_from_sun(s))


def _from_sun(s: Symbols) -> Vector:
    return combine([expression(1.0), expression(-1.0)], [s.position, s.bodies["sun"]])


def _strength(s: Symbols) -> expression:
    return s["srp_pressure"] * s["srp_CrA_m"] * s["au"] * s["au"]
