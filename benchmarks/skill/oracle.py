"""Least squares in the family that the truth is from, where the package has no learner for it."""

from __future__ import annotations

from functools import cache
from typing import ClassVar

import numpy as np

from skill.fields import SHAPE_DEGREE, eros_mesh, shape_gravity
from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import Learner, NoiseLevel, PointMassOnly, Progress
from unmodeled.models.learned.learner import _REGISTRY
from unmodeled.models.physics import Dynamics, PointMass, Polyhedron

__all__ = ["FAMILIES", "NAME", "FamilyOracle", "register"]

NAME = "family_oracle"

FAMILIES = ("hidden_masses", "polyhedron")
_PLACES = (np.zeros(3), np.array([0.5, 0.0, 0.0]), np.array([-0.5, 0.0, 0.0]))


class FamilyOracle(Learner):
    """Mass of each known part, fitted: places of masses, or the shape, are given.

    Position noise weighs each sample through the gravity gradient of the point mass. A bound, not
    a candidate: no learner knows the family.

    Parameters
    ----------
    family : str
        ``hidden_masses`` (masses at the centre and at +-R/2) or ``polyhedron`` (a point mass and
        the homogeneous shape).
    """

    stands_alone: ClassVar[bool] = True

    coefficients_: Array

    def __init__(self, family: str = "hidden_masses") -> None:
        self.family = family

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        if self.family not in FAMILIES:
            raise ConfigError(f'family is "{self.family}"', allowed=", ".join(FAMILIES))
        design = np.stack(self._columns(X), axis=2)  # (n, 3, p)
        target = y[:, :, None]
        if noise.position > 0:
            G = PointMassOnly()._jacobian(X)
            covariance = noise.acceleration**2 * np.eye(3) + noise.position**2 * G @ G.mT
            root = np.linalg.cholesky(covariance)
            design, target = np.linalg.solve(root, design), np.linalg.solve(root, target)
        flat = design.reshape(3 * len(X), -1)
        self.coefficients_ = np.linalg.lstsq(flat, target.ravel(), rcond=None)[0]
        progress(1.0)

    def _columns(self, X: Array) -> list[Array]:
        """Accelerations of each part with the whole mass."""
        centre = PointMassOnly()
        if self.family == "polyhedron":
            return [centre._predict(X), shape_gravity(_shape().acceleration, X)]
        return [centre._predict(X - place) for place in _PLACES]

    def _predict(self, X: Array) -> Array:
        return sum_of(self.coefficients_, self._columns(X))

    def _jacobian(self, X: Array) -> Array:
        centre = PointMassOnly()
        if self.family == "polyhedron":
            shape = np.ascontiguousarray(_shape().state_partials(X)[:, :, :3])
            return sum_of(self.coefficients_, [centre._jacobian(X), shape])
        return sum_of(self.coefficients_, [centre._jacobian(X - place) for place in _PLACES])

    def _arrays(self) -> dict[str, Array]:
        return {"coefficients": self.coefficients_}

    def _restore(self, arrays: dict[str, Array]) -> None:
        self.coefficients_ = arrays["coefficients"]


def register() -> None:
    """Make configurations know the oracle; not on import, which would change every list."""
    FamilyOracle.name = NAME
    _REGISTRY[NAME] = FamilyOracle


def sum_of(coefficients: Array, parts: list[Array]) -> Array:
    """Return the parts times their coefficients, added."""
    total: Array = sum(c * part for c, part in zip(coefficients, parts, strict=True))
    return total


@cache
def _shape() -> Dynamics:
    """Return the whole field of the shape in normalised units, as a series."""
    return Dynamics([PointMass(), Polyhedron(eros_mesh(), SHAPE_DEGREE)], {"GM": NORMALISED_GM})
