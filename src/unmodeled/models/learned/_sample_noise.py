"""Stated noise as a covariance of each acceleration, and as weights of a least-squares fit.

Both statements enter here. Noise of an acceleration is known for all samples, for each sample or
for each axis of each sample (`NoiseLevel.acceleration`, ``samples``). Noise of a position reaches
the acceleration through the gravity gradient, which is that of the fit before: the fit is
repeated until the weights settle. `_input_noise` is the same rule for one component at a time,
which is what processes with independent components can take; `HarmonicGP` has the same covariance
and moves the positions as well.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned._input_noise import PASSES
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["covariances", "fit_settled", "relative", "whitening"]

#: Weights have settled when none changes by more than this share; at most `PASSES` fits in all.
_SETTLED = 0.01
#: Least noise of a direction, as a share of the variance of its sample.
_LEAST = 1e-4


def covariances(noise: NoiseLevel, count: int, jacobian: Array | None = None) -> Array:
    """Return the noise covariance (n, 3, 3) of each acceleration, in its units squared.

    ``sigma_a^2 I + diag(samples^2) + 2 sigma_s^2 G G'``: [McHutchon2011] Eq. 4 for the three
    components together. The 2 is for independent draws: of the observed position, and of the one
    whose acceleration was observed.

    Parameters
    ----------
    noise : NoiseLevel
        What is known; its ``gradient`` is the part of G that was taken off the accelerations.
    count : int
        Samples.
    jacobian : ndarray (n, 3, d), optional
        Gradient of a fit, the rest of G; its first three columns are by the position.
    """
    result = np.zeros((count, 3, 3)) + noise.acceleration**2 * np.eye(3)
    if noise.samples is not None:
        result += noise.samples[:, :, None] ** 2 * np.eye(3)
    gradient = np.zeros((count, 3, 3)) if noise.gradient is None else noise.gradient
    if jacobian is not None:
        gradient = gradient + jacobian[:, :, :3]
    if noise.position:
        result += 2.0 * noise.position**2 * gradient @ gradient.mT
    return result


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


def fit_settled(
    noise: NoiseLevel,
    count: int,
    fit: Callable[[Array | None, int], None],
    jacobian: Callable[[], Array],
    slope: float = 0.0,
) -> int:
    """Fit with weights, and again with those of the new gradient until they settle.

    Parameters
    ----------
    noise : NoiseLevel
        What is known.
    count : int
        Samples.
    fit : callable
        Takes `whitening` and the number of the fit.
    jacobian : callable
        Gradient (n, 3, d) of the last fit at the samples.
    slope : float
        Spread of the accelerations per spread of the positions: stands for the gradient in the
        first fit where none is known, so that it does not run after the noise.

    Returns
    -------
    int
        Number of fits, `PASSES` at most, 1 without position noise.
    """
    rough = slope * np.eye(3) if noise.gradient is None else np.zeros((3, 3))
    known = covariances(noise, count, np.broadcast_to(rough, (count, 3, 3)))
    fit(whitening(known), 0)
    if not noise.position:
        return 1
    for k in range(1, PASSES):
        fresh = covariances(noise, count, jacobian())
        moved = np.abs(fresh - known).max(axis=(1, 2))
        if (moved <= _SETTLED * np.trace(fresh, axis1=1, axis2=2)).all():
            return k
        fit(whitening(fresh), k)
        known = fresh
    return PASSES
