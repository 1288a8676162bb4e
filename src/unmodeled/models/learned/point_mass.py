"""The known point mass, in normalised units: the baseline of residual learning."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress

__all__ = ["PointMassOnly"]


class PointMassOnly(Learner):
    """The known point mass; learns nothing. The score that any learner has to beat.

    Acceleration -gm x / r^3, [Scheeres2012] Eq. 2.1.

    Parameters
    ----------
    gm : float
        Gravitational parameter in the units of the samples.

    Raises
    ------
    ConfigError
        On ``fit``, if gm is not positive.
    DataError
        On ``predict``, at the origin.
    """

    name: ClassVar[str] = "point_mass"
    stands_alone: ClassVar[bool] = True

    def __init__(self, gm: float = NORMALISED_GM) -> None:
        self.gm = gm

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        if not (math.isfinite(self.gm) and self.gm > 0):
            raise ConfigError(f"{self.name}: gm is {self.gm}", allowed="a number > 0")
        progress(1.0)

    def _predict(self, X: Array) -> Array:
        return -self.gm * X / self._radius(X)[:, None] ** 3

    def _jacobian(self, X: Array) -> Array:
        radius = self._radius(X)[:, None, None]
        unit = X[:, :, None] / radius
        gradient: Array = self.gm / radius**3 * (3.0 * unit * np.swapaxes(unit, 1, 2) - np.eye(3))
        return gradient

    def _radius(self, X: Array) -> Array:
        """Return |x|, (n,)."""
        radius: Array = np.sqrt((X**2).sum(axis=1))
        if (radius == 0.0).any():
            raise DataError(
                f"position {int(np.argmin(radius))} is the origin, where a point mass has no "
                "acceleration",
                allowed="positions away from the origin",
            )
        return radius

    def _arrays(self) -> dict[str, Array]:
        return {"gm": np.array([self.gm])}

    def _restore(self, arrays: dict[str, Array]) -> None:
        """Do nothing: the mass is a hyperparameter."""
