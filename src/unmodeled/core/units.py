"""Normalised units: the length and time that make orbit numbers of order one.

With the Brillouin radius as length and the Kepler period of a circular orbit there as time, the
gravitational parameter is 4 pi^2 for every body; positions are 1-3 and accelerations 1-40 in the
range of orbits of [Neamati2022] Table 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from unmodeled.core.errors import ConfigError

__all__ = ["NORMALISED_GM", "NormalisedUnits"]

#: Gravitational parameter in normalised units, for every body.
NORMALISED_GM = 4.0 * math.pi**2


@dataclass(frozen=True, slots=True)
class NormalisedUnits:
    """Length and time units in SI.

    Parameters
    ----------
    length : float
        Metres in one unit of length.
    time : float
        Seconds in one unit of time.

    Examples
    --------
    >>> u = NormalisedUnits.of_body(gm=4.89, radius=290.0)
    >>> round(u.time), round(u.acceleration * 1e6, 3)
    (14032, 1.473)
    """

    length: float
    time: float

    def __post_init__(self) -> None:
        for name, value in (("length", self.length), ("time", self.time)):
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"normalised unit of {name} is {value}", allowed="a number > 0")

    @classmethod
    def of_body(cls, gm: float, radius: float) -> NormalisedUnits:
        """Units in which ``radius`` (m) is 1 and ``gm`` (m3/s2) is 4 pi^2."""
        for name, value in (("gm", gm), ("radius", radius)):
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"{name} is {value}", allowed="a number > 0")
        return cls(length=radius, time=2 * math.pi * math.sqrt(radius**3 / gm))

    @property
    def velocity(self) -> float:
        """Metres per second in one unit of velocity."""
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        """Metres per second squared in one unit of acceleration."""
        return self.length / self.time**2
