"""Sunlight on a satellite with wings, without a model of it: the CODE orbit model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.shadow import (
    SHADOW_RADIUS,
    SUN_RADIUS,
    shadow_edges,
    sunlit_share,
)
from unmodeled.models.physics.vectors import combine, cross, dot, norm

__all__ = ["EmpiricalSunlight"]

PARAMETERS = tuple(
    Parameter(f"ecom_{k}", unit="m s-2", scale=1e-9, description=words)
    for k, words in (
        ("D0", "constant towards the Sun"),
        ("Y0", "constant along the solar panels"),
        ("B0", "constant along the third axis"),
        ("Bc", "third axis, cosine"),
        ("Bs", "third axis, sine"),
    )
)


@dataclass(frozen=True)
class EmpiricalSunlight(Effect):
    r"""Radiation pressure of a satellite that turns its panels to the Sun: five constants (ECOM).

    .. math::
        \mathbf a = \nu\,[D_0 \mathbf e_D + Y_0 \mathbf e_Y
        + (B_0 + B_c \cos\Delta u + B_s \sin\Delta u)\, \mathbf e_B], \qquad
        \mathbf e_D = \frac{\mathbf s - \mathbf r}{|\mathbf s - \mathbf r|}, \quad
        \mathbf e_Y = -\frac{\mathbf e_r \times \mathbf e_D}{|\mathbf e_r \times \mathbf e_D|},
        \quad \mathbf e_B = \mathbf e_D \times \mathbf e_Y

    Source: [Arnold2015] Eq. 1-3 and [Springer1999]; u counts the argument of latitude from that of
    the Sun. e_D points *to* the Sun: D0 of sunlight is negative. No fall with the distance from
    the Sun. nu as in `SolarRadiationPressure`. The axes break down where Sun, satellite and body
    are in line, the angle where the Sun stands over the orbit plane.

    Size: GPS satellites D0 -1e-7, Y0 up to 1e-9, the B terms 1e-10 to 1e-9 m/s2.

    Confused with: D0 is `SolarRadiationPressure`; once-per-revolution terms, constant inertial
    acceleration. Not to be combined with it if D0 is free, nor with free `OncePerRevolutionRTN`.

    Parameters
    ----------
    shadow : bool
        False: always in sunlight.
    """

    shadow: bool = True
    name: ClassVar[str] = "empirical_sunlight"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Five constants; radii of body and Sun for the shadow."""
        return (*PARAMETERS, *((SHADOW_RADIUS, SUN_RADIUS) if self.shadow else ()))

    @property
    def bodies(self) -> tuple[str, ...]:
        """The Sun."""
        return ("sun",)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the sum along the three axes."""
        one, sun = expression(1.0), s.bodies["sun"]
        to_sun = combine([one, -one], [sun, s.position])
        to_d = combine([one / norm(to_sun)], [to_sun])
        across = cross(to_d, s.position)
        to_y = combine([one / norm(across)], [across])
        normal = cross(s.position, s.velocity)
        # Sun's direction in the orbit plane (times h^2), and 90 degrees on (times h).
        on = cross(normal, sun)
        noon = cross(on, normal)
        size = norm(noon) * norm(s.position)
        cosine = dot(s.position, noon) / size
        sine = dot(s.position, on) * norm(normal) / size
        third = s["ecom_B0"] + s["ecom_Bc"] * cosine + s["ecom_Bs"] * sine
        light = sunlit_share(s) if self.shadow else one
        parts = (s["ecom_D0"], s["ecom_Y0"], third)
        return combine([light * p for p in parts], [to_d, to_y, cross(to_d, to_y)])

    def edges(self, s: Symbols) -> tuple[expression, ...]:
        """Zero at entry into the penumbra and at exit from it."""
        return (shadow_edges(s),) if self.shadow else ()
