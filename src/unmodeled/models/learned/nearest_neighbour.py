"""Nearest neighbour: the acceleration of the nearest sample, the least a learner must beat."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree

from unmodeled.core.arrays import Array
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["NearestNeighbour"]


class NearestNeighbour(Learner):
    """The acceleration of the nearest sample, unchanged.

    A baseline without hyperparameters: it shows how much of an interpolation score is due to
    dense sampling alone.  With inputs beyond the position, near is meant in scaled inputs.

    Notes
    -----
    The prediction is constant on each sample's Voronoi cell, so ``jacobian`` is zero almost
    everywhere; on the faces between cells, where the prediction jumps and has no derivative, it
    is zero as well.  An integrator that controls its step will feel the jumps.
    """

    name: ClassVar[str] = "nearest_neighbour"
    min_samples: ClassVar[int] = 1
    takes_features = True

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        scales = np.ones(3) if X.shape[1] == 3 else Standardiser.of(X, y).x_scales
        self._restore({"x": X.copy(), "y": y.copy(), "scales": scales})
        progress(1.0)

    def _predict(self, X: Array) -> Array:
        _, nearest = self._tree.query(X / self._scales)
        return self._y[nearest]

    def _jacobian(self, X: Array) -> Array:
        return np.zeros((len(X), 3, X.shape[1]))

    def _arrays(self) -> dict[str, Array]:
        return {"x": self._x, "y": self._y, "scales": self._scales}

    def _restore(self, arrays: dict[str, Array]) -> None:
        self._x, self._y = arrays["x"], arrays["y"]
        self._scales = arrays.get("scales", np.ones(3))  # files of before have none
        self._tree = cKDTree(self._x / self._scales)
