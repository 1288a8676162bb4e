"""Gaussian process of a potential: the acceleration has no curl, and nothing else is assumed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from scipy.linalg import solve_triangular

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.threads import one_thread
from unmodeled.models.learned._curl_free_likelihood import CurlFreeLikelihood, covariance
from unmodeled.models.learned._factor import condition_number, factorise
from unmodeled.models.learned._input_noise import PASSES, sample_variances
from unmodeled.models.learned._likelihood_search import most_likely
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["CurlFreeGP"]

#: Positions predicted at once.
_CHUNK = 64
#: Up to this many samples the factor is kept, 8 MB; above, computed when needed.
_KEEP = 340
#: The grid of starts, in scaled units, judged on about so many samples: lengthscales, and noise
#: variance per signal variance.
_LENGTHS, _NOISES, _SAMPLES = (0.5, 1.5, 4.0), (1e-8, 1e-5, 1e-2, 1.0), 80
#: Bounds of lengthscale and signal variance, scaled; most signal per least noise variance.
_LENGTH_LIMITS, _SIGNAL_LIMITS, _MOST_CONTRAST = (1e-2, 1e2), (1e-8, 1e8), 1e12


class CurlFreeGP(Learner):
    """One joint process of the three components: the gradient of a potential with an RBF kernel.

    Any conservative field, harmonic or not.  The potential comes with it (`potential`), and the
    Jacobian is symmetric to rounding: a flown orbit keeps its energy.  One lengthscale, signal and
    noise variance for all, to the optimum of the marginal likelihood (L-BFGS-B, closed-form
    gradient); a constant mean at its most likely value.

    Parameters
    ----------
    max_samples : int
        More samples are refused: the matrix has 3n rows, 72 n^2 bytes several times over and 9 n^3
        operations a step, 27 times those of one component of `ExactGP`.
    iterations : int
        Steps of the optimiser at most.
    noise_floor : float
        Least noise variance, as a share of the mean variance of the accelerations.
    position_noise : bool
        Whether known position noise counts as noise of single samples through the gradient of the
        process, fitted three times.

    Attributes
    ----------
    jitter_ : float
        Share of the mean diagonal that was added to factorise; 0 is healthy.
    nll_ : float
        Negative log marginal likelihood of the scaled targets.
    lengthscale_, amplitude_, noise_std_ : float
        In units of length, acceleration and acceleration.
    """

    name: ClassVar[str] = "curl_free_gp"
    has_covariance = True

    jitter_: float
    nll_: float
    lengthscale_: float
    amplitude_: float
    noise_std_: float

    def __init__(
        self,
        max_samples: int = 1000,
        iterations: int = 60,
        noise_floor: float = 1e-8,
        position_noise: bool = True,
    ) -> None:
        self.max_samples = max_samples
        self.iterations = iterations
        self.noise_floor = noise_floor
        self.position_noise = position_noise

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        for key in ("max_samples", "iterations", "noise_floor"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}", allowed="> 0")
        if len(X) > self.max_samples:
            raise DataError(
                f"{self.name} was given {len(X)} samples: matrices of {72e-9 * len(X) ** 2:.2g} GB "
                f"and {len(X) ** 3 * 9e-9:.2g} Gflop for each of some 30 steps",
                allowed=f"max_samples, {self.max_samples}",
                do="thin the samples, raise max_samples, or use sparse_gp or harmonic_gp",
            )
        scaling = Standardiser.of(X, y)
        x, t = scaling.positions(X), scaling.targets(y)
        passes = PASSES if self.position_noise and noise.position else 1
        level = noise if passes > 1 else NoiseLevel(0.0, noise.acceleration, noise.samples)
        theta = None
        for k in range(passes):

            def tell(share: float, k: int = k) -> None:
                progress((k + share) / passes)

            gradient = self._jacobian(X) if k else None
            own = sample_variances(level, len(X), gradient) / scaling.y_scale**2
            if theta is None:
                theta = self._start(x, t, own, (noise.acceleration / scaling.y_scale) ** 2)
            theta = self._optimum(CurlFreeLikelihood(x, t, own), theta, tell)
            self._condition(scaling, x, t, own, theta)
        progress(1.0)

    def _start(self, x: Array, t: Array, own: Array, known: float) -> Array:
        """Return the most likely of a small grid, on some of the samples."""
        some = slice(None, None, -(-len(x) // _SAMPLES))
        likelihood = CurlFreeLikelihood(x[some], t[some], own[some])
        best, found = np.inf, np.array([1.0, 1.0, 1.0])
        for length in _LENGTHS:
            for ratio in _NOISES:
                theta = np.array([length, 1.0, max(known or ratio, 2 * self.noise_floor)])
                value = likelihood(np.log(theta))[0]
                if value < best:
                    best, found = value, theta
        return found

    def _optimum(self, likelihood: CurlFreeLikelihood, theta: Array, tell: Progress) -> Array:
        most = max(1.0, min(_SIGNAL_LIMITS[1], _MOST_CONTRAST * self.noise_floor))
        limits = [_LENGTH_LIMITS, (_SIGNAL_LIMITS[0], most), (self.noise_floor, 1e4)]
        return most_likely(self.name, likelihood, theta, limits, self.iterations, tell)

    def _condition(
        self, scaling: Standardiser, x: Array, t: Array, own: Array, theta: Array
    ) -> None:
        self._set_state(scaling, x, theta, own)
        likelihood = CurlFreeLikelihood(x, t, own)
        factor = self._factorise()
        norm = float(np.abs(likelihood.matrix(theta)).sum(axis=0).max())
        self._condition_number = condition_number(factor, norm)
        self.nll_, self._mean, weights = likelihood.condition(factor)
        self._weights = np.ascontiguousarray(weights.reshape(3, -1))

    def _set_state(self, scaling: Standardiser, x: Array, theta: Array, own: Array) -> None:
        self._scaling, self._x, self._theta, self._own = scaling, x, theta, own
        self.lengthscale_ = float(theta[0]) * scaling.x_scale
        self.amplitude_ = float(np.sqrt(theta[1])) * scaling.y_scale
        self.noise_std_ = float(np.sqrt(theta[2])) * scaling.y_scale

    def _factorise(self) -> Array:
        kernel = CurlFreeLikelihood(self._x, self._x, self._own).matrix(self._theta)
        with one_thread():  # after loading as after the fit
            factor, self.jitter_ = factorise(self.name, kernel)
        self._kept_factor = factor if len(self._x) <= _KEEP else None
        return factor

    def _pieces(self, X: Array) -> Iterator[tuple[Array, list[Array], Array, Array]]:
        """Chunks: scaled positions, steps d (3 of (m, n)), v exp(-d.d / 2), d . weights."""
        length, signal, _ = self._theta
        x = self._scaling.positions(X)
        for k in range(0, max(len(x), 1), _CHUNK):
            part = x[k : k + _CHUNK]
            d = [(part[:, None, i] - self._x[None, :, i]) / length for i in range(3)]
            smooth = signal * np.exp(-0.5 * (d[0] ** 2 + d[1] ** 2 + d[2] ** 2))
            along = sum(d[i] * self._weights[i] for i in range(3))
            yield part, d, smooth, np.asarray(along)

    def _predict(self, X: Array) -> Array:
        # Sums along the last axis, not BLAS, so that a row does not depend on its batch.
        scaled = [
            np.stack(
                [(smooth * (self._weights[i] - d[i] * along)).sum(axis=-1) for i in range(3)],
                axis=1,
            )
            for _, d, smooth, along in self._pieces(X)
        ]
        return self._scaling.accelerations(self._mean + np.concatenate(scaled))

    def _jacobian(self, X: Array) -> Array:
        w, blocks = self._weights, []
        for x, d, smooth, along in self._pieces(X):
            block = np.empty((len(x), 3, 3))
            for i in range(3):
                for j in range(i, 3):
                    inner = d[i] * d[j] * along - d[j] * w[i] - d[i] * w[j]
                    if i == j:
                        inner = inner - along
                    block[:, i, j] = block[:, j, i] = (smooth * inner).sum(axis=-1)
            blocks.append(block)
        jacobian: Array = self._scaling.slope / self._theta[0] * np.concatenate(blocks)
        return jacobian

    def potential(self, X: Array) -> Array:
        """Return the potential (n,) at positions ``X`` (n, 3), up to a constant.

        Its gradient is the acceleration; units of acceleration times length.
        """
        X = self._checked(X)
        scaled = [
            x @ self._mean + self._theta[0] * (smooth * along).sum(axis=-1)
            for x, _, smooth, along in self._pieces(X)
        ]
        size = self._scaling.y_scale * self._scaling.x_scale
        potential: Array = X @ self._scaling.y_mean + size * np.concatenate(scaled)
        return potential

    def _predict_covariance(self, X: Array) -> Array:
        factor = self._factorise() if self._kept_factor is None else self._kept_factor
        length, signal, _ = (float(v) for v in self._theta)
        ones = solve_triangular(factor, np.kron(np.eye(3), np.ones((len(self._x), 1))), lower=True)
        normal = np.linalg.inv(ones.T @ ones)
        blocks = []
        for x, *_ in self._pieces(X):
            cross = covariance(self._x, x, length, signal)
            half = solve_triangular(factor, cross, lower=True).reshape(-1, 3, len(x))
            block = signal * np.eye(3) - np.einsum("kim,kjm->mij", half, half)
            # [Rasmussen2006] Eq. 2.42: the mean is estimated too. Where noise hides the field, the
            # likelihood sees none, and this is all that is left of the variance.
            rest = np.eye(3) - np.einsum("ka,kim->mai", ones, half)
            block += rest.mT @ normal @ rest
            values, vectors = np.linalg.eigh(0.5 * (block + block.mT))
            # Right at a sample the difference is lost in the rounding of the signal variance.
            values = np.maximum(values, 10 * np.finfo(float).eps * signal)
            block = (vectors * values[:, None, :]) @ vectors.mT
            blocks.append(0.5 * (block + block.mT))
        return self._scaling.y_scale**2 * np.concatenate(blocks)

    def facts(self) -> dict[str, float | str]:
        """Return hyperparameters in the units of the samples, and the health of the algebra."""
        self._require_fitted()
        return {
            "lengthscale": self.lengthscale_,
            "amplitude": self.amplitude_,
            "noise_std": self.noise_std_,
            "negative_log_likelihood": self.nll_,
            "jitter": self.jitter_,
            "condition_number": self._condition_number,
        }

    def _arrays(self) -> dict[str, Array]:
        return self._scaling.arrays() | {
            "x": self._x,
            "theta": self._theta,
            "mean": self._mean,
            "weights": self._weights,
            "numbers": np.array([self.nll_, self.jitter_, self._condition_number]),
            "sample_variance": self._own,
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        self._set_state(
            Standardiser.restore(arrays), arrays["x"], arrays["theta"], arrays["sample_variance"]
        )
        self._mean, self._weights = arrays["mean"], arrays["weights"]
        self.nll_, self.jitter_, self._condition_number = (float(v) for v in arrays["numbers"])
        self._kept_factor = None  # made when a covariance is asked for
