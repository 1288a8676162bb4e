"""Drag in an exponential atmosphere that turns with the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import exp, expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, norm

__all__ = ["ExponentialDrag", "drag"]

PARAMETERS = (
    Parameter("drag_B", unit="m2 kg-1", scale=1e-2, description="Cd A / m"),
    Parameter(
        "drag_rho0", unit="kg m-3", value=1.0, scale=1e-12, lower=0.0, description="density at r0"
    ),
    Parameter("drag_r0", unit="m", value=1.0, scale=1e3, lower=0.0, description="radius of rho0"),
    Parameter("drag_H", unit="m", value=1.0, scale=1e3, lower=1e-6, description="scale height"),
    Parameter(
        "drag_omega", unit="rad s-1", scale=1e-5, description="rotation rate of the air about z"
    ),
)


@dataclass(frozen=True)
class ExponentialDrag(Effect):
    r"""Drag of a spherical exponential atmosphere.

    .. math::
        \mathbf a = -\tfrac12 \rho B\, v_{rel} \mathbf v_{rel}, \quad
        \rho = \rho_0 e^{-(r - r_0)/H}, \quad
        \mathbf v_{rel} = \mathbf v - \omega \mathbf e_z \times \mathbf r

    Source: [MontenbruckGill2000] Eq. 3.97 and 3.98 (drag, co-rotation), [Vallado2013] section
    8.6.2 (exponential density). ``drag_B`` = Cd A/m; only ``drag_B`` times ``drag_rho0`` is
    observable: estimate one of them. Inertial axes, z along the spin axis. The altitude is
    spherical, r - r0: over an Earth orbit the flattening moves it by up to 21 km, a factor of
    1.4 in the density for H = 60 km. No bulge, no solar activity.

    Size: at 500 km (5e-13 kg/m3, B = 0.022 m2/kg) 3e-7 m/s2; da/dt = -rho B v a on a circular
    orbit without rotation of the air.

    Confused with: constant transverse acceleration (the same on a circular orbit) and A2.
    Partials do not exist where the relative velocity is zero. Not to be combined with free
    `ConstantRTN` on a near-circular orbit.
    """

    name: ClassVar[str] = "exponential_drag"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Ballistic coefficient and the atmosphere."""
        return PARAMETERS

    def acceleration(self, s: Symbols) -> Vector:
        """Return the drag."""
        density = s["drag_rho0"] * exp((s["drag_r0"] - norm(s.position)) / s["drag_H"])
        return drag(s, density)


def drag(s: Symbols, density: expression) -> Vector:
    """Return the drag in air of this density that turns about z with ``drag_omega``.

    [MontenbruckGill2000] Eq. 3.97 and 3.98, with ``drag_B`` = Cd A/m.
    """
    (x, y, _), (vx, vy, vz) = s.position, s.velocity
    relative: Vector = (vx + s["drag_omega"] * y, vy - s["drag_omega"] * x, vz)
    return combine([-0.5 * density * s["drag_B"] * norm(relative)], [relative])
