"""Noise of samples at uncertain positions, and where the samples most likely were."""

from __future__ import annotations

import math

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.learned._sample_noise import noise_roots
from unmodeled.models.learned.learner import NoiseLevel

__all__ = ["NoisyPlaces", "mass_of", "noise_root"]

#: Newton steps to the place of an acceleration under each new field, each at most this share of the
#: radius.
_NEWTON, _LONGEST = 3, 0.3


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
    gradient = np.zeros((len(places), 3, 3))
    if noise.position:
        assert field is not None
        gradient = _whole_gradient(field, places, noise)
    return noise_roots(noise, gradient)


def mass_of(X: Array, y: Array) -> float:
    """Return GM of a point mass from noisy positions, 0 where accelerations point away.

    A point mass gives the acceleration y at sqrt(GM) w, w = -y / |y|^(3/2). Observed and implied
    positions carry the same noise, so that the quotient of their mean squares is without bias.
    """
    w = _inverse(y, 1.0)
    if float((w * X).sum()) <= 0.0:
        return 0.0
    return float((X**2).sum()) / float((w**2).sum())


def _inverse(y: Array, gm: float) -> Array:
    """Return the places (n, 3) where a point mass at the origin gives the accelerations ``y``."""
    size = np.maximum(np.linalg.norm(y, axis=1, keepdims=True), 1e-100)
    places: Array = -math.sqrt(gm) * y / size**1.5
    return places


class NoisyPlaces:
    r"""Where samples at noisy positions are compared with a field, without the bias of their noise.

    A sample is x = u + s e_1 and y = a(u + s e_2) + e_3, its place u unknown. Under a field of
    coefficients c the acceleration comes from :math:`b_c = a_c^{-1}(y)`, found by Newton's method:
    nothing is of first order in s. Least squares of x - b_c are biased all the same: b_c carries
    noise too, and :math:`E[(x - b) \cdot g(b)] = -s^2 E[\mathrm{div}\, g]` for g = db/dc
    ([Stein1981] Lemma 1); the half of log|det G|, G the gravity gradient, added to
    :math:`|x - b|^2 / 4 s^2` takes that away, as its derivative is half of div g. Here the same is
    had without second derivatives of the field: at the midpoint, which is independent of x - b,
    :math:`\sum (x - b_c) \cdot g((x + b_c)/2) = 0` has no bias, at any s.

    Where e_3 is not small against the rest, the midpoint is weighted by the noise of x and b; and
    where an acceleration tells its place worse than the observed position does, b is replaced by
    one linear step.

    Parameters
    ----------
    X, y : ndarray (n, 3)
        Observed.
    noise : NoiseLevel
        With ``position`` > 0; noise of single samples as its mean over the components.
    gm : float
        Of the point mass to start from.
    radius : float
        Reference radius. Harmonics grow without bound inside: midpoints that noise may have
        brought there are moved out by up to s, which the independence allows.
    """

    def __init__(self, X: Array, y: Array, noise: NoiseLevel, gm: float, radius: float) -> None:
        self._X, self._y, self._sigma, self._radius = X, y, noise.position, radius
        level = np.zeros(X.shape) + noise.acceleration**2
        if noise.samples is not None:
            level += noise.samples**2
        self._level = level.mean(axis=1)
        source, size = _inverse(y, gm), np.linalg.norm(y, axis=1)
        spread = np.sqrt(self._level) * np.linalg.norm(source, axis=1)
        # No acceleration comes from nowhere.
        self._by_source = (spread < math.sqrt(2.0) * noise.position * size) & (size > 0.0)
        self._source = np.where(self._by_source[:, None], source, X)
        self.places = X

    def update(self, field: UncertainField) -> Array:
        """Take ``places`` under a field; return the accelerations (n, 3) that belong to them."""
        X, y, b = self._X, self._y, self._refined(field)
        G = field.gradient(self.places)
        back: Array = np.asarray(np.linalg.inv(G), dtype=np.float64)
        missing: Array = y - field.acceleration(self.places)
        step: Array = X - self.places - _times(back, missing)
        misfit = np.where(self._by_source[:, None], X - b, step)
        spread = 2.0 * self._sigma**2 * np.eye(3) + self._level[:, None, None] * back @ back.mT
        u = X - self._sigma**2 * np.linalg.solve(spread, misfit[:, :, None])[:, :, 0]
        height = np.linalg.norm(u, axis=1)
        least = np.minimum(self._radius, height + self._sigma)
        out = np.maximum(1.0, least / np.maximum(height, 1e-300))
        u *= np.where(self._by_source, out, 1.0)[:, None]
        self.places = u
        # y = a(b) there: G (b - X) is the misfit in terms of accelerations, G of this fit. With G
        # free in the next one, steep fields would be preferred.
        G = field.gradient(u)
        by_source = field.acceleration(u) + _times(G, b - X)
        by_step = y + _times(G, u - X)
        return np.where(self._by_source[:, None], by_source, by_step)

    def _refined(self, field: UncertainField) -> Array:
        """Return where the field gives the observed accelerations, from where the last one did."""
        b = self._source
        for _ in range(_NEWTON):
            step = np.linalg.solve(
                field.gradient(b), (self._y - field.acceleration(b))[:, :, None]
            )[:, :, 0]
            length = np.maximum(np.linalg.norm(step, axis=1), 1e-300)
            limit = _LONGEST * np.linalg.norm(b, axis=1) / length
            b = b + step * np.where(self._by_source, np.minimum(1.0, limit), 0.0)[:, None]
        self._source = b
        return b


def _times(matrix: Array, vector: Array) -> Array:
    product: Array = (matrix @ vector[:, :, None])[:, :, 0]
    return product


def _whole_gradient(field: UncertainField, places: Array, noise: NoiseLevel) -> Array:
    own = field.gradient(places)
    return own if noise.gradient is None else own + noise.gradient
