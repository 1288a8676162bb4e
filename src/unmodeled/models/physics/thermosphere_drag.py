"""Drag in the Earth's thermosphere: day and night, seasons, activity of the Sun."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import atan2, cos, expression, model, sin, sqrt, subs

from unmodeled.core.constants import DAY
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.drag import PARAMETERS as EXPONENTIAL
from unmodeled.models.physics.drag import drag
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import dot, norm

__all__ = ["ThermosphereDrag"]

#: Ballistic coefficient and rotation of the air are the same numbers as in `ExponentialDrag`.
SHARED = tuple(p for p in EXPONENTIAL if p.name in ("drag_B", "drag_omega"))
PARAMETERS = (
    *SHARED,
    Parameter("thermosphere_scale", unit="1", value=1.0, lower=0.0, description="density scale"),
    Parameter(
        "thermosphere_f107", unit="1e-22 W m-2 Hz-1", value=150.0, scale=10.0, lower=0.0,
        description="solar radio flux F10.7 of the day before",
    ),
    Parameter(
        "thermosphere_f107a", unit="1e-22 W m-2 Hz-1", value=150.0, scale=10.0, lower=0.0,
        description="F10.7, mean of 81 days",
    ),
    Parameter(
        "thermosphere_ap", unit="2 nT", value=4.0, scale=10.0, lower=0.0,
        description="geomagnetic index Ap of the day",
    ),
    Parameter(
        "thermosphere_day", unit="d",
        description="days since 1 January, 0 h UT, at time zero",
    ),
    Parameter(
        "thermosphere_R", unit="m", value=6_378_137.0, scale=1e3, lower=1e-6,
        description="equatorial radius of the ellipsoid of heights",
    ),
)  # fmt: skip
#: Flattening of WGS 84, and its equatorial radius in km, in which the network wants heights.
FLATTENING, RADIUS_KM = 1 / 298.257223563, 6378.137
#: Share of the radius from the axis within which longitude fades out.
POLE = 0.02


@dataclass(frozen=True)
class ThermosphereDrag(Effect):
    r"""Drag with the density of NRLMSISE-00, as heyoka's small network ("thermoNET").

    .. math::
        \mathbf a = -\tfrac12 s \rho(h, \varphi, \lambda, t; F, \bar F, A_p)\, B\, v_{rel}
        \mathbf v_{rel}, \qquad
        \mathbf v_{rel} = \mathbf v - \omega \mathbf e_z \times \mathbf r

    Source: [Izzo2024] (the network), [Picone2002] (NRLMSISE-00), [MontenbruckGill2000] Eq. 3.97
    (drag). Earth only, 180 to 1,000 km; above, the network goes on as it likes. Body-fixed axes:
    the model must spin, or day and night stay where they are. ``drag_B`` = Cd A/m; only its product
    with ``thermosphere_scale`` is observable: estimate one of them. Solar and geomagnetic indices
    are constant: for an arc of days, take their means. SI only (days of 86,400 s from
    ``thermosphere_day``).

    Heights are above the ellipsoid, to second order in the flattening (20 m below 1,000 km).
    Within 130 km of the Earth's axis the dependence on longitude fades out, where the network's
    own would jump.

    Size: at 500 km 1e-13 (quiet Sun) to 1e-12 kg/m3 (active), with B = 0.022 m2/kg 7e-8 to 6e-7
    m/s2; the day side has 2 to 4 times the density of the night side at 400 km. The density of
    NRLMSISE-00 itself is right to 15 % in the mean and a factor of two in storms.

    Confused with: `ExponentialDrag` and constant transverse acceleration over less than the
    variation of local time. Not to be combined with `ExponentialDrag`, which is the same force.
    """

    name: ClassVar[str] = "thermosphere_drag"
    axes: ClassVar[str] = "body"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Ballistic coefficient, scale, activity, date, radius."""
        return PARAMETERS

    def acceleration(self, s: Symbols) -> Vector:
        """Return the drag."""
        return drag(s, s["thermosphere_scale"] * self._density(s))

    def _density(self, s: Symbols) -> expression:
        """Density, kg/m3."""
        (x, y, z), radius = s.position, s["thermosphere_R"]
        r = norm(s.position)
        up = z * z / dot(s.position, s.position)
        # Radius of the ellipsoid at this geocentric latitude, to second order.
        surface = radius * (1.0 - FLATTENING * up * (1.0 + 1.5 * FLATTENING * (1.0 - up)))
        height = (r - surface) / radius * RADIUS_KM
        axis = sqrt(x * x + y * y + POLE * POLE * radius * radius)
        latitude = atan2(z, axis) + 2.0 * FLATTENING * radius * z * axis / (r * r * r)
        longitude = expression("_longitude")
        density = model.nrlmsise00_tn(
            [height, latitude, longitude],
            s["thermosphere_f107"],
            s["thermosphere_f107a"],
            s["thermosphere_ap"],
            s["thermosphere_day"] + s.time / DAY.value,
        )
        # The network takes sine and cosine of the longitude; given like this they are smooth at
        # the pole.
        return subs(density, {sin(longitude): y / axis, cos(longitude): x / axis})
