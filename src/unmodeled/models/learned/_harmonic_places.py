"""Noise of samples at uncertain positions, and where the samples most likely were."""

from __future__ import annotations

import math

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["NoisyPlaces", "mass_of", "noise_root"]

#: Farthest that a position is moved from where it was observed, standard deviations.
_REACH = 5.0


def noise_root(field: UncertainField | None, places: Array, noise: NoiseLevel) -> Array | None:
    """Return lower Cholesky factors (n, 3, 3) of the stated noise; None if there is none.

    Parameters
    ----------
    field : UncertainField, optional
        Whose gravity gradient carries position noise; needed where there is such.
    places : ndarray (n, 3)
        Positions at which it is taken.
    noise : NoiseLevel
    """
    if noise.position == 0 and noise.acceleration == 0 and noise.samples is None:
        return None
    covariance = np.zeros((len(places), 3, 3)) + noise.acceleration**2 * np.eye(3)
    if noise.samples is not None:
        covariance += noise.samples[:, :, None] ** 2 * np.eye(3)
    if noise.position:
        assert field is not None
        G = _whole_gradient(field, places, noise)
        # independent draws: of the position as stated, and of the one that y belongs to
        covariance += 2.0 * noise.position**2 * G @ G.mT
    # Where G is singular, or a sample has no noise at all, a millionth of the noise is left.
    size = np.trace(covariance, axis1=1, axis2=2)
    covariance += 1e-12 * np.maximum(size, size.mean())[:, None, None] * np.eye(3)
    root: Array = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    return root


def mass_of(X: Array, y: Array) -> float:
    """Return GM of the point mass that fits noisy positions best, 0 if they show none.

    Its acceleration y belongs to the place sqrt(GM) w, w = -y / |y|^(3/2): linear in sqrt(GM), with
    all noise of position on the other side, so that no noise biases it.
    """
    w = _inverse(y, 1.0)
    root = float((w * X).sum()) / float((w**2).sum())
    return root**2 if root > 0 else 0.0


def _inverse(y: Array, gm: float) -> Array:
    """Return the places (n, 3) where a point mass at the origin gives the accelerations ``y``."""
    size = np.maximum(np.linalg.norm(y, axis=1, keepdims=True), 1e-300)
    places: Array = -math.sqrt(gm) * y / size**1.5
    return places


class NoisyPlaces:
    """Where samples at noisy positions are compared with a field.

    A sample is x = u + e_1, y = a(u + e_2) + e_3, all of them independent, u unknown. XXX

    Parameters
    ----------
    X, y : ndarray (n, 3)
        Observed.
    noise : NoiseLevel
        With ``position`` > 0.
    gm : float
        Of the point mass to start from.
    """

    def __init__(self, X: Array, y: Array, noise: NoiseLevel, gm: float, least: float) -> None:
        self._X, self._y, self._noise = X, y, noise
        self._least = least
        self._source = _inverse(y, gm)
        level = np.zeros(X.shape) + noise.acceleration**2
        if noise.samples is not None:
            level += noise.samples**2
        self._level = level.mean(axis=1)
        spread = np.sqrt(self._level) / np.linalg.norm(y, axis=1)
        radius = np.linalg.norm(self._source, axis=1)
        self._backward = spread * radius < math.sqrt(2.0) * noise.position
        self.places = X

    def update(self, field: UncertainField) -> Array:
        """Take the places under a field; return the accelerations (n, 3) that belong to them."""
        X, y, s = self._X, self._y, self._noise.position
        b = self._source
        for _ in range(_NEWTON):
            step = np.linalg.solve(field.gradient(b), (y - field.acceleration(b))[:, :, None])
            step = step[:, :, 0]
            radius = np.linalg.norm(b, axis=1)
            limit = 0.3 * radius / np.maximum(np.linalg.norm(step, axis=1), 1e-300)
            b = b + step * np.minimum(1.0, limit)[:, None]
        self._source = b
        G = field.gradient(self.places)
        back = np.linalg.inv(G)
        misfit = np.where(
            self._backward[:, None],
            X - b,
            X - self.places - _times(back, y - field.acceleration(self.places)),
        )
        total = 2.0 * s**2 * np.eye(3) + self._level[:, None, None] * back @ back.mT
        u = X - s**2 * np.linalg.solve(total, misfit[:, :, None])[:, :, 0]
        radius = np.linalg.norm(u, axis=1, keepdims=True)
        u = u * np.maximum(1.0, self._least / radius)
        self.places = u
        G = field.gradient(u)
        forward = y + _times(G, u - X)
        backward = field.acceleration(u) + _times(G, b - X)
        return np.where(self._backward[:, None], backward, forward)


_NEWTON = 3


def _times(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[:, :, None])[:, :, 0]


def _whole_gradient(field: UncertainField, places: Array, noise: NoiseLevel) -> Array:
    own = field.gradient(places)
    return own if noise.gradient is None else own + noise.gradient
