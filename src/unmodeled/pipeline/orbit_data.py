"""Noisy positions and accelerations of one orbit: two looks at every place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from unmodeled.core.arrays import Array

__all__ = ["OrbitData", "kepler_acceleration", "kepler_place"]

#: Largest acceleration noise, as a share of an acceleration, that can be read as a place.
_CLEAR = 0.1


@dataclass(frozen=True)
class OrbitData:
    """Samples of one trajectory, in the units of ``gm``.

    Parameters
    ----------
    times : ndarray (n,)
        Increasing.
    positions, accelerations : ndarray (n, 3)
        Observed, inertial axes. Those of the accelerations belong to a place that is as uncertain
        as the position, and another draw.
    position_noise, acceleration_noise : float
        Standard deviations on each axis; the first is positive.
    gm : float
        Of the body.
    """

    times: Array
    positions: Array
    accelerations: Array
    position_noise: float
    acceleration_noise: float
    gm: float

    def part(self, rows: slice) -> OrbitData:
        """Return some of the samples, next to each other."""
        return replace(
            self,
            times=self.times[rows],
            positions=self.positions[rows],
            accelerations=self.accelerations[rows],
        )

    def place_spread(self, places: Array) -> Array:
        """Return how uncertain places read off accelerations are, (n,); inf for no use.

        The noise of the acceleration moves one by at most r^3 / gm of it.
        """
        size = np.linalg.norm(self.accelerations, axis=1)
        far = np.linalg.norm(places, axis=1)
        spread = np.hypot(self.position_noise, self.acceleration_noise * far**3 / self.gm)
        return np.where(self.acceleration_noise < _CLEAR * size, spread, np.inf)

    def averaged(self) -> tuple[Array, Array]:
        """Return positions (n, 3) from both looks and their standard deviations (n,)."""
        places = kepler_place(self.accelerations, self.gm)
        share = (self.position_noise / self.place_spread(places)) ** 2
        places = np.where(share[:, None] > 0, places, 0.0)
        mean = (self.positions + share[:, None] * places) / (1.0 + share[:, None])
        return mean, self.position_noise / np.sqrt(1.0 + share)


def kepler_acceleration(places: Array, gm: float) -> Array:
    """Return the pull (n, 3) of a point mass at places (n, 3)."""
    pull: Array = -gm * places / np.linalg.norm(places, axis=1)[:, None] ** 3
    return pull


def kepler_place(accelerations: Array, gm: float) -> Array:
    """Return the places (n, 3) where a point mass pulls like this; an acceleration of 0: far off.

    Of a body that is nearly a point mass the error is its oblateness over the radius: small beside
    noise that is a good part of a radius, however near or far the noise takes a place.
    """
    size = np.maximum(np.linalg.norm(accelerations, axis=1), 1e-300)[:, None]
    return np.asarray(-accelerations / size * np.sqrt(gm / size))
