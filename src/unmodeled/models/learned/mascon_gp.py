"""The Gaussian process of a field whose masses lie inside a known body: for below its sphere."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar, Self

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned._equal_weights import fit_equal_weights
from unmodeled.models.learned._sample_noise import noise_roots
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.point_mass import PointMassOnly
from unmodeled.models.physics.interior_lattice import ellipsoid_lattice, shape_lattice

__all__ = ["MasconGP"]

#: Samples whose equations are in memory at once: 512 x 3 x 500 x 8 bytes.
_CHUNK = 512
#: Columns with a flat prior: equal masses, and masses that grow along x, y, z.
_FREE = 4


class MasconGP(Learner):
    r"""Gaussian process of point masses on a lattice inside the body.

    .. math::
        \mathbf a = -GM \sum_{k=1}^{M} \Big(\frac{c_0 + \mathbf c \cdot (\mathbf r_k -
        \bar{\mathbf r})}{M} + w_k\Big) \frac{\mathbf r - \mathbf r_k}{|\mathbf r - \mathbf r_k|^3}

    with w_k independent, of variance s^2, and a flat prior on c_0 and **c**: mass and centre of
    mass, degrees 0 and 1, and whatever else a body of even density has. The process is that of a
    random density in the body. s and the noise maximise the evidence with the flat ones
    integrated out; s is at most 1 / M, a density that varies by all of itself from cell to cell:
    without the bound the weights of clean data grow and cancel, and the field near the surface is
    theirs.

    The basis is harmonic everywhere outside the body, so nothing forbids prediction between its
    surface and the Brillouin sphere, where spherical harmonics about the centre diverge. What the
    data do not say there is filled by the shape: even density, with the covariance of the prior.
    Within the spacing of the lattice from the surface single masses are seen, and the covariance,
    which takes the lattice for true, does not know it.

    Positions are taken as observed; their noise weighs the samples through the gradient of the
    point mass.

    Parameters
    ----------
    shape : str, optional
        A built-in shape (`built_in_shape`) that reaches ``radius`` from its centroid.
    axes : tuple of float
        Semi-axes of an ellipsoid along x, y, z, where there is no ``shape``, in the units of the
        samples; the body should hold it.
    places : sequence of (float, float, float), optional
        Own places of the masses instead, e.g. `mesh_lattice` of the body's mesh.
    count : int
        About how many masses there are.
    radius : float
        Brillouin radius, in the units of the samples; scales ``shape``.
    gm : float
        Reference value; scales the weights.

    Attributes
    ----------
    places_ : ndarray (M, 3)
        Where the masses are.
    weights_ : ndarray (4 + M,)
        Posterior mean of c_0, **c** and w.
    covariance_root_ : ndarray (4 + M, 4 + M)
        Their covariance is ``covariance_root_ @ covariance_root_.T``.
    """

    name: ClassVar[str] = "mascon_gp"
    has_covariance = True
    stands_alone: ClassVar[bool] = True

    places_: Array
    weights_: Array
    covariance_root_: Array

    def __init__(
        self,
        shape: str | None = None,
        axes: tuple[float, float, float] = (0.7, 0.7, 0.7),
        places: tuple[tuple[float, float, float], ...] | None = None,
        count: int = 400,
        radius: float = 1.0,
        gm: float = NORMALISED_GM,
    ) -> None:
        self.shape = shape
        self.axes = axes
        self.places = places
        self.count = count
        self.radius = radius
        self.gm = gm

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        if not (math.isfinite(self.gm) and self.gm > 0):
            raise ConfigError(f"{self.name}: gm is {self.gm}", allowed="a number > 0")
        self.places_ = np.ascontiguousarray(self._lattice())
        root = self._noise_root(X, noise)
        weights = None if root is None else np.linalg.inv(root)
        log_weight = 0.0
        if weights is not None:
            log_weight = float(np.log(np.diagonal(weights, axis1=1, axis2=2)).sum())

        def equations() -> Iterator[Array]:
            for k in range(0, len(X), _CHUNK):
                part = slice(k, k + _CHUNK)
                rows = np.concatenate([self._design(X[part]), y[part][:, :, None]], axis=2)
                if weights is not None:
                    rows = weights[part] @ rows
                progress(0.8 * (k / len(X)))
                yield rows.reshape(-1, rows.shape[2])

        found = fit_equal_weights(equations(), _FREE, 1.0 / len(self.places_), log_weight)
        self.weights_, self.covariance_root_ = found.mean, found.root
        self.amplitude_, self.noise_ = found.amplitude, found.noise
        self.log_evidence_ = found.log_evidence
        progress(1.0)

    def _lattice(self) -> Array:
        if self.places is not None:
            places = as_array(np.array(self.places, dtype=np.float64), ("m", 3), "places")
            if len(places) < _FREE:
                raise ConfigError(f"{self.name}: {len(places)} places", allowed="4 or more")
            return places
        if self.shape is not None:
            return shape_lattice(self.shape, self.radius, self.count)
        return ellipsoid_lattice(self.axes, self.count)

    def _noise_root(self, X: Array, noise: NoiseLevel) -> Array | None:
        """Return lower Cholesky factors (n, 3, 3) of the stated noise; None if there is none."""
        if noise.position == 0 and noise.acceleration == 0 and noise.samples is None:
            return None
        gradient = noise.gradient
        if gradient is None:
            gradient = PointMassOnly(self.gm)._jacobian(X)
        return noise_roots(noise, gradient)

    def _offsets(self, X: Array) -> tuple[Array, Array]:
        """Return offsets (n, M, 3) from the masses and their lengths (n, M)."""
        offset = X[:, None, :] - self.places_
        length = np.linalg.norm(offset, axis=2)
        if (length == 0.0).any():
            raise DataError(
                f"position {int(np.argmin(length.min(axis=1)))} is that of a mass inside the body",
                allowed="positions outside the body",
            )
        return offset, length

    def _design(self, X: Array) -> Array:
        """Accelerations (n, 3, 4 + M) of unit weights."""
        offset, length = self._offsets(X)
        pull = -self.gm * (offset / length[:, :, None] ** 3).transpose(0, 2, 1)
        return np.concatenate([pull @ self._flat(), pull], axis=2)

    def _flat(self) -> Array:
        """Masses (M, 4) of the columns with a flat prior."""
        away = self.places_ - self.places_.mean(axis=0)
        return np.concatenate([np.ones((len(away), 1)), away], axis=1) / len(away)

    @property
    def masses_(self) -> Array:
        """Posterior mean of the masses (M,), in shares of ``gm``."""
        self._require_fitted()
        masses: Array = self._flat() @ self.weights_[:_FREE] + self.weights_[_FREE:]
        return masses

    def _predict(self, X: Array) -> Array:
        return np.concatenate([self._design(part) @ self.weights_ for part in _parts(X)])

    def _jacobian(self, X: Array) -> Array:
        masses, blocks = self.gm * self.masses_, []
        for part in _parts(X):
            offset, length = self._offsets(part)
            far = masses / length**5
            tidal = 3.0 * np.einsum("nk,nki,nkj->nij", far, offset, offset)
            blocks.append(tidal - (masses / length**3).sum(axis=1)[:, None, None] * np.eye(3))
        return np.concatenate(blocks)

    def _predict_covariance(self, X: Array) -> Array:
        blocks = []
        for part in _parts(X):
            half = self._design(part) @ self.covariance_root_
            covariance = half @ half.mT
            blocks.append(0.5 * (covariance + covariance.mT))
        return np.concatenate(blocks)

    @classmethod
    def _from_params(cls, params: dict[str, Any]) -> Self:
        # Files hold lists; equal learners look equal.
        places = params["places"]
        own = None if places is None else tuple(tuple(place) for place in places)
        return cls(**params | {"axes": tuple(params["axes"]), "places": own})

    def facts(self) -> dict[str, float | str]:
        """Return the number of masses, hyperparameters, the factor of the noise and the mass."""
        self._require_fitted()
        total = np.concatenate([self._flat().sum(axis=0), np.ones(len(self.places_))])
        return {
            "masses": float(len(self.places_)),
            "prior deviation of a mass / its even share": self.amplitude_ * len(self.places_),
            "noise / stated noise (or noise)": self.noise_,
            "log_evidence": self.log_evidence_,
            "fitted GM / reference GM": float(total @ self.weights_),
            "its standard deviation": float(np.linalg.norm(total @ self.covariance_root_)),
        }

    def _arrays(self) -> dict[str, Array]:
        return {
            "places": self.places_,
            "weights": self.weights_,
            "covariance_root": self.covariance_root_,
            "numbers": np.array([self.amplitude_, self.noise_, self.log_evidence_]),
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        self.places_, self.weights_ = arrays["places"], arrays["weights"]
        self.covariance_root_ = arrays["covariance_root"]
        self.amplitude_, self.noise_, self.log_evidence_ = (float(v) for v in arrays["numbers"])


def _parts(X: Array) -> Iterator[Array]:
    for k in range(0, max(len(X), 1), _CHUNK):
        yield X[k : k + _CHUNK]
