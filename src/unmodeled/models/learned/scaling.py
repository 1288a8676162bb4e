"""Centre and scale of samples: what every learner does before it learns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError

__all__ = ["Standardiser"]


@dataclass(frozen=True, slots=True)
class Standardiser:
    """Shift and scale inputs and accelerations to order one.

    One scale serves the three axes of the positions, and one serves the three components of the
    accelerations.  A scale for each axis would stretch space, so that a model's accuracy would
    depend on how the frame happens to lie to the orbit plane; it would divide by zero for an
    equatorial orbit; and a Lipschitz bound would not carry over exactly.  Inputs beyond the
    position have other units: each column is scaled by itself, one that does not vary by 1.

    Parameters
    ----------
    x_mean, y_mean : ndarray (d,), (3,)
        Means of inputs and accelerations, in the units of the samples.
    x_scale, y_scale : float
        Root mean square of the centred components, positive, in the units of the samples.
    other_scales : ndarray (d - 3,)
        The same of each input beyond the position.
    """

    x_mean: Array
    y_mean: Array
    x_scale: float
    y_scale: float
    other_scales: Array = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(cls, X: Array, y: Array) -> Self:
        """Take centre and scale from samples ``X`` (n, d) and ``y`` (n, 3).

        Raises
        ------
        DataError
            If all positions are the same point.

        Examples
        --------
        >>> X = np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 2.0, 0.0], [2.0, -2.0, 0.0]])
        >>> s = Standardiser.of(X, 10 * X)
        >>> s.slope, float(np.round(np.mean(s.positions(X) ** 2), 12))
        (10.0, 1.0)
        """
        x_mean, y_mean = X.mean(axis=0), y.mean(axis=0)
        x_scale = float(np.sqrt(np.mean((X[:, :3] - x_mean[:3]) ** 2)))
        y_scale = float(np.sqrt(np.mean((y - y_mean) ** 2)))
        # Below this share the spread is the rounding of the mean, not a signal.
        if x_scale <= 1e-13 * float(np.abs(X[:, :3]).max()):
            raise DataError(
                f"all {len(X)} training positions are the same point",
                allowed="positions that differ",
            )
        if y_scale <= 1e-13 * float(np.abs(y).max()):
            y_scale = 1.0  # a constant field: the mean says it all
        other = np.sqrt(np.mean((X[:, 3:] - x_mean[3:]) ** 2, axis=0))
        size = np.abs(X[:, 3:]).max(axis=0, initial=0.0)
        return cls(x_mean, y_mean, x_scale, y_scale, np.where(other > 1e-13 * size, other, 1.0))

    @property
    def slope(self) -> float:
        """Acceleration per length of a unit slope between scaled coordinates."""
        return self.y_scale / self.x_scale

    @property
    def x_scales(self) -> Array:
        """Scale (d,) of each input."""
        return np.concatenate([np.full(3, self.x_scale), self.other_scales])

    @property
    def slopes(self) -> Array:
        """Acceleration per input (d,) of a unit slope between scaled coordinates."""
        return self.y_scale / self.x_scales

    def positions(self, X: Array) -> Array:
        """Return scaled inputs (n, d)."""
        return (X - self.x_mean) / self.x_scales

    def targets(self, y: Array) -> Array:
        """Return scaled accelerations (n, 3)."""
        return (y - self.y_mean) / self.y_scale

    def accelerations(self, scaled: Array) -> Array:
        """Undo ``targets``: accelerations (n, 3) in the units of the samples."""
        return self.y_mean + self.y_scale * scaled

    def arrays(self) -> dict[str, Array]:
        """Return the state as named arrays, for ``Learner._arrays``."""
        return {
            "x_mean": self.x_mean,
            "y_mean": self.y_mean,
            "scales": np.array([self.x_scale, self.y_scale, *self.other_scales]),
        }

    @classmethod
    def restore(cls, arrays: dict[str, Array]) -> Self:
        """Take back what ``arrays`` returned."""
        scales = arrays["scales"]
        if len(scales) != len(arrays["x_mean"]) - 1:
            raise ValueError("scales and means of different numbers of inputs")
        return cls(
            arrays["x_mean"], arrays["y_mean"], float(scales[0]), float(scales[1]), scales[2:]
        )
