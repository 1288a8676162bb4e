"""Marginal likelihood of Gaussian processes, first and second derivatives in closed form.

[Rasmussen2006] Eqs. 5.8 and 5.9, and their derivative.  One Cholesky factorisation and one
inverse serve the value and the gradient, one more product of matrices the second derivatives.
Everything is a stack of problems in torch, so that a graphics card takes many at once; on a
processor they go one by one, which is as fast for matrices of this size, needs the memory of one,
and makes the numbers of a problem independent of its neighbours to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import torch

from unmodeled.core.arrays import Array
from unmodeled.models.learned._distances import squared_distances
from unmodeled.models.learned._kernels import bend, correlation, steepness

__all__ = ["Evaluation", "Indices", "Likelihood"]

Indices: TypeAlias = np.ndarray[Any, np.dtype[np.int64]]

#: Largest share of a graphics card's free memory that one stack may fill.
_MEMORY_SHARE = 0.4
#: Matrices of n x n numbers that one problem needs at the same time.
_MATRICES = 7


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Negative log marginal likelihoods of some problems; infinite where a kernel is singular.

    Parameters
    ----------
    value : ndarray (k,)
        Of the scaled targets.
    gradient : ndarray (k, q)
        By the logarithms of lengthscales (one, or one for each input), signal variance and noise
        variance.
    curvature : ndarray (k, q, q)
        Second derivatives; NaN unless asked for.
    mean : ndarray (k,)
        The constant mean: the given one, or the most likely.
    mean_gradient : ndarray (k,)
        Derivative by the mean; zero at the most likely.
    """

    value: Array
    gradient: Array
    curvature: Array
    mean: Array
    mean_gradient: Array


class Likelihood:
    """The likelihoods of three components for each of some data sets of one size.

    Problem ``3 i + c`` is component ``c`` of data set ``i``.

    Parameters
    ----------
    x, t : sequence of ndarray (n, d), (n, 3)
        Scaled inputs and targets of each data set.
    device : torch.device
        Where to compute.
    own : sequence of ndarray (n, 3), optional
        Known noise variances of the samples beside the estimated one, scaled.
    kernel : str
        Of `_kernels.KERNELS`.
    ard : bool
        Whether each input has its own lengthscale; without second derivatives.
    """

    def __init__(
        self,
        x: Sequence[Array],
        t: Sequence[Array],
        device: torch.device | None = None,
        own: Sequence[Array] | None = None,
        kernel: str = "rbf",
        ard: bool = False,
    ) -> None:
        self._device = device or torch.device("cpu")
        self._kernel, self._ard = kernel, ard
        # Squared distances (b, n, n) once for all, or inputs (b, d, n) where each has its scale.
        self._geometry = torch.stack(
            [torch.from_numpy(a.T.copy() if ard else squared_distances(a, a)) for a in x]
        ).to(self._device)
        self._targets = torch.stack([torch.from_numpy(a.T.copy()) for a in t]).to(self._device)
        self._targets = self._targets.reshape(-1, self._targets.shape[-1])
        self._own = torch.zeros_like(self._targets)
        if own is not None:
            given = torch.stack([torch.from_numpy(a.T.copy()) for a in own]).to(self._device)
            self._own = given.reshape(self._targets.shape)
        self.samples = self._targets.shape[-1]
        self.problems = len(self._targets)

    def __call__(
        self,
        log_theta: Array,
        mean: Array | None = None,
        *,
        which: Indices | None = None,
        second: bool = False,
    ) -> Evaluation:
        """Evaluate.

        Parameters
        ----------
        log_theta : ndarray (k, q)
            Logarithms of lengthscales, signal variance and noise variance.
        mean : ndarray (k,), optional
            Constant means; without them each is at its most likely value.
        which : ndarray of int (k,), optional
            The problems; all by default.
        second : bool
            Whether to compute second derivatives.
        """
        which = np.arange(self.problems, dtype=np.int64) if which is None else which
        size = self._stack_size()
        with torch.no_grad():
            blocks = [
                self._stack(
                    which[k : k + size],
                    log_theta[k : k + size],
                    None if mean is None else mean[k : k + size],
                    second,
                )
                for k in range(0, len(which), size)
            ]
        return Evaluation(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))

    def _stack_size(self) -> int:
        if self._device.type == "cpu":
            return 1
        free, _ = torch.cuda.mem_get_info(self._device)
        return max(1, int(_MEMORY_SHARE * free / (8 * _MATRICES * self.samples**2)))

    def _stack(
        self, which: Indices, log_theta: Array, mean: Array | None, second: bool
    ) -> tuple[Array, ...]:
        index = torch.from_numpy(which).to(self._device)
        geometry = self._geometry[index // 3]
        target = self._targets[index]
        n = self.samples
        theta = torch.from_numpy(np.exp(log_theta)).to(self._device)
        lengths, signal, noise = theta[:, :-2], theta[:, -2], theta[:, -1]
        if self._ard:
            scaled = torch.zeros_like(geometry[:, 0, :, None] - geometry[:, 0, None, :])
            for j in range(lengths.shape[1]):
                scaled += _square(geometry[:, j], lengths[:, j])
        else:  # squared distances per lengthscale
            scaled = geometry * (1.0 / lengths[:, 0] ** 2)[:, None, None]
        if self._kernel == "rbf":
            smooth = torch.add(signal.log()[:, None, None], scaled, alpha=-0.5).exp_()
        else:
            smooth = signal[:, None, None] * correlation(self._kernel, scaled, torch.exp)
        kernel = smooth.clone()
        diagonal_noise = noise[:, None] + self._own[index]
        kernel.diagonal(dim1=1, dim2=2).add_(diagonal_noise)
        factor, info = torch.linalg.cholesky_ex(kernel)
        if bool(info.any()):  # keeps the rest of the stack going; the value becomes infinite
            unit = torch.eye(n, dtype=torch.float64, device=self._device)
            factor = torch.where((info != 0)[:, None, None], unit, factor)
        diagonal = factor.diagonal(dim1=1, dim2=2)
        logdet = 2 * diagonal.log().sum(dim=1)
        inverse = torch.cholesky_inverse(factor)
        del kernel, factor
        rows = inverse.sum(dim=2)
        if mean is None:
            centre = (rows * target).sum(dim=1) / rows.sum(dim=1)
        else:
            centre = torch.from_numpy(mean).to(self._device)
        residual = target - centre[:, None]
        weights = (inverse @ residual[:, :, None])[:, :, 0]
        value = 0.5 * ((residual * weights).sum(dim=1) + logdet + n * math.log(2 * math.pi))
        value = torch.where((info == 0) & value.isfinite(), value, math.inf)

        steep = smooth
        if self._kernel != "rbf":
            steep = signal[:, None, None] * steepness(self._kernel, scaled, torch.exp)
        inverse_diagonal = inverse.diagonal(dim1=1, dim2=2)
        trace = inverse_diagonal.sum(dim=1)
        pairs = []
        for j in range(lengths.shape[1]):  # d kernel / d log lengthscale
            slope = steep * (_square(geometry[:, j], lengths[:, j]) if self._ard else scaled)
            along = (slope @ weights[:, :, None])[:, :, 0]
            pairs.append((_inner(inverse, slope), (weights * along).sum(dim=1)))
        pairs += [
            # The smooth kernel is the whole one less the noise.
            (
                n - (diagonal_noise * inverse_diagonal).sum(dim=1),
                (weights * residual).sum(dim=1) - (diagonal_noise * weights * weights).sum(dim=1),
            ),
            (noise * trace, noise * (weights * weights).sum(dim=1)),
        ]
        gradient = 0.5 * torch.stack([a - b for a, b in pairs], dim=1)
        size = log_theta.shape[1]
        curvature = torch.full((len(which), size, size), math.nan, dtype=torch.float64)
        if second:
            curvature = self._curvature(
                inverse, smooth, scaled, slope, weights, along, rows, noise, diagonal_noise, pairs
            )
        sums = -weights.sum(dim=1)
        parts = (value, gradient, curvature, centre, sums if mean is not None else 0 * sums)
        return tuple(p.cpu().numpy() for p in parts)

    def _curvature(
        self,
        inverse: torch.Tensor,
        smooth: torch.Tensor,
        scaled: torch.Tensor,
        slope: torch.Tensor,
        weights: torch.Tensor,
        along: torch.Tensor,
        rows: torch.Tensor,
        noise: torch.Tensor,
        diagonal_noise: torch.Tensor,
        pairs: list[tuple[torch.Tensor, torch.Tensor]],
    ) -> torch.Tensor:
        """Second derivatives, the mean following to its most likely value."""
        n = self.samples
        product = inverse @ slope
        mixed = (product * inverse).sum(dim=2)
        power = inverse * inverse
        powers = power.sum(dim=2)
        # The inverse times the smooth kernel is one less the inverse times the noise.
        d, own = diagonal_noise, inverse.diagonal(dim1=1, dim2=2)
        turn = product.diagonal(dim1=1, dim2=2).sum(dim=1)
        ll = _inner(product, product.mT.contiguous())
        ls, ln = turn - (d * mixed).sum(dim=1), noise * mixed.sum(dim=1)
        twice = (d * (power @ d[:, :, None])[:, :, 0]).sum(dim=1)
        ss = n - 2 * (d * own).sum(dim=1) + twice
        sn = noise * (own.sum(dim=1) - (d * powers).sum(dim=1))
        nn = noise**2 * powers.sum(dim=1)
        traces = torch.stack([ll, ls, ln, ls, ss, sn, ln, sn, nn], dim=1).reshape(-1, 3, 3)
        # Each derivative of the kernel times the weights, and the inverse times that.
        straight = smooth @ weights[:, :, None]
        moved = torch.cat(
            [along[:, :, None], straight, (noise[:, None] * weights)[:, :, None]], dim=2
        )
        forms = moved.mT @ (inverse @ moved)
        pull = (rows[:, None, :] @ moved)[:, 0]
        forms = forms - pull[:, :, None] * pull[:, None, :] / rows.sum(dim=1)[:, None, None]
        slopes = [a - b for a, b in pairs]
        # The second derivative by the log of the lengthscale is slope (bend - 2).
        bent = torch.mul(slope, bend(self._kernel, scaled), out=product)
        bends = _inner(inverse, bent) - (weights * (bent @ weights[:, :, None])[:, :, 0]).sum(dim=1)
        bends = bends - 2 * slopes[0]
        zero = torch.zeros_like(bends)
        rest = [bends, slopes[0], zero, slopes[0], slopes[1], zero, zero, zero, slopes[2]]
        second = torch.stack(rest, dim=1).reshape(-1, 3, 3)
        return 0.5 * (second - traces) + forms


def _square(x: torch.Tensor, length: torch.Tensor) -> torch.Tensor:
    """Return squared differences (k, n, n) of one input (k, n) per squared lengthscale (k,)."""
    x = x / length[:, None]
    return (x[:, :, None] - x[:, None, :]) ** 2


def _inner(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Return the sums (k,) of the products of the entries of matrices (k, n, n)."""
    k = len(a)
    return (a.reshape(k, 1, -1) @ b.reshape(k, -1, 1))[:, 0, 0]
