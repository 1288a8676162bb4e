"""What the Earth's field does when its pole moves."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import ClassVar

from heyoka import expression, model

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.tidal_arguments import harmonics
from unmodeled.models.physics.zonal import REFERENCE_RADIUS

__all__ = ["PoleTide"]

PARAMETERS = (
    Parameter("pole_tide_scale", unit="1", value=1.0, description="pole tide; 0: none"),
    Parameter(
        "pole_tide_m1", unit="rad", scale=1e-6, description="pole from its mean place, along x"
    ),
    Parameter(
        "pole_tide_m2", unit="rad", scale=1e-6, description="pole from its mean place, along -y"
    ),
    Parameter(
        "pole_tide_x", unit="rad", scale=1e-6, description="mean pole from that of the field, x"
    ),
    Parameter(
        "pole_tide_y", unit="rad", scale=1e-6, description="mean pole from that of the field, y"
    ),
)
#: Solid Earth, [IERS2010] section 6.4: 1.333e-9 an arcsecond of m, with a lag of 0.0115.
_SOLID, _LAG = 1.333e-9 * 206264.80624709636, 0.0115
#: Oblateness that follows the mean pole, [IERS2010] Eq. 6.5 (C22 and S22 add half a percent).
_C20, _C22, _S22 = -4.841694552e-4, 2.4393836e-6, -1.4002737e-6


@dataclass(frozen=True)
class PoleTide(Effect):
    r"""Pole tide of the solid Earth, and the figure that follows the mean pole.

    .. math::
        \Delta\bar C_{21} = s\left[-k\,(m_1 + 0.0115\,m_2)
        + (\sqrt3\,\bar C_{20} - \bar C_{22})\,x + \bar S_{22}\,y\right], \qquad
        \Delta\bar S_{21} = s\left[-k\,(m_2 - 0.0115\,m_1)
        - (\sqrt3\,\bar C_{20} + \bar C_{22})\,y - \bar S_{22}\,x\right]

    Source: [IERS2010] section 6.4 (k = 1.333e-9 an arcsecond) and Eq. 6.5. m1, m2: the pole less
    its mean place, ``x_p - x`` and ``-(y_p - y)``; x, y: by how much the mean pole has moved since
    the epoch of the field, whose C21 and S21 hold it as it was then. All four stand still: an arc
    is short against 430 days. Earth only; body-fixed axes of the ITRF. ``pole_tide_scale`` is 1
    for the Earth, 0 for none. The pole tide of the oceans, a tenth, is left out.

    Size: 1e-10 to 4e-10 in C21, S21; 2e-10 m/s2 at LAGEOS.

    Confused with: C21, S21. Not to be combined with a field whose C21 and S21 follow the pole.
    """

    name: ClassVar[str] = "pole_tide"
    axes: ClassVar[str] = "body"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Scale, pole, mean pole, GM, reference radius."""
        return (*PARAMETERS, GM, REFERENCE_RADIUS)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of `potential`."""
        ax, ay, az = model.sh_gravity_acc(list(s.position), _field(s), **_settings(s))
        return ax, ay, az

    def potential(self, s: Symbols) -> expression:
        """Return the force function."""
        return model.sh_gravity_pot(list(s.position), _field(s), **_settings(s))


def _settings(s: Symbols) -> dict[str, expression | int]:
    scaled = s["pole_tide_scale"] * s["GM"]
    return {"mu": scaled, "a": s["R_ref"], "max_degree": 2, "max_order": 1}


def _field(s: Symbols) -> list[tuple[expression, expression]]:
    m1, m2, x, y = (s[f"pole_tide_{k}"] for k in ("m1", "m2", "x", "y"))
    c = -_SOLID * (m1 + _LAG * m2) + (sqrt(3.0) * _C20 - _C22) * x + _S22 * y
    sine = -_SOLID * (m2 - _LAG * m1) - (sqrt(3.0) * _C20 + _C22) * y - _S22 * x
    return harmonics({(2, 1): (c, sine)}, 2)
