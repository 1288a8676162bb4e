"""Residual learning: a known point mass, and a learner for what it lacks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar, Self

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress, learner_class
from unmodeled.models.learned.point_mass import PointMassOnly

__all__ = ["Residual"]


class Residual(Learner):
    """Point mass at the origin plus a learner of the rest.

    ``learner`` is trained on ``y + gm X / |X|^3`` and the point mass is added back in every
    prediction and Jacobian.  The point mass is known, not fitted: along one orbit a fitted one
    takes up part of the oblateness, which spoils extrapolation.

    Parameters
    ----------
    learner : Learner
        What learns the rest; left unfitted, ``fit`` trains a copy.
    gm : float
        Gravitational parameter of the point mass, in the units of the samples.

    Attributes
    ----------
    learner_ : Learner
        The fitted copy.

    Examples
    --------
    >>> from unmodeled.models.learned.nearest_neighbour import NearestNeighbour
    >>> X = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0], [2.0, 0.0, 0.0]])
    >>> model = Residual(NearestNeighbour(), gm=8.0).fit(X, -8.0 * X)
    >>> model.predict([[0.0, 2.0, 0.0]])
    array([[  0., -16.,   0.]])
    """

    name: ClassVar[str] = "residual"

    learner_: Learner

    def __init__(self, learner: Learner, gm: float = NORMALISED_GM) -> None:
        self.learner = learner
        self.gm = gm
        self.has_covariance = learner.has_covariance
        self.takes_features = learner.takes_features

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        inner = self._rest_noise(X, noise)
        self._prepared().fit(X, self._rest(X, y), inner, progress=progress)

    def _rest(self, X: Array, y: Array) -> Array:
        """Return what the point mass leaves of ``y`` (n, 3)."""
        return y - self._baseline().fit(X[:, :3], y).predict(X[:, :3])

    def _rest_noise(self, X: Array, noise: NoiseLevel) -> NoiseLevel:
        """Return the noise of what is left: position noise still acts on the whole field."""
        own = self._baseline()._jacobian(X[:, :3])
        return replace(noise, gradient=own if noise.gradient is None else own + noise.gradient)

    def _prepared(self) -> Learner:
        """Return the copy of the inner learner that is to be trained."""
        self.learner_ = _copy(self.learner)
        return self.learner_

    def _baseline(self) -> PointMassOnly:
        return PointMassOnly(self.gm)

    def _predict(self, X: Array) -> Array:
        return self._baseline()._predict(X[:, :3]) + self.learner_.predict(X)

    def _jacobian(self, X: Array) -> Array:
        jacobian = np.array(self.learner_.jacobian(X))
        jacobian[:, :, :3] += self._baseline()._jacobian(X[:, :3])
        return jacobian

    def _predict_covariance(self, X: Array) -> Array:
        return self.learner_.predict_covariance(X)

    def facts(self) -> dict[str, float | str]:
        """Return the inner learner's facts, with the point mass."""
        self._require_fitted()
        facts: dict[str, float | str] = {"learner": self.learner_.name, "gm": self.gm}
        return facts | self.learner_.facts()

    def _arrays(self) -> dict[str, Array]:
        inner = {f"learner.{key}": array for key, array in self.learner_._arrays().items()}
        return inner | {
            "learner_samples": np.array([self.learner_.n_samples_, self.learner_.n_inputs_], float)
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        self.learner_ = _copy(self.learner)
        self.learner_._restore({key.removeprefix("learner."): a for key, a in arrays.items()})
        samples, *inputs = (int(number) for number in arrays["learner_samples"])
        self.learner_.n_samples_ = samples
        self.learner_.n_inputs_ = inputs[0] if inputs else 3  # files of before them have none

    def _params_for_json(self) -> dict[str, Any]:
        inner = {"name": self.learner.name, "params": self.learner._params_for_json()}
        return {"learner": inner, "gm": self.gm}

    @classmethod
    def _from_params(cls, params: dict[str, Any]) -> Self:
        inner = params["learner"]
        learner = learner_class(inner["name"])._from_params(inner["params"])
        return cls(learner, gm=params["gm"])


def _copy(learner: Learner) -> Learner:
    """Return an unfitted learner with the same hyperparameters."""
    return learner._from_params(learner._params_for_json())
