"""Training of `ExactGP`: gpytorch with exact algebra, from the best start of a grid.

Hyperparameters travel as an array ``theta`` (4, 3) in scaled units: rows are lengthscale, signal
variance, noise variance and mean, columns the acceleration components.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import numpy as np
import torch

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.learned._distances import squared_distances
from unmodeled.models.learned.learner import Progress

with warnings.catch_warnings():
    # linear_operator compiles two functions on import; who makes warnings errors could not import
    warnings.filterwarnings("ignore", r"`torch\.jit\.script` is deprecated", DeprecationWarning)
    import gpytorch
    from linear_operator.utils.errors import NanError, NotPSDError
    from linear_operator.utils.warnings import NumericalWarning

__all__ = ["JITTERS", "GpytorchModel", "best_start", "exact_algebra", "train"]

#: Shares of the signal variance added to a kernel matrix that Cholesky refuses, in turn.
JITTERS = (0.0, *(10.0**e for e in range(-10, -3)))

#: The grid of starts, in scaled units: lengthscales, and noise variance per signal variance.
_LENGTHS = (0.3, 1.0, 3.0)
_NOISES = (1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0)
#: The grid is judged on about this many samples at most: it only picks a start.
_SAMPLES = 500


def best_start(x: Array, t: Array, noise_floor: float, known_noise: float) -> Array:
    """Return the most likely hyperparameters of a small grid, by component.

    At each lengthscale one eigendecomposition gives the likelihood at every noise level, with
    the signal variance at its maximum in closed form.

    Parameters
    ----------
    x, t : ndarray (n, 3)
        Scaled positions and targets.
    noise_floor : float
        Least noise variance, scaled.
    known_noise : float
        Known noise variance, scaled; 0 if unknown. Replaces the grid's.
    """
    step = -(-len(x) // _SAMPLES)
    x, mean = x[::step], t.mean(axis=0)
    square = squared_distances(x, x)
    found = []
    for length in _LENGTHS:
        values, vectors = np.linalg.eigh(np.exp(-0.5 / length**2 * square))
        energy = (vectors.T @ (t[::step] - mean)) ** 2
        for ratio in _NOISES:
            # Eigenvalues below the rounding of the largest are noise themselves.
            total = (np.maximum(values, 0.0) + max(ratio, 1e-15 * values[-1]))[:, None]
            signal = np.maximum((energy / total).mean(axis=0), 10 * noise_floor)
            nll = 0.5 * (
                len(x) * np.log(signal) + np.log(total).sum() + (energy / total).sum(0) / signal
            )
            noise = np.full(3, known_noise) if known_noise else ratio * signal
            theta = [np.full(3, length), signal, np.maximum(noise, 2 * noise_floor), mean]
            found.append((nll, np.stack(theta)))
    best = np.argmin([nll for nll, _ in found], axis=0)
    return np.stack([found[k][1][:, i] for i, k in enumerate(best)], axis=1)


class GpytorchModel(gpytorch.models.ExactGP):  # type: ignore[misc]
    """Three RBF processes as one gpytorch batch, in float64.

    Parameters
    ----------
    x, t : ndarray (n, 3)
        Scaled positions and targets.
    noise_floor : float
        Least noise variance, scaled.
    """

    def __init__(self, x: Array, t: Array, noise_floor: float) -> None:
        batch = torch.Size([3])
        likelihood = gpytorch.likelihoods.GaussianLikelihood(
            batch_shape=batch, noise_constraint=gpytorch.constraints.GreaterThan(noise_floor)
        )
        super().__init__(torch.from_numpy(x), torch.from_numpy(t.T.copy()), likelihood)
        self.mean_module = gpytorch.means.ConstantMean(batch_shape=batch)
        self.covar_module = gpytorch.kernels.ScaleKernel(
            gpytorch.kernels.RBFKernel(batch_shape=batch), batch_shape=batch
        )
        self.double()  # gpytorch makes float32 parameters by the global default

    def forward(self, x: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), self.covar_module(x))

    def set_theta(self, theta: Array) -> None:
        length, signal, noise, mean = torch.from_numpy(theta)
        self.covar_module.base_kernel.lengthscale = length[:, None, None]
        self.covar_module.outputscale = signal
        self.likelihood.noise = noise[:, None]
        self.mean_module.constant = mean

    def theta(self) -> Array:
        rows = (
            self.covar_module.base_kernel.lengthscale,
            self.covar_module.outputscale,
            self.likelihood.noise,
            self.mean_module.constant,
        )
        return np.stack([row.detach().numpy().reshape(3).copy() for row in rows])


@contextmanager
def exact_algebra() -> Iterator[None]:
    """Hold gpytorch to exact Cholesky at any size, with the jitters of this module."""
    settings = gpytorch.settings
    with ExitStack() as stack:
        for context in (
            settings.max_cholesky_size(2**31),
            settings.fast_computations(
                covar_root_decomposition=False, log_prob=False, solves=False
            ),
            settings.cholesky_jitter(double_value=JITTERS[1]),
            settings.cholesky_max_tries(len(JITTERS) - 1),
            warnings.catch_warnings(),
        ):
            stack.enter_context(context)
        # Jitter on the way matters not; the jitter of the result is recorded by `ExactGP`.
        warnings.simplefilter("ignore", NumericalWarning)
        yield


def train(
    x: Array,
    t: Array,
    start: Array,
    noise_floor: float,
    epochs: int,
    learning_rate: float,
    progress: Progress,
) -> Array:
    """Maximise the marginal likelihood by Adam at a constant rate; return the best ``theta``.

    Raises
    ------
    NumericalError
        If the likelihood cannot be computed even at the start.
    """
    model = GpytorchModel(x, t, noise_floor)
    model.set_theta(start)
    model.train()
    objective = gpytorch.mlls.ExactMarginalLogLikelihood(model.likelihood, model)
    adam = torch.optim.Adam(model.parameters(), lr=learning_rate)
    best, theta = np.full(3, np.inf), start
    with exact_algebra():
        for epoch in range(epochs + 1):
            adam.zero_grad()
            try:
                loss = -objective(model(*model.train_inputs), model.train_targets)
            except (NotPSDError, NanError):
                break  # keep the best so far
            value = loss.detach().numpy()
            better = value < best  # False for NaN
            theta = np.where(better, model.theta(), theta)
            best = np.where(better, value, best)
            if epoch == epochs:
                break
            loss.sum().backward()  # the components share nothing
            adam.step()
            progress((epoch + 1) / epochs)
    if not np.isfinite(best).all():
        raise NumericalError(
            f"exact_gp: the marginal likelihood of {len(x)} samples cannot be computed",
            do="raise noise_floor or remove repeated positions",
        )
    return theta
