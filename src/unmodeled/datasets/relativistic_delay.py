"""Delay of the signal in the Earth's gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import heyoka as hy

from unmodeled.core.constants import GM_OF, SPEED_OF_LIGHT
from unmodeled.core.parameters import Parameter
from unmodeled.datasets.path_correction import Link, PathCorrection, PathEffect, length

__all__ = ["RelativisticDelay"]

#: Length that the mass of the Earth stands for, m.
_LENGTH = 2.0 * GM_OF["earth"].value / SPEED_OF_LIGHT.value**2


@dataclass(frozen=True)
class _Shapiro(PathCorrection):
    def expression(self, link: Link) -> hy.expression:
        ends = length(link.craft) + length(link.station)
        return _LENGTH * hy.log((ends + link.distance) / (ends - link.distance))


@dataclass(frozen=True)
class RelativisticDelay(PathEffect):
    r"""Light is slower near a mass (Shapiro): range + s D, with the Earth's mass.

    .. math::
        D = \frac{2 GM}{c^2} \ln \frac{r_1 + r_2 + \rho}{r_1 + r_2 - \rho}

    s = 1 in general relativity; r1, r2 are the distances of both ends from the centre. The delay
    in the Sun's field, which is nearly the same for a whole pass, is left out. All data sets of one
    station share it. Earth only.

    Size: 6 to 10 mm for LAGEOS, 13 to 18 mm for GPS satellites, 4 cm at the Moon. Confused with:
    range bias, scale. Source: [IERS2010] Eq. 11.17.
    """

    name: ClassVar[str] = "relativistic_delay"
    kinds: ClassVar[tuple[str, ...]] = ("range", "range_rate")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its strength, without unit."""
        return (self._parameter("relativistic_delay", "1", 1.0, "delay over that of Einstein"),)

    @property
    def correction(self) -> PathCorrection:
        """The delay of general relativity."""
        return _Shapiro()
