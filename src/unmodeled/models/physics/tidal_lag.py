"""What a moon's own tide does to it: the bulge is late, and pulls it forwards or back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.solid_tide import LOVE_NUMBER
from unmodeled.models.physics.vectors import combine, dot
from unmodeled.models.physics.zonal import REFERENCE_RADIUS

__all__ = ["TidalLag"]

PARAMETERS = (
    LOVE_NUMBER,
    Parameter("tide_lag", unit="s", scale=1.0, description="by how much the bulge is late"),
    Parameter("tide_own_GM", unit="m3 s-2", scale=1e9, lower=0.0, description="GM of the moon"),
    Parameter("tide_spin", unit="rad s-1", scale=1e-5, description="spin of the body about z"),
    REFERENCE_RADIUS,
)


@dataclass(frozen=True)
class TidalLag(Effect):
    r"""Tidal dissipation: a moon's own tide on the central body, late by a constant time.

    .. math::
        \mathbf a = -\frac{3 k_2\, \mu R^5 \tau}{r^8} \left[\frac{2 (\mathbf r \cdot \mathbf v)}
        {r^2}\, \mathbf r + \mathbf v - \boldsymbol\omega \times \mathbf r\right]

    with mu the GM of the moon itself and omega the spin about z. Source: [Mignard1979] Eq. 5 (to
    first order in the lag; the part without the lag is a change of the field). Only
    k2 tau mu is observable: estimate ``tide_lag``. The acceleration of the moon is relative to
    a fixed body: where the moon's mass counts, divide by 1 - its share of both.

    Size: the Moon, k2 = 0.305 and tau = 638 s, 3.8 cm a year outwards; Phobos 4 cm a
    year inwards, where the bulge lags by 0.1 degrees. Spacecraft weigh nothing: none.

    Confused with: drag, A2 and a constant transverse acceleration (all alike on a circular
    orbit). Not to be combined with a free one of these.
    """

    name: ClassVar[str] = "tidal_lag"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Love number, lag, mass, spin, radius."""
        return PARAMETERS

    def acceleration(self, s: Symbols) -> Vector:
        """Return the pull of what is late of the bulge."""
        (x, y, _), (vx, vy, vz) = s.position, s.velocity
        spin, radius = s["tide_spin"], s["R_ref"]
        square = dot(s.position, s.position)
        ratio = radius * radius / square
        size = 3.0 * s["tide_k2"] * s["tide_own_GM"] * s["tide_lag"] * radius * ratio * ratio
        size = size / (square * square)
        drift: Vector = (vx + spin * y, vy - spin * x, vz)
        radial = 2.0 * dot(s.position, s.velocity) / square
        return combine([-size * radial, -size], [s.position, drift])
