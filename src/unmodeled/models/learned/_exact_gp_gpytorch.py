"""The process of `ExactGP` in gpytorch, with exact algebra.

Hyperparameters travel as an array ``theta`` (l + 3, 3) in scaled units: rows are lengthscales
(l = 1, or one for each input), signal variance, noise variance and mean, columns the acceleration
components.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import numpy as np
import torch

from unmodeled.core.arrays import Array
from unmodeled.models.learned._factor import JITTERS

with warnings.catch_warnings():
    # linear_operator compiles two functions on import; who makes warnings errors could not import
    warnings.filterwarnings("ignore", r"`torch\.jit\.script` is deprecated", DeprecationWarning)
    import gpytorch
    from linear_operator.utils.warnings import NumericalWarning

__all__ = ["GpytorchModel", "exact_algebra"]

_SMOOTHNESS = {"matern12": 0.5, "matern32": 1.5, "matern52": 2.5}


class GpytorchModel(gpytorch.models.ExactGP):  # type: ignore[misc]
    """Three processes as one gpytorch batch, in float64.

    Parameters
    ----------
    x, t : ndarray (n, d), (n, 3)
        Scaled inputs and targets.
    noise_floor : float
        Least noise variance, scaled.
    kernel : str
        Of `_kernels.KERNELS`.
    ard : bool
        Whether each input has its own lengthscale.
    """

    def __init__(
        self, x: Array, t: Array, noise_floor: float, kernel: str = "rbf", ard: bool = False
    ) -> None:
        batch = torch.Size([3])
        likelihood = gpytorch.likelihoods.GaussianLikelihood(
            batch_shape=batch, noise_constraint=gpytorch.constraints.GreaterThan(noise_floor)
        )
        super().__init__(torch.from_numpy(x), torch.from_numpy(t.T.copy()), likelihood)
        self.mean_module = gpytorch.means.ConstantMean(batch_shape=batch)
        options = {"batch_shape": batch, "ard_num_dims": x.shape[1] if ard else None}
        base = (
            gpytorch.kernels.RBFKernel(**options)
            if kernel == "rbf"
            else gpytorch.kernels.MaternKernel(nu=_SMOOTHNESS[kernel], **options)
        )
        self.covar_module = gpytorch.kernels.ScaleKernel(base, batch_shape=batch)
        self.double()  # gpytorch makes float32 parameters by the global default

    def forward(self, x: torch.Tensor) -> gpytorch.distributions.MultivariateNormal:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), self.covar_module(x))

    def set_theta(self, theta: Array) -> None:
        *lengths, signal, noise, mean = torch.from_numpy(theta)
        self.covar_module.base_kernel.lengthscale = torch.stack(lengths, dim=-1)[:, None, :]
        self.covar_module.outputscale = signal
        self.likelihood.noise = noise[:, None]
        self.mean_module.constant = mean

    def theta(self) -> Array:
        rows = (
            *self.covar_module.base_kernel.lengthscale.unbind(dim=-1),
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
