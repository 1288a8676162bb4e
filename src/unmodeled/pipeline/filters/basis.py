"""Accelerations that are linear in their weights: what can be learned by linear algebra."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError
from unmodeled.models.physics.exterior_harmonics import (
    column_degrees,
    derivative,
    exterior_harmonics,
)

__all__ = ["Basis", "HarmonicBasis", "RBFBasis", "RBFFeatures"]


class Basis(Protocol):
    """Columns whose weighted sum is an acceleration."""

    @property
    def size(self) -> int:
        """Number of weights p."""
        ...

    def evaluate(self, x: Array, t: float) -> Array:
        """Return B (b, 3, p), m/s2 for a unit weight, at states (b, n)."""
        ...

    def slope(self, x: Array, t: float, weights: Array) -> Array:
        """Return d(B w)/dx (b, 3, n) for weights (b, p)."""
        ...


@dataclass(frozen=True)
class RBFFeatures:
    """Normalised Gaussians of the state: [Pesce2020] Eq. 3 and 4, [Marchese2023] Eq. 3.73.

    Computed as a softmax of -eta |s x - c|^2: the same function, without its 0/0 far from all
    centres.

    Parameters
    ----------
    centres : ndarray (M, c)
        In scaled inputs.
    eta : float
        Of all Gaussians.
    scale : ndarray (c,)
        s: scaled input = s times state; the papers have 1.
    columns : tuple of int, optional
        States that are inputs; the first c.
    """

    centres: Array
    eta: float
    scale: npt.ArrayLike = 1.0
    columns: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        centres = as_array(self.centres, ("M", "c"), "centres")
        columns = tuple(range(centres.shape[1])) if self.columns is None else self.columns
        if len(columns) != centres.shape[1]:
            raise ConfigError(
                f"{len(columns)} columns for centres of {centres.shape[1]} inputs",
                allowed="one column for each input",
            )
        if not self.eta > 0.0:
            raise ConfigError(f"eta is {self.eta}", allowed="> 0")
        object.__setattr__(self, "centres", centres)
        object.__setattr__(self, "columns", columns)
        scale = np.broadcast_to(np.asarray(self.scale, dtype=np.float64), (len(columns),))
        object.__setattr__(self, "scale", as_array(scale, (len(columns),), "scale"))

    @property
    def size(self) -> int:
        """Number of Gaussians M."""
        return len(self.centres)

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Return the features (b, M), which sum to one, and their slopes (b, M, n)."""
        columns, scale = list(self.columns or ()), np.asarray(self.scale)
        u = x[:, columns] * scale
        # |u|^2 is common to a row and drops out
        logits = self.eta * (2.0 * u @ self.centres.T - (self.centres**2).sum(axis=1))
        phi = np.exp(logits - logits.max(axis=1, keepdims=True))
        phi /= phi.sum(axis=1, keepdims=True)
        offset = self.centres[None] - (phi @ self.centres)[:, None, :]
        slope = np.zeros((len(x), self.size, x.shape[1]))
        slope[:, :, columns] = 2.0 * self.eta * phi[:, :, None] * offset * scale
        return phi, slope


@dataclass(frozen=True)
class RBFBasis:
    """Each Gaussian once for each axis: weight 3 i + j is axis j of Gaussian i.

    Parameters
    ----------
    features : RBFFeatures
    unit : float
        Acceleration of a unit weight, m/s2.
    """

    features: RBFFeatures
    unit: float = 1.0

    @property
    def size(self) -> int:
        """Number of weights."""
        return 3 * self.features.size

    def evaluate(self, x: Array, t: float) -> Array:
        """Return B (b, 3, p)."""
        phi, _ = self.features.evaluate(x)
        whole: Array = self.unit * phi[:, None, :, None] * np.eye(3)[:, None, :]
        return whole.reshape(len(x), 3, -1)

    def slope(self, x: Array, t: float, weights: Array) -> Array:
        """Return d(B w)/dx (b, 3, n)."""
        _, slope = self.features.evaluate(x)
        W = weights.reshape(len(weights), -1, 3)
        return self.unit * (W.mT @ slope)


@dataclass(frozen=True)
class HarmonicBasis:
    """Exterior harmonics of a body at rest in the axes of the states: a `HarmonicGP`'s columns.

    Parameters
    ----------
    degree : int
    gm, radius : float
        Reference, SI; a unit weight is a fully normalised coefficient of one.
    least_degree : int
        Columns of lower degrees are left out, e.g. 2 where mass and centre are known.
    """

    degree: int
    gm: float
    radius: float
    least_degree: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.least_degree <= self.degree:
            raise ConfigError(
                f"degrees {self.least_degree} to {self.degree}", allowed="0 <= least <= degree"
            )

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return (self.degree + 1) ** 2 - self.least_degree**2

    def prior_sigma(self, amplitude: float, attenuation: float) -> Array:
        """Return s q^n of each coefficient, the prior of [Moritz1980] that `HarmonicGP` fits."""
        sigma: Array = amplitude * attenuation ** column_degrees(self.degree).astype(np.float64)
        return sigma[self.least_degree**2 :]

    def evaluate(self, x: Array, t: float) -> Array:
        """Return B (b, 3, p)."""
        table = exterior_harmonics(x[:, :3] / self.radius, self.degree + 1)
        columns = np.stack([derivative(table, i) for i in range(3)])[:, self.least_degree**2 :]
        return self.gm / self.radius**2 * columns.transpose(2, 0, 1)

    def slope(self, x: Array, t: float, weights: Array) -> Array:
        """Return d(B w)/dx (b, 3, n)."""
        table = exterior_harmonics(x[:, :3] / self.radius, self.degree + 2)
        J = np.zeros((len(x), 3, x.shape[1]))
        for i in range(3):
            first = derivative(table, i)
            for j in range(i, 3):
                second = derivative(first, j)[self.least_degree**2 :]
                J[:, i, j] = J[:, j, i] = (weights.T * second).sum(axis=0)
        return J * (self.gm / self.radius**3)
