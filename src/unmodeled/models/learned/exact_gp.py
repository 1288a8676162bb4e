"""Exact Gaussian process: constant mean, radial kernel, exact marginal likelihood, Adam."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
import torch
from scipy.linalg import solve_triangular

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned._components import component_facts, in_units
from unmodeled.models.learned._exact_gp_likelihood import Likelihood
from unmodeled.models.learned._exact_gp_training import adam, best_start, optimum
from unmodeled.models.learned._factor import condition_number, factorise
from unmodeled.models.learned._input_noise import PASSES, sample_variances
from unmodeled.models.learned._kernels import check_kernel, covariances, slopes
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

if TYPE_CHECKING:
    from unmodeled.models.learned._exact_gp_gpytorch import GpytorchModel

__all__ = ["ExactGP"]

_OPTIMIZERS = ("adam", "lbfgs", "newton")

#: Positions predicted at once; bounds the memory at about 256 * n * 32 bytes.
_CHUNK = 256
#: Up to this many samples the Cholesky factors are kept, 6 MB; above, computed when needed.
_KEEP = 512


class ExactGP(Learner):
    """Three independent exact Gaussian processes, one for each acceleration component.

    The Gaussian process of [Neamati2022] Table 1: constant mean, RBF kernel, exact marginal
    likelihood, Adam at a constant rate.  What the paper leaves open is set here so that
    noise-free data do not break it: float64, exact Cholesky at any size (gpytorch changes to
    stochastic conjugate gradients above 800 samples without a word), a noise floor of 1e-8
    instead of gpytorch's 1e-4, which would be the accuracy floor, and a start chosen by marginal
    likelihood from a grid, because Adam from a noisy start explains clean data as noise.  Of all
    epochs the best one is kept, separately for each component.

    Samples are centred and scaled (`Standardiser`); hyperparameters that `facts` reports are back
    in the units of the samples.  Training is in gpytorch, everything after it in numpy.

    Parameters
    ----------
    epochs : int
        Adam steps. Cost is 3 Cholesky factorisations and their gradients each.
    learning_rate : float
        Of Adam, on gpytorch's raw (softplus) hyperparameters.
    noise_floor : float
        Least noise variance, as a share of the mean variance of the accelerations.
    optimizer : {"adam", "lbfgs", "newton"}
        ``adam`` is the paper's, with a fixed number of epochs. ``lbfgs`` and ``newton`` go to the
        optimum in ``epochs`` steps at most, by scipy's L-BFGS-B or with closed-form second
        derivatives; ``newton`` is the fastest.
    kernel : {"rbf", "matern12", "matern32", "matern52"}
        The paper's, or Matern of smoothness 1/2, 3/2, 5/2: rougher fields.
    ard : bool
        A lengthscale for each input instead of one (automatic relevance determination); not with
        ``newton``. For inputs beyond the position: along one orbit the plane decides otherwise.
    position_noise : bool
        Whether known position noise counts as noise of single samples through the gradient of the
        process, fitted three times. The paper's process knows nothing of it.

    Attributes
    ----------
    jitter_ : float
        Largest share of the kernel's mean diagonal that was added to factorise it; 0 is healthy.
    nll_ : ndarray (3,)
        Negative log marginal likelihood of the scaled targets, by component.
    lengthscale_, amplitude_, noise_std_ : ndarray (3,)
        Hyperparameters by component, in units of length, acceleration and acceleration;
        ``lengthscale_`` with ``ard`` (3, d), in the units of the inputs.

    Notes
    -----
    Known acceleration noise is the start of the noise, not its value; that of single samples is
    added to it as it is.  Without ``position_noise`` the fitted noise takes up what it can of that
    of the positions.  [Rasmussen2006] Algorithm 2.1.
    """

    name: ClassVar[str] = "exact_gp"
    has_covariance = True
    takes_features = True

    jitter_: float
    nll_: Array
    lengthscale_: Array
    amplitude_: Array
    noise_std_: Array

    def __init__(
        self,
        epochs: int = 100,
        learning_rate: float = 0.1,
        noise_floor: float = 1e-8,
        optimizer: Literal["adam", "lbfgs", "newton"] = "adam",
        kernel: Literal["rbf", "matern12", "matern32", "matern52"] = "rbf",
        ard: bool = False,
        position_noise: bool = False,
    ) -> None:
        self.epochs = epochs
        self.learning_rate = learning_rate
        self.noise_floor = noise_floor
        self.optimizer = optimizer
        self.kernel = kernel
        self.ard = ard
        self.position_noise = position_noise

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        self._fit_stack([self], [X], [y], [noise], torch.device("cpu"), progress)

    @classmethod
    def _fit_stack(
        cls,
        members: Sequence[ExactGP],
        X: Sequence[Array],
        y: Sequence[Array],
        noise: Sequence[NoiseLevel],
        device: torch.device,
        progress: Progress,
    ) -> list[NumericalError | None]:
        """Train members of the same hyperparameters on data of one size; see `fit_batch`.

        Raises
        ------
        NumericalError
            For a single member; of several, the error stands in the place of the member.
        """
        first = members[0]
        first._check()
        scalings = [Standardiser.of(a, b) for a, b in zip(X, y, strict=True)]
        x = [s.positions(a) for s, a in zip(scalings, X, strict=True)]
        t = [s.targets(b) for s, b in zip(scalings, y, strict=True)]
        known = [(n.acceleration / s.y_scale) ** 2 for s, n in zip(scalings, noise, strict=True)]
        floor = first.noise_floor
        lengths = x[0].shape[1] if first.ard else 1
        starts = [
            best_start(a, b, floor, k, first.kernel, lengths)
            for a, b, k in zip(x, t, known, strict=True)
        ]
        errors: list[NumericalError | None] = [None] * len(members)
        passes = PASSES if first.position_noise and any(n.position for n in noise) else 1
        for k in range(passes):

            def tell(share: float, k: int = k) -> None:
                progress((k + share) / passes)

            own = [
                m._own_variances(n, a, e is None and k > 0) / s.y_scale**2
                for m, n, a, e, s in zip(members, noise, X, errors, scalings, strict=True)
            ]
            likelihood = Likelihood(x, t, device, own, first.kernel, first.ard)
            if first.optimizer == "adam":
                thetas = adam(likelihood, starts, floor, first.epochs, first.learning_rate, tell)
            else:
                thetas = optimum(likelihood, starts, floor, first.optimizer, first.epochs, tell)
            errors = [
                member._adopt(scaling, a, b, o, theta)
                for member, scaling, a, b, o, theta in zip(
                    members, scalings, x, t, own, thetas, strict=True
                )
            ]
        if len(members) == 1 and errors[0] is not None:
            raise errors[0]
        return errors

    def _check(self) -> None:
        for key in ("epochs", "learning_rate", "noise_floor"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}", allowed="> 0")
        if self.optimizer not in _OPTIMIZERS:
            raise ConfigError(
                f'{self.name}: optimizer is "{self.optimizer}"', allowed=", ".join(_OPTIMIZERS)
            )
        check_kernel(self.name, self.kernel)
        if self.ard and self.optimizer == "newton":
            raise ConfigError(
                f'{self.name}: ard with optimizer "newton"',
                allowed="adam, lbfgs",
                do="choose lbfgs: second derivatives are there for one lengthscale only",
            )

    def _own_variances(self, noise: NoiseLevel, X: Array, fitted: bool) -> Array:
        """Return the known noise variances (n, 3) of single samples."""
        if not self.position_noise:
            noise = replace(noise, position=0.0)
        return sample_variances(noise, len(X), self._jacobian(X) if fitted else None)

    def _adopt(
        self, scaling: Standardiser, x: Array, t: Array, own: Array, theta: Array
    ) -> NumericalError | None:
        """Take the hyperparameters that were found; return why not."""
        if not np.isfinite(theta).all():
            return NumericalError(
                f"{self.name}: the marginal likelihood of {len(x)} samples cannot be computed",
                do="raise noise_floor or remove repeated positions",
            )
        try:
            self._set_state(scaling, x, theta, own)
            self._condition(t)
        except NumericalError as found:
            return found
        return None

    def to_gpytorch(self) -> GpytorchModel:
        """Return the same process as a gpytorch model, in scaled positions and targets.

        Use it inside ``exact_algebra`` of the same module: by default gpytorch leaves exact
        algebra above 800 samples.
        """
        # gpytorch takes two seconds to import, and nothing else here needs it.
        from unmodeled.models.learned._exact_gp_gpytorch import GpytorchModel

        self._require_fitted()
        if self._own.any():
            raise ConfigError(
                f"{self.name}: noise of single samples in gpytorch's one noise level",
                allowed="a process fitted without it",
            )
        noise = self._theta[-2] * self._weights.T
        smooth = (self._covariances(self._x) * self._weights).sum(axis=-1)
        targets = self._theta[-1] + smooth + noise
        twin = GpytorchModel(self._x, targets, self.noise_floor, self.kernel, self.ard)
        twin.set_theta(self._theta)
        return twin

    def _set_state(self, scaling: Standardiser, x: Array, theta: Array, own: Array) -> None:
        """Take rows of ``theta`` (l + 3, 3): lengthscales, signal and noise variance, mean.

        ``own`` (n, 3): known noise variances of the samples beside the estimated ones.
        """
        self._scaling, self._x, self._theta, self._own = scaling, x, theta, own
        self.lengthscale_, self.amplitude_, self.noise_std_ = in_units(theta, scaling, self.ard)

    def _condition(self, t: Array) -> None:
        """Factorise, and compute weights (3, n) and likelihoods."""
        factors = self._factorise()
        residuals = t.T - self._theta[-1][:, None]
        halves = [
            solve_triangular(f, r, lower=True) for f, r in zip(factors, residuals, strict=True)
        ]
        self._weights = np.stack(
            [
                solve_triangular(f, h, lower=True, trans="T")
                for f, h in zip(factors, halves, strict=True)
            ]
        )
        logdet = np.array([2 * np.log(np.diag(f)).sum() for f in factors])
        quadratic = np.array([h @ h for h in halves])
        self.nll_ = 0.5 * (quadratic + logdet + len(t) * np.log(2 * np.pi))

    def _factorise(self) -> Array:
        """Return the lower Cholesky factors (3, n, n), with jitter where it must be."""
        factors = np.empty((3, len(self._x), len(self._x)))
        jitters, conditions = [], []
        for i, own in enumerate(self._own.T):
            kernel = self._covariance_of(i, self._x)
            kernel[np.diag_indices_from(kernel)] += self._theta[-2, i] + own
            norm = float(np.abs(kernel).sum(axis=0).max())
            factors[i], jitter = factorise(self.name, kernel)
            jitters.append(jitter)
            conditions.append(condition_number(factors[i], norm))
        self.jitter_ = max(jitters)
        self._condition_number = max(conditions)
        # Large ones would fill the memory of a sweep; they follow from the rest.
        self._kept_factors = factors if len(self._x) <= _KEEP else None
        return factors

    def _covariance_of(self, i: int, x: Array) -> Array:
        """Covariances (m, n) of component ``i`` at scaled inputs ``x`` (m, d) with the samples."""
        lengths, signal = self._theta[:-3, i], float(self._theta[-3, i])
        return covariances(self.kernel, x, self._x, lengths, signal)

    def _covariances(self, x: Array) -> Array:
        """Covariances (m, 3, n) of scaled inputs ``x`` (m, d) with the samples."""
        return np.stack([self._covariance_of(i, x) for i in range(3)], axis=1)

    def _predict(self, X: Array) -> Array:
        # Sums along the last axis, not BLAS: weights of clean data are large and alternate, and
        # a product that depends on the number of rows would show in the tenth digit.
        scaled = [
            self._theta[-1] + (self._covariances(x) * self._weights).sum(axis=-1)
            for x in _chunks(self._scaling.positions(X))
        ]
        return self._scaling.accelerations(np.concatenate(scaled))

    def _jacobian(self, X: Array) -> Array:
        weights = self._theta[-3][:, None] * self._weights
        rows = [
            np.stack(
                [
                    slopes(self.kernel, x, self._x, self._theta[:-3, i], weights[i])
                    for i in range(3)
                ],
                axis=1,
            )
            for x in _chunks(self._scaling.positions(X))
        ]
        return self._scaling.slopes * np.concatenate(rows)

    def _predict_covariance(self, X: Array) -> Array:
        factors = self._factorise() if self._kept_factors is None else self._kept_factors
        return np.concatenate(
            [self._covariance(x, factors) for x in _chunks(self._scaling.positions(X))]
        )

    def _covariance(self, x: Array, factors: Array) -> Array:
        covariance = np.zeros((len(x), 3, 3))
        kernel = self._covariances(x)
        for i in range(3):
            half = solve_triangular(factors[i], kernel[:, i].T, lower=True)
            # Right at a sample the difference is lost in the rounding of the signal variance.
            signal = float(self._theta[-3, i])
            variance = np.maximum(signal - (half**2).sum(axis=0), np.finfo(float).eps * signal)
            covariance[:, i, i] = variance * self._scaling.y_scale**2
        return covariance

    def facts(self) -> dict[str, float | str]:
        """Return hyperparameters in the units of the samples, and the health of the algebra."""
        self._require_fitted()
        facts = component_facts(
            self.lengthscale_,
            self.ard,
            amplitude=self.amplitude_,
            noise_std=self.noise_std_,
            negative_log_likelihood=self.nll_,
        )
        return facts | {"jitter": self.jitter_, "condition_number": self._condition_number}

    def _arrays(self) -> dict[str, Array]:
        # The factors are n^2 and follow from the rest.
        return self._scaling.arrays() | {
            "x": self._x,
            "theta": self._theta,
            "weights": self._weights,
            "nll": self.nll_,
            "sample_variance": self._own,
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        x = arrays["x"]
        # Files of before the noise of single samples have none.
        own = arrays.get("sample_variance", np.zeros((len(x), 3)))
        self._set_state(Standardiser.restore(arrays), x, arrays["theta"], own)
        self._weights, self.nll_ = arrays["weights"], arrays["nll"]
        self._factorise()


def _chunks(x: Array) -> Iterator[Array]:
    """Yield rows in pieces; one empty piece for no rows."""
    return (x[k : k + _CHUNK] for k in range(0, max(len(x), 1), _CHUNK))
