"""Harmonic covariances of accelerations as gpytorch kernels, three outputs an input.

Import this module where gpytorch is wanted; `HarmonicKernelGP` needs neither it nor torch.
"""

from __future__ import annotations

import warnings
from typing import Any

import torch

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.learned._harmonic_kernels import check_law, derivative_block

with warnings.catch_warnings():
    # linear_operator compiles two functions on import; who makes warnings errors could not import
    warnings.filterwarnings("ignore", r"`torch\.jit\.script` is deprecated", DeprecationWarning)
    import gpytorch

__all__ = ["HarmonicGradientKernel", "MassAndCentreKernel"]


class _AccelerationKernel(gpytorch.kernels.Kernel):  # type: ignore[misc]
    """Covariances (..., 3n, 3m) of accelerations, the components of each position together."""

    has_lengthscale = False
    is_stationary = False

    def num_outputs_per_input(self, x1: torch.Tensor, x2: torch.Tensor) -> int:
        return 3

    def _blocks(self, x1: torch.Tensor, x2: torch.Tensor, alone: int = 0) -> torch.Tensor:
        """Return (..., n, m, 3, 3); ``alone`` counts axes of inputs taken one by one."""
        raise NotImplementedError(f"{type(self).__name__} declares no covariance")

    def forward(
        self, x1: torch.Tensor, x2: torch.Tensor, diag: bool = False, **params: Any
    ) -> torch.Tensor:
        if x1.shape[-1] != 3 or x2.shape[-1] != 3:
            raise DataError(
                f"{type(self).__name__} was given inputs of shapes {tuple(x1.shape)} and "
                f"{tuple(x2.shape)}",
                allowed="positions (..., n, 3)",
            )
        if diag:
            pairs = self._blocks(x1.unsqueeze(-2), x2.unsqueeze(-2), 1)[..., 0, 0, :, :]
            return pairs.diagonal(dim1=-1, dim2=-2).flatten(-2)
        blocks = self._blocks(x1, x2).transpose(-3, -2)
        *batch, n, _, m, _ = blocks.shape
        return blocks.reshape(*batch, 3 * n, 3 * m)


class HarmonicGradientKernel(_AccelerationKernel):
    r"""Covariance of the gradients of a harmonic potential, in closed form.

    That of the potential is :math:`q^{-2} \sum_n \sigma_n^2 (q^2/(r r'))^{n+1} P_n`, which gives
    each normalised coefficient of degree n the variance :math:`q^{2n} \sigma_n^2/(2n + 1)`
    [Moritz1980]. For an amplitude, wrap it in ``gpytorch.kernels.ScaleKernel``; float64 is advised.

    Parameters
    ----------
    law : {"abel_poisson", "reciprocal", "logarithmic"}
        sigma_n^2 = 2n + 1, 1, 1/(n + 1).
    max_ratio : float
        Bound of q, the radius of the Bjerhammar sphere in the units of the inputs: below the
        smallest radius of any of them, so that no pair has q^2/(r r') >= 1.
    batch_shape : torch.Size, optional
        One q for each member of a batch.

    Raises
    ------
    ConfigError
        For an unknown law or a bound that is not positive.
    DataError
        On evaluation, if an input lies within the Bjerhammar sphere or is no position.
    """

    def __init__(
        self,
        law: str = "abel_poisson",
        max_ratio: float = 0.95,
        batch_shape: torch.Size | None = None,
        **kwargs: Any,
    ) -> None:
        check_law(type(self).__name__, law)
        if not max_ratio > 0:
            raise ConfigError(f"{type(self).__name__}: max_ratio is {max_ratio}", allowed="> 0")
        super().__init__(batch_shape=batch_shape, **kwargs)
        self.law = law
        shape = (*self.batch_shape, 1, 1)
        self.register_parameter("raw_ratio", torch.nn.Parameter(torch.zeros(shape)))
        self.register_constraint("raw_ratio", gpytorch.constraints.Interval(0.0, max_ratio))

    @property
    def ratio(self) -> torch.Tensor:
        """q, shape (*batch_shape, 1, 1)."""
        ratio: torch.Tensor = self.raw_ratio_constraint.transform(self.raw_ratio)
        return ratio

    @ratio.setter
    def ratio(self, value: torch.Tensor | float) -> None:
        value = torch.as_tensor(value, dtype=self.raw_ratio.dtype).expand(self.raw_ratio.shape)
        self.initialize(raw_ratio=self.raw_ratio_constraint.inverse_transform(value))

    def _blocks(self, x1: torch.Tensor, x2: torch.Tensor, alone: int = 0) -> torch.Tensor:
        ratio = self.ratio
        for x in (x1, x2):
            # only the largest q counts: a bound for all members of a batch at once
            if x.numel() and float(x.detach().norm(dim=-1).min()) <= float(ratio.detach().max()):
                raise DataError(
                    f"an input is {float(x.detach().norm(dim=-1).min()):.3g} from the origin, "
                    f"inside the Bjerhammar sphere of {float(ratio.detach().max()):.3g}",
                    allowed="positions outside",
                    do="lower max_ratio",
                )
        c = (ratio**2)[(..., *(None,) * alone)]
        blocks: torch.Tensor = derivative_block(self.law, x1, x2, c, 1, 1, torch)
        return blocks / c[..., None, None]


class MassAndCentreKernel(_AccelerationKernel):
    """Covariance of degrees 0 and 1 alone: the vague prior of mass and centre of mass.

    Add it to a scaled `HarmonicGradientKernel`.

    Parameters
    ----------
    mass_variance, dipole_variance : float
        Of the normalised coefficients C_0_0, and C_1_0, C_1_1, S_1_1, for a unit reference.
    """

    def __init__(
        self, mass_variance: float = 1.0, dipole_variance: float = 1.0, **kwargs: Any
    ) -> None:
        for name, value in (("mass", mass_variance), ("dipole", dipole_variance)):
            if not value >= 0:
                raise ConfigError(
                    f"{type(self).__name__}: {name}_variance is {value}", allowed=">= 0"
                )
        super().__init__(**kwargs)
        self.mass_variance = mass_variance
        self.dipole_variance = dipole_variance

    def _blocks(self, x1: torch.Tensor, x2: torch.Tensor, alone: int = 0) -> torch.Tensor:
        (mass1, dipole1), (mass2, dipole2) = _low(x1), _low(x2)
        mass = mass1[..., :, None, :, None] * mass2[..., None, :, None, :]
        # sum over the three harmonics of degree 1, each the square root of 3 times x_i / r^3
        dipole = torch.einsum("...nia,...mka->...nmik", dipole1, dipole2)
        return self.mass_variance * mass + 3.0 * self.dipole_variance * dipole


def _low(x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the accelerations (..., n, 3) of 1/r and (..., n, 3, 3) of x_a / r^3."""
    r = x.norm(dim=-1)[..., None]
    up = x / r
    eye = torch.eye(3, dtype=x.dtype)
    mass = -up / r**2
    dipole = (eye - 3.0 * up[..., :, None] * up[..., None, :]) / r[..., None] ** 3
    return mass, dipole
