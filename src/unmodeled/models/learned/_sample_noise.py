"""Stated noise as a covariance of each acceleration, and as weights of a least-squares fit.

Both statements enter here. Noise of an acceleration is known for all samples, for each sample or
for each axis of each sample (`NoiseLevel.acceleration`, ``samples``). Noise of a position reaches
the acceleration through the gravity gradient. `_input_noise` is the same rule for one component
at a time, which is what processes with independent components can take; `HarmonicGP` has the same
covariance and moves the positions as well.

Networks take the gradient of what was taken off the samples, or a rough one, and not their own:
along one orbit the data say nothing of the slope across it, a network's own slope there is free,
and a fit repeated with it is worse each time (`benchmarks/sample_noise.py`).
"""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["covariances", "noise_roots", "relative", "stated_covariances", "whitening"]

#: Least noise of a direction, as a share of the variance of its sample.
_LEAST = 1e-4


def stated_covariances(noise: NoiseLevel, gradient: Array) -> Array:
    """Return the noise covariance (n, 3, 3) of each acceleration, in its units squared.

    ``sigma_a^2 I + diag(samples^2) + 2 sigma_s^2 G G'``: [McHutchon2011] Eq. 4 for the three
    components together. The 2 is for independent draws: of the observed position, and of the one
    whose acceleration was observed.

    Parameters
    ----------
    noise : NoiseLevel
        What is known.
    gradient : ndarray (n, 3, 3)
        G; matters where positions are noisy only.
    """
    result = np.zeros(gradient.shape) + noise.acceleration**2 * np.eye(3)
    if noise.samples is not None:
        result += noise.samples[:, :, None] ** 2 * np.eye(3)
    if noise.position:
        result += 2.0 * noise.position**2 * gradient @ gradient.mT
    return result


def noise_roots(noise: NoiseLevel, gradient: Array) -> Array:
    """Return lower Cholesky factors (n, 3, 3) of `stated_covariances`.

    Where G is singular, or a sample has no noise at all, a millionth of the noise is left.
    """
    covariance = stated_covariances(noise, gradient)
    size = np.trace(covariance, axis1=1, axis2=2)
    covariance += 1e-12 * np.maximum(size, size.mean())[:, None, None] * np.eye(3)
    root: Array = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    return root


def covariances(noise: NoiseLevel, count: int, slope: float) -> Array:
    """Return `stated_covariances` (n, 3, 3) with a gradient that is not the learner's own.

    Parameters
    ----------
    noise : NoiseLevel
        What is known; its ``gradient`` is G, where the accelerations are what a known field left.
    count : int
        Samples.
    slope : float
        Spread of the accelerations per spread of the positions; G is that in all directions where
        no field was taken off.
    """
    rough = np.broadcast_to(slope * np.eye(3), (count, 3, 3))
    return stated_covariances(noise, rough if noise.gradient is None else noise.gradient)


def whitening(covariance: Array) -> Array | None:
    """Return inverse Cholesky factors W (n, 3, 3) of the noise, None where there is no noise.

    ``W C W'`` is the unit matrix.

    Parameters
    ----------
    covariance : ndarray (n, 3, 3)
        Of each sample; a sample without noise counts as the best of the others, not infinitely.
    """
    size = np.trace(covariance, axis1=1, axis2=2) / 3.0
    if not size.any():
        return None
    none = size == 0.0
    least = np.where(none, size[~none].min(), _LEAST * size)
    root = np.linalg.cholesky(covariance + least[:, None, None] * np.eye(3))
    inverse: Array = np.linalg.inv(root)
    return inverse


def relative(white: Array | None) -> Array | None:
    """Return weights of mean square one, so that rates keep their meaning; None if all are alike.

    Parameters
    ----------
    white : ndarray (n, 3, 3) or None
        Of `whitening`.
    """
    if white is None or np.abs(white - white[0, 0, 0] * np.eye(3)).max() <= 1e-9 * white[0, 0, 0]:
        return None
    weights: Array = white / np.sqrt(np.mean((white**2).sum(axis=(1, 2)) / 3.0))
    return weights
