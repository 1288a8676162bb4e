"""A table of exponential atmospheres, layer by layer."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError

__all__ = ["Atmosphere", "Layer"]


class Layer(NamedTuple):
    """One exponential layer: density ``density`` exp(-(h - altitude) / scale_height).

    ``altitude`` (m) of its base, ``density`` there (kg/m3), ``scale_height`` (m).
    """

    altitude: float
    density: float
    scale_height: float


@dataclass(frozen=True)
class Atmosphere:
    """Density that falls exponentially, with another scale height in each layer.

    A mean over solar activity: at 500 km the density of a day differs from it by up to a factor of
    ten.

    Parameters
    ----------
    layers : tuple of Layer
        With altitudes that increase, above the card's ``reference_radius``.

    Raises
    ------
    ConfigError
        If there is no layer, a number is not finite, a density or scale height is not positive, or
        the altitudes do not increase.
    """

    layers: tuple[Layer, ...]

    def __post_init__(self) -> None:
        if not self.layers:
            raise ConfigError("the atmosphere has no layers", do="give at least one")
        for number, layer in enumerate(self.layers, start=1):
            if not all(math.isfinite(v) for v in layer):
                raise ConfigError(
                    f"atmosphere: layer {number} is {list(layer)}", allowed="finite numbers"
                )
            for name in ("density", "scale_height"):
                if not getattr(layer, name) > 0:
                    raise ConfigError(
                        f"atmosphere: {name} of layer {number} is {getattr(layer, name):g}",
                        allowed="a number > 0",
                    )
        bases = [layer.altitude for layer in self.layers]
        if any(low >= high for low, high in itertools.pairwise(bases)):
            raise ConfigError(
                "atmosphere: the altitudes of the layers do not increase",
                do="sort the layers from the lowest",
            )

    def layer(self, altitude: float) -> Layer:
        """Return the layer that holds ``altitude`` (m); the first one also below its base."""
        inside = [layer for layer in self.layers if layer.altitude <= altitude]
        return inside[-1] if inside else self.layers[0]

    def density(self, altitudes: npt.ArrayLike) -> Array:
        """Return the density at ``altitudes`` (n,) in m, kg/m3, [Vallado2013] Eq. 8-33.

        It jumps by up to a few per cent from layer to layer, as the source's table does.
        """
        h = as_array(altitudes, ("n",), "altitudes")
        table = np.array(self.layers)
        row = np.clip(np.searchsorted(table[:, 0], h, side="right") - 1, 0, None)
        base, density, scale = table[row].T
        values: Array = density * np.exp((base - h) / scale)
        return values
