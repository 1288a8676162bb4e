"""A trajectory: times, positions, velocities and, where known, accelerations."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import DataError

__all__ = ["Trajectory"]

_MIN_SAMPLES = 4


@dataclass(frozen=True)
class Trajectory:
    """Samples of one orbit about one body, in SI.

    Parameters
    ----------
    times : ndarray (n,)
        Seconds since the epoch, strictly increasing.
    positions : ndarray (n, 3)
        Metres from the body's centre of mass, components along the axes of ``frame``.
    velocities : ndarray (n, 3)
        Metres per second. Always the velocity relative to inertial axes; in a body-fixed
        ``frame`` only the components are turned.
    accelerations : ndarray (n, 3), optional
        Metres per second squared, inertial acceleration, components along ``frame``.
    frame : str
        ``"inertial"`` or ``"body_fixed"``.
    source : str
        Where it comes from: a file name, or ``"simulated"``.
    epoch : str
        ISO date of time zero with its time scale, e.g. ``"2016-03-13T00:00:00 UTC"``; empty if
        the trajectory has none.
    acceleration_sigma : float
        Standard deviation of the error of ``accelerations``, m/s2 (0: exact).
    notes : dict
        Facts about how it was read or made, for the report.

    Raises
    ------
    DataError
        On wrong shapes, NaN, times that are not increasing, fewer than 4 samples, a position at
        the origin, or an unknown frame.
    """

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array | None = None
    frame: str = "inertial"
    source: str = ""
    epoch: str = ""
    acceleration_sigma: float = 0.0
    notes: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        label = self.source or "trajectory"
        put = object.__setattr__
        put(self, "times", as_array(self.times, ("n",), f"{label}: times"))
        put(self, "positions", as_array(self.positions, ("n", 3), f"{label}: positions"))
        put(self, "velocities", as_array(self.velocities, ("n", 3), f"{label}: velocities"))
        lengths = {len(self.times), len(self.positions), len(self.velocities)}
        if self.accelerations is not None:
            put(
                self,
                "accelerations",
                as_array(self.accelerations, ("n", 3), f"{label}: accelerations"),
            )
            lengths.add(len(self.accelerations))
        if len(lengths) != 1:
            raise DataError(f"{label}: columns have different lengths {sorted(lengths)}")
        if len(self.times) < _MIN_SAMPLES:
            raise DataError(
                f"{label} has {len(self.times)} samples",
                allowed=f"at least {_MIN_SAMPLES}",
                do="give a longer trajectory",
            )
        check_increasing(self.times, f"{label}: time")
        if np.any(np.linalg.norm(self.positions, axis=1) == 0.0):
            raise DataError(f"{label}: a position lies at the body's centre")
        if self.frame not in ("inertial", "body_fixed"):
            raise DataError(f"{label}: frame is {self.frame!r}", allowed="inertial, body_fixed")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def states(self) -> Array:
        """Position and velocity side by side, (n, 6)."""
        return np.hstack([self.positions, self.velocities])

    @property
    def radii(self) -> Array:
        """Distance from the centre, m, (n,)."""
        radii: Array = np.linalg.norm(self.positions, axis=1)
        return radii

    def __getitem__(self, index: slice | npt.NDArray[Any]) -> Trajectory:
        """Return the samples selected by a slice, mask or index array (order kept)."""
        acc = None if self.accelerations is None else self.accelerations[index]
        return replace(
            self,
            times=self.times[index],
            positions=self.positions[index],
            velocities=self.velocities[index],
            accelerations=acc,
        )
