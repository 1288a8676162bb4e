"""Where the values of a known effect come from when the case does not give them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from heyoka import model

from unmodeled.core.constants import GM_OF, RADIUS_OF
from unmodeled.core.earth_orientation import days_since_j2000, pole_at
from unmodeled.core.errors import ConfigError
from unmodeled.datasets.bodies import Body
from unmodeled.models.physics import Effect, SolarRadiationPressure
from unmodeled.pipeline.cases.spacecraft import Spacecraft

__all__ = ["EARTH_MOON", "Surveyed", "egm2008_coefficients", "gm_of", "tidal_values"]

#: The Earth with the Moon as one body at their barycentre: what an asteroid is attracted by.
EARTH_MOON = "earth_moon"

_COEFFICIENT = re.compile(r"([CS])_(\d+)_(\d+)")
_ZONAL = re.compile(r"J(\d+)")
_GM = re.compile(r"GM_(\w+)")
#: Angular momentum of the Earth for each unit of mass, m2/s, [IERS2010] section 10.3.
_EARTH_SPIN = 9.8e8
_MAS = math.radians(1e-3 / 3600.0)


@dataclass(frozen=True)
class Surveyed:
    """What is known of body and spacecraft.

    Parameters
    ----------
    body : Body
        Central body.
    spacecraft : Spacecraft, optional
        Needed by radiation pressure and drag.
    epoch : str
        Time zero; needed by the tides.
    """

    body: Body
    spacecraft: Spacecraft | None = None
    epoch: str = ""

    def value(self, name: str, effect: Effect) -> float | None:
        """Return the accepted value of a parameter of an effect, SI, or None."""
        simple = self._card() | self._craft()
        if name in simple:
            return simple[name]
        if name == "occulter_radius" and isinstance(effect, SolarRadiationPressure):
            known = RADIUS_OF.get(effect.occulter)
            return None if known is None else known.value
        if (found := _ZONAL.fullmatch(name)) is not None:
            return self.body.zonal_unnormalised().get(int(found[1]))
        if (found := _GM.fullmatch(name)) is not None:
            return gm_of(found[1])
        if (found := _COEFFICIENT.fullmatch(name)) is not None:
            return self._coefficient(found[1], int(found[2]), int(found[3]))
        return None

    def air(self, altitude: float) -> dict[str, float]:
        """Return the exponential layer of the body's atmosphere at an altitude, m.

        Raises
        ------
        ConfigError
            If the card has no atmosphere.
        """
        if self.body.atmosphere is None:
            raise ConfigError(
                f"altitude is given for drag, and the card of {self.body.name} has no atmosphere",
                do="give drag_rho0, drag_r0 and drag_H",
            )
        layer = self.body.atmosphere.layer(altitude)
        return {
            "drag_rho0": layer.density,
            "drag_r0": self.body.reference_radius + layer.altitude,
            "drag_H": layer.scale_height,
        }

    def _card(self) -> dict[str, float]:
        body = self.body
        known = {
            "GM": body.gm,
            "R_ref": body.reference_radius,
            "shadow_radius": _radius(body),
            "drag_omega": body.spin_rate,
            "tide_spin": body.spin_rate,
            "sun_radius": RADIUS_OF["sun"].value,
        }
        if body.love_number_k2 is not None:
            known["tide_k2"] = body.love_number_k2
        if body.name == "earth":
            known["lense_thirring_J"] = _EARTH_SPIN
            if self.epoch:
                known |= tidal_values(self.epoch)
        return known

    def _craft(self) -> dict[str, float]:
        craft = self.spacecraft
        if craft is None:
            return {}
        share = craft.area / craft.mass
        return {"srp_CrA_m": craft.reflectivity * share, "drag_B": craft.drag_coefficient * share}

    def _coefficient(self, kind: str, n: int, m: int) -> float | None:
        if self.body.gravity_field == "egm2008":
            return egm2008_coefficients(n).get(f"{kind}_{n}_{m}")
        if n == 0:
            return 1.0
        if m == 0 and n in self.body.zonals:
            return -self.body.zonal_unnormalised()[n] / math.sqrt(2 * n + 1)
        return None


def gm_of(name: str) -> float | None:
    """Gravitational parameter of Sun, Moon or planet, m3/s2; None for another name."""
    if name == EARTH_MOON:
        return GM_OF["earth"].value + GM_OF["moon"].value
    return GM_OF[name].value if name in GM_OF else None


@cache
def tidal_values(epoch: str) -> Mapping[str, float]:
    """Return where time zero and the pole lie, for the tides of the Earth, SI.

    The secular pole is that of [IERS2010], section 7.1.4, revised 2018: 55.0 + 1.677 t and 320.5
    + 3.460 t milliarcseconds, t years since 2000.0.

    Parameters
    ----------
    epoch : str
        Time zero with its scale.

    Raises
    ------
    DataError
        If the epoch cannot be read, or lies outside the table of Earth orientation.
    """
    day = days_since_j2000(epoch)
    pole_x, pole_y = pole_at(epoch)
    years = day / 365.25
    x, y = (55.0 + 1.677 * years) * _MAS, (320.5 + 3.460 * years) * _MAS
    return {
        "tide_day": day,
        "pole_tide_m1": pole_x - x,
        "pole_tide_m2": y - pole_y,
        "pole_tide_x": 1.677 * years * _MAS,
        "pole_tide_y": 3.460 * years * _MAS,
    }


@cache
def egm2008_coefficients(degree: int) -> Mapping[str, float]:
    """Normalised, tide-free coefficients ``C_n_m``, ``S_n_m`` of EGM2008 [Pavlis2012]."""
    table = np.asarray(model.get_egm2008_CS())  # from C_2_0 on
    places = [(n, m) for n in range(2, degree + 1) for m in range(n + 1)]
    found = {"C_0_0": 1.0, "C_1_0": 0.0, "C_1_1": 0.0, "S_1_1": 0.0}
    for (n, m), (c, s) in zip(places, table, strict=False):
        found[f"C_{n}_{m}"] = float(c)
        if m:
            found[f"S_{n}_{m}"] = float(s)
    return found


def _radius(body: Body) -> float:
    return RADIUS_OF[body.name].value if body.name in RADIUS_OF else body.brillouin_radius
