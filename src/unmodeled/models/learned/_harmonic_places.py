"""Noise of samples at uncertain positions, and where the samples most likely were."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["likely_places", "noise_root"]

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


def likely_places(
    field: UncertainField, X: Array, y: Array, places: Array, noise: NoiseLevel
) -> Array:
    """Return the true positions that observed positions and accelerations make most likely."""
    G = field.gradient(places)
    root = noise_root(field, places, noise)
    assert root is not None
    misfit = y - field.acceleration(places) - (G @ (X - places)[:, :, None])[:, :, 0]
    half = np.linalg.solve(root, misfit[:, :, None])
    move = noise.position**2 * G.mT @ np.linalg.solve(root.mT, half)
    # Linearised: no further than noise goes, or one bad sample leaves for good.
    length = np.linalg.norm(move[:, :, 0], axis=1, keepdims=True)
    limit = _REACH * noise.position
    moved: Array = X + move[:, :, 0] * np.minimum(1.0, limit / np.maximum(length, 1e-300))
    return moved


def _whole_gradient(field: UncertainField, places: Array, noise: NoiseLevel) -> Array:
    own = field.gradient(places)
    return own if noise.gradient is None else own + noise.gradient
