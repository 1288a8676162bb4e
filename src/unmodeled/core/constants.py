"""Physical constants with unit and source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

__all__ = [
    "ASTRONOMICAL_UNIT",
    "DAY",
    "EARTH_ROTATION_RATE",
    "GM_OF",
    "OBLIQUITY_J2000",
    "RADIUS_OF",
    "SPEED_OF_LIGHT",
    "Constant",
    "G",
]


@dataclass(frozen=True, slots=True)
class Constant:
    """A constant of nature or of convention.

    Parameters
    ----------
    value : float
        Value in ``unit``.
    unit : str
        SI unit.
    source : str
        Key into REFERENCES.md.
    """

    value: float
    unit: str
    source: str


G = Constant(6.67430e-11, "m3 kg-1 s-2", "CODATA2018")
SPEED_OF_LIGHT = Constant(299_792_458.0, "m s-1", "SI2019")
ASTRONOMICAL_UNIT = Constant(149_597_870_700.0, "m", "IAU2012B2")
DAY = Constant(86_400.0, "s", "SI2019")
EARTH_ROTATION_RATE = Constant(7.292115e-5, "rad s-1", "IERS2010")
#: Inclination of the ecliptic of J2000 to the ICRF's xy-plane in JPL's heliocentric elements
#: (IAU 1976 value, 84381.448 arcseconds).
OBLIQUITY_J2000 = Constant(84_381.448 * 4.84813681109536e-6, "rad", "Lieske1979")


def _gm(km3_s2: float) -> Constant:
    return Constant(km3_s2 * 1e9, "m3 s-2", "Park2021")


#: Gravitational parameters of DE440; from Mars outwards those of the planet with its satellites.
#: They go with TDB: those of body cards that go with TT are larger by a share of 1.5e-8.
GM_OF: Mapping[str, Constant] = MappingProxyType(
    {
        "sun": _gm(132_712_440_041.279419),
        "mercury": _gm(22_031.868551),
        "venus": _gm(324_858.592),
        "earth": _gm(398_600.435507),
        "moon": _gm(4_902.800118),
        "mars": _gm(42_828.375816),
        "jupiter": _gm(126_712_764.1),
        "saturn": _gm(37_940_584.8418),
        "uranus": _gm(5_794_556.4),
        "neptune": _gm(6_836_527.10058),
    }
)

#: Radii for shadows and occultations: nominal radius of the Sun, equatorial radius of a planet,
#: mean radius of the Moon.
RADIUS_OF: Mapping[str, Constant] = MappingProxyType(
    {
        "sun": Constant(6.957e8, "m", "IAU2015B3"),
        "mercury": Constant(2_439_700.0, "m", "Archinal2011"),
        "venus": Constant(6_051_800.0, "m", "Archinal2011"),
        "earth": Constant(6_378_136.6, "m", "Archinal2011"),
        "moon": Constant(1_737_400.0, "m", "Archinal2011"),
        "mars": Constant(3_396_190.0, "m", "Archinal2011"),
        "jupiter": Constant(71_492_000.0, "m", "Archinal2011"),
        "saturn": Constant(60_268_000.0, "m", "Archinal2011"),
        "uranus": Constant(25_559_000.0, "m", "Archinal2011"),
        "neptune": Constant(24_764_000.0, "m", "Archinal2011"),
    }
)
