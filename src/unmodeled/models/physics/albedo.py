"""Push of the light and heat that the central body sends back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.shadow import SHADOW_RADIUS
from unmodeled.models.physics.solar_radiation_pressure import SUNLIGHT
from unmodeled.models.physics.vectors import combine, dot, norm

__all__ = ["Albedo"]

PARAMETERS = (
    Parameter("albedo_scale", unit="1", value=1.0, description="reflected light and heat; 0: none"),
    Parameter(
        "body_albedo",
        unit="1",
        value=0.34,
        scale=0.1,
        lower=0.0,
        upper=1.0,
        description="share of sunlight that the body reflects",
    ),
    Parameter(
        "body_emissivity",
        unit="1",
        value=0.68,
        scale=0.1,
        lower=0.0,
        upper=1.0,
        description="share of sunlight that the body sends out as heat",
    ),
)


@dataclass(frozen=True)
class Albedo(Effect):
    r"""Radiation of the central body on a sphere: its radial part, uniform body.

    .. math::
        \mathbf a = s P_0 \left(\frac{au}{d_b}\right)^2 C_r\frac{A}{m} \left(\frac Rr\right)^2
        \left[A_b \left(\tfrac14 + \tfrac12 K_1 c + \tfrac5{16} K_2 P_2(c)\right)
        + \tfrac14 E_b\right] \hat{\mathbf r}

    c is the cosine of the angle between spacecraft and Sun, :math:`d_b` the distance of the body
    from the Sun, R the ``shadow_radius``. Source: [Knocke1988] (diffuse reflection and heat at a
    quarter of the sunlight; 0.34 and 0.68 are its mean values of the Earth); the series is ours:
    the radial flux of a sphere that reflects by Lambert's law, to degree 2. K1 and K2 carry it from
    afar (2/3, 1/4) to the surface (1, 1); with x = R/r they are 2/3 + x/3 + x(1 - x)/5 and
    1/4 + 3x/4 + x^2 (1 - x)/2, within 0.007 of the integral. The bracket is within 0.005 A_b of
    that sphere from afar, 0.026 at LAGEOS, 0.07 at 500 km over the Earth; in the mean over all
    directions it is exact, as is the heat. Left out: the sideways part (up to 0.07 A_b), seas,
    clouds, seasons. Only one of ``albedo_scale``, ``body_albedo``, ``body_emissivity`` and
    ``srp_CrA_m`` is observable here: estimate one.

    Size: a tenth to a third of the sunlight in low Earth orbit; LAGEOS 1.7e-10 at night to
    4.7e-10 m/s2 at noon.

    Confused with: GM and constant radial acceleration (mean), sunlight (day side). Not to be
    combined with a free radial part of `ConstantRTN` nor, on one circular orbit, with a free GM.
    """

    name: ClassVar[str] = "albedo"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Scale, albedo, emissivity, radius of the body, sunlight."""
        return (*PARAMETERS, SHADOW_RADIUS, *SUNLIGHT)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The Sun."""
        return ("sun",)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the push away from the body."""
        sun = s.bodies["sun"]
        r, d = norm(s.position), norm(sun)
        c = dot(s.position, sun) / (r * d)
        x = s["shadow_radius"] / r
        k1 = 2.0 / 3.0 + x / 3.0 + 0.2 * x * (1.0 - x)
        k2 = 0.25 + 0.75 * x + 0.5 * x * x * (1.0 - x)
        reflected = 0.25 + 0.5 * k1 * c + 5.0 / 16.0 * k2 * (1.5 * c * c - 0.5)
        share = s["body_albedo"] * reflected + 0.25 * s["body_emissivity"]
        near = s["au"] / d
        light = s["srp_pressure"] * s["srp_CrA_m"] * near * near
        return combine([s["albedo_scale"] * light * x * x * share / r], [s.position])
