"""Noise of the positions as noise of the accelerations, through the gradient of a first fit."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["PASSES", "sample_variances"]

#: Fits in all where the position noise is known: each takes the gradient of the one before.
PASSES = 3


def sample_variances(noise: NoiseLevel, count: int, jacobian: Array | None = None) -> Array:
    """Return the noise variances (n, 3) of single samples, beside ``noise.acceleration``.

    ``noise.samples``^2 + 2 sigma_s^2 sum_j G_ij^2, with G the gradient of the whole field by the
    position: a position is drawn once for the sample, and once for the place that its
    acceleration belongs to ("independent" draws). First order in sigma_s, and component by
    component: [McHutchon2011] Eq. 4.

    Parameters
    ----------
    noise : NoiseLevel
        What is known; position noise counts as far as gradients are given.
    count : int
        Samples.
    jacobian : ndarray (n, 3, d), optional
        Of the fit before; its first three columns are by the position.
    """
    variances = np.zeros((count, 3))
    if noise.samples is not None:
        variances += noise.samples**2
    gradient = np.zeros((count, 3, 3)) if noise.gradient is None else noise.gradient
    if jacobian is not None:
        gradient = gradient + jacobian[:, :, :3]
    variances += 2.0 * noise.position**2 * (gradient**2).sum(axis=2)
    return variances
