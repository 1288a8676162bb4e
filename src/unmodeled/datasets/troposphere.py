"""Delay of the signal in the Earth's lower atmosphere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import heyoka as hy

from unmodeled.core.parameters import Parameter
from unmodeled.datasets.path_correction import Link, PathCorrection, PathEffect

__all__ = ["Troposphere"]

#: Of the mapping function: one at the zenith, 22.4 at the horizon.
_TOP, _FLOOR = 1.001, 0.002001


@dataclass(frozen=True)
class _Mapped(PathCorrection):
    def expression(self, link: Link) -> hy.expression:
        sine = link.sine_of_elevation
        return _TOP / hy.sqrt(_FLOOR + sine * sine)


@dataclass(frozen=True)
class Troposphere(PathEffect):
    r"""The air delays the signal: range + z m(E), range rate + z dm/dt.

    .. math::
        m(E) = \frac{1.001}{\sqrt{0.002001 + \sin^2 E}}

    z is the delay at the zenith of the station; for two ways that of each. The mapping function
    is within 0.7 % of those of [Niell1996] and [Boehm2006] above 5 degrees: 15 cm there, 2 cm at
    17 degrees; below 5 degrees it is too small. No gradients. For elevations see `Refraction`.
    All data sets of one station share it. Earth only.

    Size: 2.3 m at sea level, dry, falling by 12 % a kilometre of height, and 0 to 0.4 m of vapour;
    13 m at 10 degrees. Confused with: the station's height, range bias (both much less with
    low passes), GM and drag over one pass. Source: [BlackEisner1984].
    """

    name: ClassVar[str] = "troposphere"
    kinds: ClassVar[tuple[str, ...]] = ("range", "range_rate")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The delay at the zenith, m."""
        return (self._parameter("zenith_delay", "m", 1.0, "delay at the zenith"),)

    @property
    def correction(self) -> PathCorrection:
        """The mapping function."""
        return _Mapped()
