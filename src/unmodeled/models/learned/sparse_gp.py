"""Sparse Gaussian process: exact_gp through a few inducing points, for 10^4 to 10^5 samples."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from scipy.linalg import LinAlgError, solve_triangular

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned._components import component_facts, in_units
from unmodeled.models.learned._exact_gp_lbfgs import maximise
from unmodeled.models.learned._exact_gp_training import best_start, limits
from unmodeled.models.learned._inducing import greedy_points, kmeans_points
from unmodeled.models.learned._input_noise import PASSES, sample_variances
from unmodeled.models.learned._kernels import check_kernel, covariances, slopes
from unmodeled.models.learned._sparse_bound import JITTER, SparseBound
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["SparseGP"]

#: Positions predicted at once.
_CHUNK = 1024
#: Starts beside the given one: factors of the lengthscales, noise variances per signal variance.
#: From a noise far below what the points can carry, the search would end where all is noise.
_FACTORS, _NOISES = (0.5, 1.0, 2.0), (1e-8, 1e-6, 1e-4, 1e-2, 1.0)
_PLACEMENTS = ("greedy", "kmeans")


class SparseGP(Learner):
    """Three sparse Gaussian processes, one for each acceleration component.

    Titsias' variational bound [Titsias2009], collapsed, with closed-form gradients (L-BFGS-B);
    time n m^2 for each step and memory 8 n m bytes, where `ExactGP` takes n^3 and 24 n^2.  With an
    inducing point on every sample it is the exact process.

    Parameters
    ----------
    inducing : int
        Inducing points m at most, the same for the three components.
    placement : {"greedy", "kmeans"}
        ``greedy`` takes the sample that is least known given those before, with the shortest of
        the lengthscales; ``kmeans`` the means of clusters. Before the first fit and once again.
    evidence_samples : int
        Samples drawn for the search of the hyperparameters, at most; all of them are used then.
    iterations : int
        Steps of the optimiser for each component at most.
    kernel, ard, noise_floor, position_noise
        As in `ExactGP`, but position noise is used by default.
    random_state : int
        Of the draw and of ``kmeans``.

    Attributes
    ----------
    inducing_ : ndarray (m, d)
        In the units of the inputs.
    bound_ : ndarray (3,)
        Negative bound on the log marginal likelihood of the scaled targets that were drawn.
    lengthscale_, amplitude_, noise_std_ : ndarray (3,)
        As those of `ExactGP`.

    Notes
    -----
    The bound calls noise what the points cannot carry; FITC, the other usual form, calls it noise
    of single samples and may hold the noise far too small [Bauer2016].  The covariance is that of
    the points: with many more samples than points it is too small. Measured on one drifting orbit
    with noise of 0.05, 200 points: 2,000, 10,000 and 100,000 samples took 5, 8 and 15 s on one
    core, errors 2.8e-3, 1.6e-3 and 1.2e-3 (`ExactGP` at 2,000: 2.6e-3), and 91, 80 and 73 % of the
    held-out components lay inside the 95 % band.
    """

    name: ClassVar[str] = "sparse_gp"
    has_covariance = True
    takes_features = True

    inducing_: Array
    bound_: Array
    lengthscale_: Array
    amplitude_: Array
    noise_std_: Array

    def __init__(
        self,
        inducing: int = 200,
        placement: Literal["greedy", "kmeans"] = "greedy",
        evidence_samples: int = 4000,
        iterations: int = 60,
        kernel: Literal["rbf", "matern12", "matern32", "matern52"] = "rbf",
        ard: bool = False,
        noise_floor: float = 1e-8,
        position_noise: bool = True,
        random_state: int = 0,
    ) -> None:
        self.inducing = inducing
        self.placement = placement
        self.evidence_samples = evidence_samples
        self.iterations = iterations
        self.kernel = kernel
        self.ard = ard
        self.noise_floor = noise_floor
        self.position_noise = position_noise
        self.random_state = random_state

    def _check(self) -> None:
        for key in ("inducing", "evidence_samples", "iterations", "noise_floor"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}", allowed="> 0")
        if self.placement not in _PLACEMENTS:
            raise ConfigError(
                f'{self.name}: placement is "{self.placement}"', allowed=", ".join(_PLACEMENTS)
            )
        check_kernel(self.name, self.kernel)

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        self._check()
        scaling = Standardiser.of(X, y)
        x, t = scaling.positions(X), scaling.targets(y)
        known = (noise.acceleration / scaling.y_scale) ** 2
        lengths = x.shape[1] if self.ard else 1
        drawn = self._draw(len(x))
        theta = best_start(x[drawn], t[drawn], self.noise_floor, known, self.kernel, lengths)
        # With every sample an inducing point there is nothing to place a second time.
        again = 1 if self.inducing >= len(x) else 2
        aware = self.position_noise and noise.position > 0
        passes = max(again, PASSES if aware else 1)
        level = noise if aware else NoiseLevel(0.0, noise.acceleration, noise.samples)
        for k in range(passes):

            def tell(share: float, k: int = k) -> None:
                progress((k + share) / passes)

            if k < again:
                z = self._points(x, theta[:-3].min(axis=1))
            own = sample_variances(level, len(X), self._jacobian(X) if aware and k else None)
            own /= scaling.y_scale**2
            bound = SparseBound(x[drawn], t[drawn], own[drawn], z, self.kernel)
            if k < again:
                theta = _likeliest(bound, theta, self.noise_floor)
            theta = self._optimum(bound, theta, tell)
            self._condition(scaling, SparseBound(x, t, own, z, self.kernel), z, theta)
        progress(1.0)

    def _draw(self, count: int) -> Array | slice:
        if count <= self.evidence_samples:
            return slice(None)
        generator = np.random.default_rng(self.random_state)
        chosen = generator.choice(count, self.evidence_samples, replace=False)
        return np.sort(chosen)

    def _points(self, x: Array, length: Array) -> Array:
        if self.placement == "greedy":
            return greedy_points(x, self.inducing, self.kernel, length)
        return kmeans_points(x, self.inducing, self.random_state)

    def _optimum(self, bound: SparseBound, theta: Array, tell: Progress) -> Array:
        low, high = limits(self.noise_floor, len(theta) - 3)
        first = np.clip(np.log(theta[:-1].T), low, high)
        point, self.bound_, mean = maximise(bound, first, (low, high), self.iterations, tell)
        if not np.isfinite(self.bound_).all():
            raise NumericalError(
                f"{self.name}: the bound cannot be computed",
                do="raise noise_floor or remove repeated positions",
            )
        return np.column_stack([np.exp(point), mean]).T

    def _condition(self, scaling: Standardiser, bound: SparseBound, z: Array, theta: Array) -> None:
        try:
            found = [bound.posterior(i, theta[:-1, i]) for i in range(3)]
        except (LinAlgError, ValueError) as exc:
            raise NumericalError(
                f"{self.name}: the kernel of {len(z)} inducing points cannot be factorised",
                do="raise noise_floor or lower inducing",
            ) from exc
        theta = np.vstack([theta[:-1], [p.mean for p in found]])
        self._set_state(
            scaling,
            z,
            theta,
            np.stack([p.weights for p in found]),
            np.ascontiguousarray(np.stack([p.root for p in found])),
            np.ascontiguousarray(np.stack([p.inner for p in found])),
        )

    def _set_state(
        self,
        scaling: Standardiser,
        z: Array,
        theta: Array,
        weights: Array,
        roots: Array,
        inner: Array,
    ) -> None:
        self._scaling, self._z, self._theta, self._weights = scaling, z, theta, weights
        self._roots, self._inner = roots, inner
        self.inducing_ = scaling.x_mean + scaling.x_scales * z
        self.lengthscale_, self.amplitude_, self.noise_std_ = in_units(theta, scaling, self.ard)

    def _predict(self, X: Array) -> Array:
        # Sums along the last axis, not BLAS, so that a row does not depend on its batch.
        columns = [np.empty((0, 3))]
        for x in self._chunks(X):
            parts = [(self._cross(i, x) * self._weights[i]).sum(axis=-1) for i in range(3)]
            columns.append(self._theta[-1] + np.stack(parts, axis=1))
        return self._scaling.accelerations(np.concatenate(columns))

    def _jacobian(self, X: Array) -> Array:
        weights = self._theta[-3][:, None] * self._weights
        blocks = [np.empty((0, 3, self._z.shape[1]))]
        for x in self._chunks(X):
            parts = [
                slopes(self.kernel, x, self._z, self._theta[:-3, i], weights[i]) for i in range(3)
            ]
            blocks.append(np.stack(parts, axis=1))
        return self._scaling.slopes * np.concatenate(blocks)

    def _predict_covariance(self, X: Array) -> Array:
        blocks = [np.zeros((0, 3, 3))]
        for x in self._chunks(X):
            block = np.zeros((len(x), 3, 3))
            for i in range(3):
                signal = float(self._theta[-3, i])
                half = solve_triangular(self._roots[i], self._cross(i, x).T, lower=True)
                known = solve_triangular(self._inner[i], half, lower=True)
                variance = signal - (half**2).sum(axis=0) + (known**2).sum(axis=0)
                # Right at a point the difference is lost in the rounding of the signal variance.
                block[:, i, i] = np.maximum(variance, np.finfo(float).eps * signal)
            blocks.append(block)
        return self._scaling.y_scale**2 * np.concatenate(blocks)

    def _cross(self, i: int, x: Array) -> Array:
        """Covariances (k, m) of component ``i`` at scaled inputs with the inducing points."""
        return covariances(self.kernel, x, self._z, self._theta[:-3, i], float(self._theta[-3, i]))

    def _chunks(self, X: Array) -> list[Array]:
        x = self._scaling.positions(X)
        return [x[k : k + _CHUNK] for k in range(0, len(x), _CHUNK)]

    def facts(self) -> dict[str, float | str]:
        """Return the number of inducing points and hyperparameters in the units of the samples."""
        self._require_fitted()
        return {"inducing points": float(len(self._z)), "jitter": JITTER} | component_facts(
            self.lengthscale_,
            self.ard,
            amplitude=self.amplitude_,
            noise_std=self.noise_std_,
            negative_bound=self.bound_,
        )

    def _arrays(self) -> dict[str, Array]:
        return self._scaling.arrays() | {
            "inducing": self._z,
            "theta": self._theta,
            "weights": self._weights,
            "roots": self._roots,
            "inner": self._inner,
            "bound": self.bound_,
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        self.bound_ = arrays["bound"]
        self._set_state(
            Standardiser.restore(arrays),
            *(arrays[k] for k in ("inducing", "theta", "weights", "roots", "inner")),
        )


def _likeliest(bound: SparseBound, theta: Array, noise_floor: float) -> Array:
    """Return the most likely of some hyperparameters around ``theta`` (l + 3, 3), by component."""
    candidates = [theta]
    for factor in _FACTORS:
        for ratio in _NOISES:
            other = theta.copy()
            other[:-3] *= factor
            other[-2] = np.maximum(ratio * theta[-3], 2 * noise_floor)
            candidates.append(other)
    values = np.stack([bound.values(np.log(c[:-1].T)) for c in candidates])
    best = np.argmin(values, axis=0)
    return np.stack([candidates[k][:, i] for i, k in enumerate(best)], axis=1)
