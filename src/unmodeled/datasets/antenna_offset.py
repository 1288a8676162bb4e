"""What was measured is not the centre of mass: antenna, reflector, centre of light."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.parameters import Parameter
from unmodeled.datasets.measurement_effect import MeasurementEffect
from unmodeled.datasets.measurements import Measurements

__all__ = ["AntennaOffset"]


@dataclass(frozen=True)
class AntennaOffset(MeasurementEffect):
    """The measured point lies off the centre of mass: r + d, along radial, transverse, normal axes.

    For a spacecraft that keeps its attitude to the orbit's axes; the offset turns with them. One
    that lies along the line of sight (the reflectors of a sphere: 0.251 m for LAGEOS) is a
    `RangeBias`. Size: 0.1 to 3 m (antenna of a large satellite), 1 % of the size of a body that is
    seen by its light. Confused with: GM and `Scale` (radial), `TimeTag` (transverse: d = v dt), the
    orbit's node and inclination not at all (normal: the plane misses the centre).
    Source: [MontenbruckGill2000] chapter 6.
    """

    name: ClassVar[str] = "antenna_offset"
    kinds: ClassVar[tuple[str, ...]] = (
        "position",
        "position_velocity",
        "range",
        "range_rate",
        "right_ascension_declination",
        "azimuth_elevation",
    )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The offset, m."""
        words = {"R": "radial", "T": "transverse", "N": "normal"}
        return tuple(
            self._parameter(f"antenna_{k}", "m", 1.0, f"{word} offset of what is measured")
            for k, word in words.items()
        )

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        return replace(m, antenna=np.asarray(m.antenna) + np.array(values))

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return the derivative by the offset."""
        return m.antenna_partials(states)
