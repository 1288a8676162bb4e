"""Normalised radial-basis-function network: Gaussians that sum to one, linear weights."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
from scipy.linalg import lstsq, svd
from scipy.spatial import cKDTree

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.models.learned._sample_noise import covariances, whitening
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["RBFNetwork"]

#: Prior variances of the weights among which the most likely is chosen where noise is stated,
#: in squares of the scale of the accelerations.
_PRIORS = np.logspace(-8, 12, 81)


class RBFNetwork(Learner):
    """Weighted mean of centre values, the weights normalised Gaussians [Moody1989].

    The normalised Gaussians are computed as a softmax of ``-|x - c|^2 / (2 w^2)``: the same
    function as the quotient of Gaussians, which underflows to 0/0 some 40 widths from the data.
    Far away the network tends to the value of the nearest centre in the direction of ``x``: it
    stays finite, and is wrong.

    Parameters
    ----------
    centres : int
        Number of centres, at most the number of distinct samples. They are samples chosen by
        farthest-point traversal, which spreads them evenly along an arc and needs no seed.
    width_factor : float
        Width ``w`` of all Gaussians, as a multiple of the mean distance of a centre from its
        nearest neighbour among the centres.
    rcond : float
        Singular values below this share of the largest are cut from the pseudo-inverse.
    position_noise : bool
        Whether known position noise counts, through the gradient of the point mass below
        (`Residual`), or a rough one.

    Attributes
    ----------
    centres_ : ndarray (k, d)
        Centres, in the units of the inputs.
    width_ : float
        In units of length, for the position.
    rank_ : int
        Number of singular values kept, of k; of 3k where noise is known, which couples the
        components.
    ridge_ : float
        Inverse prior variance of the weights; 0 without noise.

    Notes
    -----
    The wider the Gaussians, the better the interpolation and the larger the alternating weights,
    which are what the network predicts far away. Measured without noise on 238 samples along one
    orbit about a Bennu-like body (medians of six orbits; fractional error between the samples,
    largest weight in units of acceleration, where the field is below 40): width factor 1.5 gives
    6e-3 and 9e1; 3 gives 8e-4 and 6e3; 5 with an ``rcond`` of 1e-10 gives 1.4e-4 and 5e6. The
    defaults are the middle; 30 and 100 centres there give 2e-3 and 3e-4.

    Where noise is stated, weights have a normal prior, whose variance, and a factor of the noise of
    at least 1, maximise the evidence ([Rasmussen2006] Eq. 2.30).
    """

    name: ClassVar[str] = "rbf_network"
    takes_features = True

    centres_: Array
    width_: float
    rank_: int
    ridge_: float

    def __init__(
        self,
        centres: int = 60,
        width_factor: float = 3.0,
        rcond: float = 1e-6,
        position_noise: bool = True,
    ) -> None:
        self.centres = centres
        self.width_factor = width_factor
        self.rcond = rcond
        self.position_noise = position_noise

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        for key in ("centres", "width_factor", "rcond"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}", allowed="> 0")
        scaling = Standardiser.of(X, y)
        x = scaling.positions(X)
        centres = x[_farthest_points(x, self.centres)]
        width = self.width_factor * _mean_spacing(centres)
        self._set_state(scaling, centres, width)
        shares, targets = self._shares(x), scaling.targets(y)
        known = noise if self.position_noise else replace(noise, position=0.0)
        white = whitening(covariances(known, len(X), scaling.slope))
        if white is None:
            weights, _, self.rank_, _ = lstsq(shares, targets, cond=self.rcond)
            self._weights, self.ridge_ = np.ascontiguousarray(weights.T), 0.0
        else:
            found = _most_likely(shares, targets, white * scaling.y_scale, self.rcond)
            self._weights, self.rank_, self.ridge_ = found
        progress(1.0)

    def _set_state(self, scaling: Standardiser, centres: Array, width: float) -> None:
        self._scaling, self._centres, self._width = scaling, centres, width
        self.centres_ = scaling.x_mean + scaling.x_scales * centres
        self.width_ = width * scaling.x_scale

    def _shares(self, x: Array) -> Array:
        """Normalised Gaussians (m, k) at scaled inputs ``x`` (m, d); rows sum to one."""
        # |x|^2 is common to a row and drops out of the softmax; left in, it would cancel only
        # to rounding, which far away is larger than the differences that count.
        c = self._centres
        products = sum(x[:, None, i] * c[None, :, i] for i in range(c.shape[1]))
        logits = (products - 0.5 * (c**2).sum(axis=1)) / self._width**2
        logits -= logits.max(axis=1, keepdims=True)
        shares = np.exp(logits)
        normalised: Array = shares / shares.sum(axis=1, keepdims=True)
        return normalised

    def _predict(self, X: Array) -> Array:
        # Sums along the last axis, not BLAS, so that a row does not depend on its batch.
        shares = self._shares(self._scaling.positions(X))
        return self._scaling.accelerations((shares[:, None, :] * self._weights).sum(axis=-1))

    def _jacobian(self, X: Array) -> Array:
        shares = self._shares(self._scaling.positions(X))
        # d share_j / dx = share_j (c_j - mean of c under the shares) / w^2
        mean = (shares[:, None, :] * self._centres.T).sum(axis=-1)
        offset = self._centres.T - mean[:, :, None]
        weighted = shares[:, None, :] * self._weights
        slopes = [(weighted * offset[:, None, j, :]).sum(axis=-1) for j in range(X.shape[1])]
        jacobian: Array = self._scaling.slopes * np.stack(slopes, axis=-1) / self._width**2
        return jacobian

    def facts(self) -> dict[str, float | str]:
        """Return number of centres, width, rank, ridge and largest weight (acceleration units)."""
        self._require_fitted()
        largest = float(np.abs(self._weights).max()) * self._scaling.y_scale
        return {
            "centres": float(len(self._centres)),
            "width": self.width_,
            "rank": float(self.rank_),
            "ridge": self.ridge_,
            "largest_weight": largest,
        }

    def _arrays(self) -> dict[str, Array]:
        return self._scaling.arrays() | {
            "centres": self._centres,
            "weights": self._weights,
            "width_rank": np.array([self._width, self.rank_, self.ridge_]),
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        width, rank, *ridge = (float(v) for v in arrays["width_rank"])
        self._set_state(Standardiser.restore(arrays), arrays["centres"], width)
        self._weights, self.rank_ = arrays["weights"], int(rank)
        self.ridge_ = ridge[0] if ridge else 0.0  # files of before have none


def _most_likely(
    shares: Array, targets: Array, white: Array, rcond: float
) -> tuple[Array, int, float]:
    """Return weights (3, k), rank and ridge of the most likely prior; noise is as stated."""
    n, k = shares.shape
    design = (white[:, :, :, None] * shares[:, None, None, :]).reshape(3 * n, 3 * k)
    right = (white @ targets[:, :, None]).ravel()
    u, s, vt = svd(design, full_matrices=False)
    keep = s > rcond * s[0]
    u, s, vt = u[:, keep], s[keep], vt[keep]
    along = u.T @ right
    outside = max(float(right @ right - along @ along), 0.0)
    # y ~ N(0, f (p^2 Phi Phi' + I)), [Rasmussen2006] Eq. 2.30: the factor f of the noise at its
    # most likely value, but no less than stated
    total = 1.0 + _PRIORS[:, None] * s**2
    quadratic = (along**2 / total).sum(axis=1) + outside
    factor = np.maximum(1.0, quadratic / len(right))
    evidence = -0.5 * (quadratic / factor + np.log(total).sum(axis=1) + len(right) * np.log(factor))
    ridge = 1.0 / float(_PRIORS[int(np.argmax(evidence))])
    weights = vt.T @ (s / (s**2 + ridge) * along)
    return np.ascontiguousarray(weights.reshape(3, k)), int(keep.sum()), ridge


def _farthest_points(x: Array, count: int) -> list[int]:
    """Pick rows of ``x``, each the farthest from those before; fewer if points repeat."""
    chosen = [int(np.argmax(((x - x.mean(axis=0)) ** 2).sum(axis=1)))]
    square = np.full(len(x), np.inf)
    while len(chosen) < count:
        square = np.minimum(square, ((x - x[chosen[-1]]) ** 2).sum(axis=1))
        farthest = int(np.argmax(square))
        if square[farthest] == 0.0:
            break
        chosen.append(farthest)
    return chosen


def _mean_spacing(centres: Array) -> float:
    """Mean distance from a centre to the nearest other; 1 if there is only one."""
    if len(centres) == 1:
        return 1.0
    distances = np.asarray(cKDTree(centres).query(centres, k=2)[0])
    return float(distances[:, 1].mean())
