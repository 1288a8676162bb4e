"""Measurements of an orbit: what was measured, when, and how well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import DataError

__all__ = ["Measurements"]

_COMPONENTS: dict[str, tuple[str, ...]] = {
    "position": ("x", "y", "z"),
    "position_velocity": ("x", "y", "z", "vx", "vy", "vz"),
}


@dataclass(frozen=True)
class Measurements:
    """Measurements of one kind along one arc.

    Parameters
    ----------
    kind : {"position", "position_velocity"}
        Positions, or positions and velocities, relative to the body's centre, inertial axes.
    times : ndarray (n,)
        Seconds since the epoch, strictly increasing.
    values : ndarray (n, 3) or (n, 6)
        m, and m/s.
    sigma : array_like
        Standard deviation of each component: a number for positions, a pair (m, m/s) for
        positions and velocities, or an array of the shape of ``values``. Never assumed.
    label : str
        Name in tables, e.g. the file.

    Raises
    ------
    DataError
        On a wrong shape, values that are not finite, unsorted times, or a sigma that is not
        positive.
    """

    kind: Literal["position", "position_velocity"]
    times: Array
    values: Array
    sigma: npt.ArrayLike
    label: str = "measurements"

    def __post_init__(self) -> None:
        if self.kind not in _COMPONENTS:
            raise DataError(f'{self.label}: kind is "{self.kind}"', allowed=", ".join(_COMPONENTS))
        put = object.__setattr__
        put(self, "times", as_array(self.times, ("n",), f"{self.label}: times"))
        check_increasing(self.times, f"{self.label}: time")
        shape = (len(self.times), len(self.components))
        put(self, "values", as_array(self.values, shape, f"{self.label}: values"))
        sigma = np.asarray(self.sigma, dtype=np.float64)
        if self.kind == "position_velocity" and sigma.shape == (2,):
            sigma = np.repeat(sigma, 3)
        elif sigma.shape != shape and not (sigma.shape == () and self.kind == "position"):
            raise DataError(
                f"{self.label}: sigma has shape {sigma.shape}",
                allowed=f"a number for positions, a pair (m, m/s) for states, or shape {shape}",
            )
        full = np.broadcast_to(sigma, shape).copy()
        bad = ~(np.isfinite(full) & (full > 0))
        if bad.any():
            raise DataError(
                f"{self.label}: sigma is {float(full[bad][0])}", allowed="standard deviations > 0"
            )
        put(self, "sigma", full)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the columns of ``values``."""
        return _COMPONENTS[self.kind]

    @property
    def sigmas(self) -> Array:
        """Standard deviations, the shape of ``values``."""
        return np.asarray(self.sigma, dtype=np.float64)

    def predicted(self, states: Array) -> Array:
        """Return what would be measured at states (n, 6)."""
        return states[:, : len(self.components)]

    def partials(self, states: Array) -> Array:
        """Return d predicted / d state, (n, k, 6)."""
        k = len(self.components)
        return np.broadcast_to(np.eye(6)[:k], (len(states), k, 6))
