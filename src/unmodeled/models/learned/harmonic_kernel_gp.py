"""Gaussian process of a harmonic potential with a kernel in closed form."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from scipy.linalg import solve_triangular

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.threads import one_thread
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned._factor import condition_number, factorise
from unmodeled.models.learned._harmonic_kernel_likelihood import (
    HarmonicKernelLikelihood,
    low_design,
)
from unmodeled.models.learned._harmonic_kernels import check_law, derivative_block
from unmodeled.models.learned._input_noise import PASSES, sample_variances
from unmodeled.models.learned._likelihood_search import most_likely
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress

__all__ = ["HarmonicKernelGP"]

#: Positions predicted at once.
_CHUNK = 64
#: The grid of starts, judged on about so many samples: q as a share of the largest, s^2, and noise
#: as a share of the mean square of the accelerations.
_SHARES, _SIGNALS, _NOISES, _SAMPLES = (0.4, 0.8), (1e-4, 1e-1), (1e-10, 1e-5, 1e-2), 60
#: Relative gain of the likelihood at which the search ends: less than 0.01 for 1000 samples.
_ENOUGH = 1e-6
#: Smallest q; bounds of s^2.
_LEAST_RATIO, _SIGNAL_LIMITS = 0.05, (1e-16, 1e8)
#: Largest q as a share of the smallest radius: there every pair of samples has s < 0.91.
_NEAREST = 0.95


class HarmonicKernelGP(Learner):
    r"""The process of `HarmonicGP` without a highest degree: its kernels in closed form.

    Potentials have the covariance :math:`(GM/R)^2 (s^2/q^2) \sum_n \sigma_n^2
    (q^2/(r r'))^{n+1} P_n`, lengths in R, with sigma_n^2 of 1 (``reciprocal``), 2n + 1
    (``abel_poisson``) or 1/(n + 1) (``logarithmic``) [Moritz1980]; mass and centre of mass have a
    flat prior. q (the radius of the Bjerhammar sphere over R, below 1 and 0.95 of the smallest
    radius), s and the noise maximise the restricted likelihood (L-BFGS-B, closed-form gradient).
    Harmonic outside the Bjerhammar sphere; refused inside. Potential, acceleration and gravity
    gradient come with their covariances.

    Parameters
    ----------
    kernel : {"abel_poisson", "reciprocal", "logarithmic"}
        Law of the degree variances.
    gm, radius : float
        Reference values in the units of the samples.
    max_samples : int
        More samples are refused: the matrix has 3n rows.
    iterations : int
        Steps of the optimiser at most.
    noise_floor : float
        Least noise variance, as a share of the mean square of the accelerations.
    position_noise : bool
        Whether known position noise counts as noise of single samples through the gravity
        gradient of the process, fitted three times.

    Attributes
    ----------
    attenuation_, amplitude_ : float
        q and s.
    noise_std_ : float
        In the units of the accelerations.
    nll_ : float
        Negative log restricted likelihood, accelerations in units of GM/R^2.
    jitter_ : float
        Share of the mean diagonal that was added to factorise; 0 is healthy.
    """

    name: ClassVar[str] = "harmonic_kernel_gp"
    has_covariance = True
    stands_alone: ClassVar[bool] = True

    attenuation_: float
    amplitude_: float
    noise_std_: float
    nll_: float
    jitter_: float

    def __init__(
        self,
        kernel: str = "abel_poisson",
        gm: float = NORMALISED_GM,
        radius: float = 1.0,
        max_samples: int = 1000,
        iterations: int = 60,
        noise_floor: float = 1e-14,
        position_noise: bool = True,
    ) -> None:
        self.kernel = kernel
        self.gm = gm
        self.radius = radius
        self.max_samples = max_samples
        self.iterations = iterations
        self.noise_floor = noise_floor
        self.position_noise = position_noise

    # Fit -------------------------------------------------------------------------------------

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        self._check(len(X))
        x, t = X / self.radius, y / self._unit(1)
        passes = PASSES if self.position_noise and noise.position else 1
        level = noise if passes > 1 else NoiseLevel(0.0, noise.acceleration, noise.samples)
        theta = None
        for k in range(passes):

            def tell(share: float, k: int = k) -> None:
                progress((k + share) / passes)

            gradient = self._jacobian(X) if k else None
            own = sample_variances(level, len(X), gradient) / self._unit(1) ** 2
            size = float((t**2).mean())
            if theta is None:
                theta = self._start(x, t, own, size, noise.acceleration / self._unit(1))
            theta = self._optimum(x, t, own, size, theta, tell)
            self._condition(x, t, own, theta)
        progress(1.0)

    def _check(self, count: int) -> None:
        check_law(self.name, self.kernel)
        for key in ("gm", "radius", "max_samples", "iterations", "noise_floor"):
            value = getattr(self, key)
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"{self.name}: {key} is {value}", allowed="a number > 0")
        if count > self.max_samples:
            raise DataError(
                f"{self.name} was given {count} samples: matrices of {72e-9 * count**2:.2g} GB "
                f"and {27e-9 * count**3:.2g} Gflop for each of some 30 steps",
                allowed=f"max_samples, {self.max_samples}",
                do="thin the samples, raise max_samples, or use harmonic_gp",
            )

    def _unit(self, order: int) -> float:
        """GM/R of the potential, GM/R^2 of the acceleration, GM/R^3 of the gradient."""
        return self.gm / self.radius ** (order + 1)

    def _start(self, x: Array, t: Array, own: Array, size: float, known: float) -> Array:
        """Return the most likely of a small grid, on some of the samples."""
        some = slice(None, None, -(-len(x) // _SAMPLES))
        likelihood = HarmonicKernelLikelihood(self.kernel, x[some], t[some], own[some])
        best, found = np.inf, np.array([0.25, 1e-2, max(1e-4, self.noise_floor) * size])
        for share in _SHARES:
            for signal in _SIGNALS:
                for level in (known**2,) if known else [n * size for n in _NOISES]:
                    theta = np.array(
                        [(share * _largest(x)) ** 2, signal, max(level, self.noise_floor * size)]
                    )
                    value = likelihood(np.log(theta))[0]
                    if value < best:
                        best, found = value, theta
        return found

    def _optimum(
        self, x: Array, t: Array, own: Array, size: float, theta: Array, tell: Progress
    ) -> Array:
        likelihood = HarmonicKernelLikelihood(self.kernel, x, t, own)
        ratios = (_LEAST_RATIO**2, _largest(x) ** 2)
        limits = [ratios, _SIGNAL_LIMITS, (self.noise_floor * size, 1e4 * size)]
        return most_likely(self.name, likelihood, theta, limits, self.iterations, tell, _ENOUGH)

    def _condition(self, x: Array, t: Array, own: Array, theta: Array) -> None:
        self._set_state(x, theta, own)
        likelihood = HarmonicKernelLikelihood(self.kernel, x, t, own)
        factor = self._factorise()
        norm = float(np.abs(likelihood.matrix(theta)).sum(axis=0).max())
        self._condition_number = condition_number(factor, norm)
        self.nll_, self._low, self._weights = likelihood.condition(factor)

    def _set_state(self, x: Array, theta: Array, own: Array) -> None:
        self._x, self._theta, self._own = x, theta, own
        self.attenuation_ = math.sqrt(float(theta[0]))
        self.amplitude_ = math.sqrt(float(theta[1]))
        self.noise_std_ = math.sqrt(float(theta[2])) * self._unit(1)

    def _factorise(self) -> Array:
        likelihood = HarmonicKernelLikelihood(self.kernel, self._x, self._x, self._own)
        with one_thread():  # after loading as after the fit
            factor, self.jitter_ = factorise(self.name, likelihood.matrix(self._theta))
        return factor

    # Use -------------------------------------------------------------------------------------

    def _predict(self, X: Array) -> Array:
        return self._mean(X, 1)

    def _jacobian(self, X: Array) -> Array:
        return self._mean(X, 2).reshape(-1, 3, 3)

    def potential(self, X: Array) -> Array:
        """Return the potential (n,) at positions ``X`` (n, 3); acceleration is its gradient."""
        return self._mean(self._checked(X), 0)[:, 0]

    def _mean(self, X: Array, order: int) -> Array:
        """Return derivatives (n, 3^order) of the potential."""
        found = []
        for x, cross in self._pieces(X, order):
            # Sums along the last axis, not BLAS, so that a row does not depend on its batch.
            low = (low_design(x, order) * self._low).sum(axis=-1).T
            found.append(low + (cross * self._weights).sum(axis=-1))
        return self._unit(order) * np.concatenate(found)

    def _pieces(self, X: Array, order: int) -> Iterator[tuple[Array, Array]]:
        """Chunks: scaled positions (m, 3) and covariances (m, 3^order, 3n) with the samples."""
        c, signal, _ = (float(v) for v in self._theta)
        scaled = X / self.radius
        radius = np.sqrt((scaled**2).sum(axis=1))
        if (radius <= self.attenuation_).any():
            k = int(np.argmin(radius))
            raise DataError(
                f"position {k} is {radius[k]:.3g} reference radii from the origin, inside the "
                f"Bjerhammar sphere of {self.attenuation_:.3g}",
                allowed="positions outside, where the process is defined",
            )
        for k in range(0, max(len(scaled), 1), _CHUNK):
            x = scaled[k : k + _CHUNK]
            block = derivative_block(self.kernel, x, self._x, c, order, 1)
            block = block.reshape(len(x), len(self._x), 3**order, 3).transpose(0, 2, 3, 1)
            yield x, (signal / c) * block.reshape(len(x), 3**order, 3 * len(self._x))

    def _predict_covariance(self, X: Array) -> Array:
        return self._covariance(X, 1)

    def potential_variance(self, X: Array) -> Array:
        """Return the variance (n,) of the potential at positions ``X`` (n, 3)."""
        return self._covariance(self._checked(X), 0)[:, 0, 0]

    def jacobian_covariance(self, X: Array) -> Array:
        """Return the covariance (n, 9, 9) of the gravity gradient, its elements row by row."""
        return self._covariance(self._checked(X), 2)

    def _covariance(self, X: Array, order: int) -> Array:
        factor = self._factorise()
        c, signal, _ = (float(v) for v in self._theta)
        low = low_design(self._x, 1).reshape(-1, 4)
        ones = solve_triangular(factor, low, lower=True)
        root = np.linalg.inv(np.linalg.qr(ones)[1])
        blocks, size = [], 3**order
        for x, cross in self._pieces(X, order):
            rows = solve_triangular(
                factor, cross.reshape(len(x) * size, 3 * len(self._x)).T, lower=True
            ).T
            half = rows.reshape(len(x), size, 3 * len(self._x))
            rest = (low_design(x, order).transpose(1, 0, 2) - half @ ones) @ root
            alone = x[:, None, :]
            prior = derivative_block(self.kernel, alone, alone, c, order, order)
            prior = (signal / c) * prior.reshape(len(x), size, size)
            values, vectors = np.linalg.eigh(prior - half @ half.mT + rest @ rest.mT)
            # Right at a sample the difference is lost in the rounding of the prior.
            largest = np.trace(prior, axis1=1, axis2=2)[:, None]
            least = 10 * np.finfo(float).eps * largest if order < 2 else 0.0
            block = (vectors * np.maximum(values, least)[:, None, :]) @ vectors.mT
            blocks.append(0.5 * (block + block.mT))
        return self._unit(order) ** 2 * np.concatenate(blocks)

    # Reports and files -----------------------------------------------------------------------

    def facts(self) -> dict[str, float | str]:
        """Return hyperparameters in the units of the samples, and the health of the algebra."""
        self._require_fitted()
        return {
            "kernel": self.kernel,
            "prior attenuation q": self.attenuation_,
            "prior amplitude s": self.amplitude_,
            "noise_std": self.noise_std_,
            "fitted GM / reference GM": float(self._low[0]),
            "negative_log_likelihood": self.nll_,
            "jitter": self.jitter_,
            "condition_number": self._condition_number,
        }

    def _arrays(self) -> dict[str, Array]:
        return {
            "x": self._x,
            "theta": self._theta,
            "low": self._low,
            "weights": self._weights,
            "numbers": np.array([self.nll_, self.jitter_, self._condition_number]),
            "sample_variance": self._own,
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        self._set_state(arrays["x"], arrays["theta"], arrays["sample_variance"])
        self._low, self._weights = arrays["low"], arrays["weights"]
        self.nll_, self.jitter_, self._condition_number = (float(v) for v in arrays["numbers"])


def _largest(x: Array) -> float:
    """Largest q that samples at ``x`` (n, 3) allow."""
    return min(1.0, _NEAREST * float(np.sqrt((x**2).sum(axis=1).min())))
