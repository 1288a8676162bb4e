"""Bending of the line of sight in the Earth's atmosphere."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import heyoka as hy

from unmodeled.core.parameters import Parameter
from unmodeled.datasets.path_correction import Link, PathCorrection, PathEffect

__all__ = ["Refraction"]

_DEGREE = math.pi / 180.0
#: Degrees: below this elevation the bending stays, and how softly it does.
_LOWEST, _SOFT = -1.0, 0.5


@dataclass(frozen=True)
class _Bent(PathCorrection):
    def expression(self, link: Link) -> hy.expression:
        raw = hy.asin(link.sine_of_elevation) / _DEGREE
        over = raw - _LOWEST
        h = _LOWEST + 0.5 * (over + hy.sqrt(over * over + _SOFT * _SOFT))
        return 1.02 / 60.0 * _DEGREE / hy.tan((h + 10.3 / (h + 5.11)) * _DEGREE)


@dataclass(frozen=True)
class Refraction(PathEffect):
    r"""The air bends the line of sight: elevation + s R(E), with E the true elevation.

    .. math::
        R = 1.02' \cot\left(E + \frac{10.3}{E + 5.11}\right) \quad (E \text{ in degrees})

    s = 1 is the air of 1010 hPa and 10 C in visible light; s grows with pressure and falls with
    temperature, radio waves in moist air have up to 1.3. Here R stops growing softly
    below -1 degree. All data sets of one station share it. Earth only.

    Size: 60 arc seconds (3e-4 rad) at 45 degrees, 5.4 arc minutes at 10, half a degree at the
    horizon. Confused with: bias of the elevation (if all are alike), the station's position.
    Source: [Meeus1998] Eq. 16.4 (Saemundsson); 5 % above the theory of a standard atmosphere.
    """

    name: ClassVar[str] = "refraction"
    kinds: ClassVar[tuple[str, ...]] = ("azimuth_elevation",)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its strength, without unit."""
        return (self._parameter("refraction_scale", "1", 1.0, "bending in standard ones"),)

    @property
    def correction(self) -> PathCorrection:
        """The bending of standard air."""
        return _Bent()
