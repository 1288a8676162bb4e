"""Noise of positions and accelerations as weights of samples, and the mass that noise leaves."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned._sample_noise import noise_roots
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["EFFICIENCY", "likely_places", "mass_by_moments", "student_factors", "weight_roots"]

#: Farthest that a position is moved from where it was observed, standard deviations.
_REACH = 5.0
#: Degrees of freedom of the noise where positions are noisy: far from linear, tails are long.
_FREEDOM = 4.0
#: Precision of weights fitted under that likelihood to normal noise, over what factors of roots
#: and a strength estimated with them claim: E[psi']^2 / (beta E[w] E[psi^2]) in three dimensions,
#: 1 / 1.495 by quadrature.
EFFICIENCY = 0.669


def weight_roots(noise: NoiseLevel, gradient: Array) -> Array:
    """Return W (n, 3, 3) with W C W' = I, C the stated noise of each sample.

    The inverses of `noise_roots`, with the gravity gradient (n, 3, 3) of the whole field.
    """
    return np.asarray(np.linalg.inv(noise_roots(noise, gradient)))


def likely_places(X: Array, noise: NoiseLevel, root: Array, gradient: Array, rest: Array) -> Array:
    """Return the true positions (n, 3) that positions and accelerations make most likely.

    Parameters
    ----------
    X : ndarray (n, 3)
        Observed positions.
    noise : NoiseLevel
        Stated noise.
    root, gradient : ndarray (n, 3, 3)
        Of `weight_roots`, at the places of the fit.
    rest : ndarray (n, 3)
        What the field, carried linearly from there to ``X``, leaves of the accelerations.
    """
    weighted = root.mT @ (root @ rest[:, :, None])
    move = noise.position**2 * (gradient.mT @ weighted)[:, :, 0]
    # Linearised: no further than noise goes, or one bad sample leaves for good.
    length = np.linalg.norm(move, axis=1, keepdims=True)
    limit = _REACH * noise.position
    return np.asarray(X + move * np.minimum(1.0, limit / np.maximum(length, 1e-300)))


def student_factors(misfit: Array) -> Array:
    """Return factors (n,) of the roots of weights for Student's t, from whitened misfits (n, 3).

    The step of expectation maximisation, [Lange1989].
    """
    square = (misfit**2).sum(axis=1)
    return np.asarray(np.sqrt((_FREEDOM + 3.0) / (_FREEDOM + square)))


def mass_by_moments(X: Array, y: Array, position: float) -> tuple[float, float]:
    """Return the mass of a point mass seen through noisy positions, and its standard error.

    A sample says twice where it was taken: at x, and at z = -s y / |y|^(3/2), where a mass of s^2
    has the acceleration y. Their errors are independent, so that <z.(z - x)> is 3 sigma^2, a
    quadratic equation of s. Without the right side, as in least squares, the mass would come out
    too small. The error is that of the jackknife. Zero, if the accelerations point outwards.
    """
    size = np.maximum(np.linalg.norm(y, axis=1), 1e-300)
    u = -y / size[:, None] ** 1.5
    squares, products = (u * u).sum(axis=1), (u * X).sum(axis=1)
    if products.sum() <= 0:
        return 0.0, 0.0

    def solve(square: Array, product: Array, count: int) -> Array:
        root = np.sqrt(product**2 + 12.0 * count * position**2 * square)
        return np.asarray(((product + root) / (2.0 * square)) ** 2)

    n = len(X)
    mass = float(solve(squares.sum(), products.sum(), n))
    others = solve(squares.sum() - squares, products.sum() - products, n - 1)
    return mass, float(np.sqrt((n - 1) / n * ((others - others.mean()) ** 2).sum()))
