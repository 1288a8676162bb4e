"""Physical constants with unit and source."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["ASTRONOMICAL_UNIT", "DAY", "EARTH_ROTATION_RATE", "SPEED_OF_LIGHT", "Constant", "G"]


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
