"""Lift and side force of a spacecraft in thin air."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import exp, expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.drag import PARAMETERS as EXPONENTIAL
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, cross, norm

__all__ = ["AerodynamicLift"]

#: The air is that of `ExponentialDrag`.
AIR = tuple(p for p in EXPONENTIAL if p.name != "drag_B")
PARAMETERS = (
    Parameter("lift_B", unit="m2 kg-1", scale=1e-3, description="Cl A / m, upwards"),
    Parameter("side_B", unit="m2 kg-1", scale=1e-3, description="Cs A / m, along r x v"),
)


@dataclass(frozen=True)
class AerodynamicLift(Effect):
    r"""Forces of the air across the motion: lift and side force, in the air of `ExponentialDrag`.

    .. math::
        \mathbf a = \tfrac12 \rho v_{rel}^2 (B_L \mathbf e_L + B_S \mathbf e_S), \quad
        \mathbf e_S = \frac{\mathbf r \times \mathbf v_{rel}}{|\mathbf r \times \mathbf v_{rel}|},
        \quad \mathbf e_L = \frac{\mathbf v_{rel}}{v_{rel}} \times \mathbf e_S

    e_L points up, across the motion relative to the air; e_S to the left of it. Source:
    [Vallado2013] section 8.6.2 (drag; lift and side coefficients in its place). ``lift_B`` =
    Cl A/m, ``side_B`` = Cs A/m.

    Size: 1 to 10 % of the drag of a spacecraft that keeps its attitude; at
    500 km 1e-9 to 1e-8 m/s2. Side force moves node and inclination, lift hardly anything.

    Confused with: constant radial and normal accelerations, wind across the motion (``side_B``),
    once-per-revolution terms. Not to be combined with free `ConstantRTN` on a circular orbit.
    """

    name: ClassVar[str] = "aerodynamic_lift"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Lift, side force and the atmosphere."""
        return (*PARAMETERS, *AIR)

    def acceleration(self, s: Symbols) -> Vector:
        """Return both forces."""
        (x, y, _), (vx, vy, vz) = s.position, s.velocity
        wind: Vector = (vx + s["drag_omega"] * y, vy - s["drag_omega"] * x, vz)
        density = s["drag_rho0"] * exp((s["drag_r0"] - norm(s.position)) / s["drag_H"])
        speed = norm(wind)
        left = cross(s.position, wind)
        side = combine([expression(1.0) / norm(left)], [left])
        up = cross(wind, side)  # of the length of the speed
        push = 0.5 * density * speed
        return combine([push * s["lift_B"], push * speed * s["side_B"]], [up, side])
