"""Training of many spectrally normalised networks side by side, with a backward pass by hand.

The networks of a stack share nothing but the instructions: each product is a batch of products
(`torch.bmm`), and no number of one network enters another.  Automatic differentiation would
spend more time on bookkeeping than on the products, which are small.  Only operations whose
result for one network does not depend on the size of the stack are used, so that a network
comes out bit by bit the same in any batch; the contract test holds this.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import torch

from unmodeled.core.arrays import Array
from unmodeled.models.learned.learner import Progress

__all__ = ["Frozen", "SpectralStack", "forward"]

#: Epochs between two looks at the loss.
_CHECK_EVERY = 10
#: Snapshots of which the best is chosen after exact normalisation.
_SNAPSHOTS = 3
#: Adam's decay rates and the guard of its quotient, [Kingma2015].
_BETA_1, _BETA_2, _EPSILON = 0.9, 0.999, 1e-8


@dataclass(frozen=True, slots=True)
class Frozen:
    """A trained network: matrices and biases by layer, and its loss on the scaled samples."""

    weights: list[Array]
    biases: list[Array]
    loss: float


def forward(weights: Sequence[Array], biases: Sequence[Array], x: Array) -> Array:
    """Return outputs (n, 3) of one network at scaled inputs ``x`` (n, d)."""
    for weight, bias in zip(weights[:-1], biases[:-1], strict=True):
        x = np.maximum(x @ weight.T + bias, 0.0)
    outputs: Array = x @ weights[-1].T + biases[-1]
    return outputs


class SpectralStack:
    """Networks in training, each matrix times ``share`` over its estimated spectral norm.

    Parameters
    ----------
    layers, width : int
        Hidden layers and their size.
    share : float
        Spectral norm of each matrix.
    seeds : sequence of int
        Of the initial weights, one a network.
    device : torch.device
        Where to train.
    dtype : torch.dtype
        Numbers of the training; the start is drawn and the end is frozen in float64.
    inputs : int
        How many inputs a sample has.
    """

    def __init__(
        self,
        layers: int,
        width: int,
        share: float,
        seeds: Sequence[int],
        device: torch.device,
        dtype: torch.dtype = torch.float64,
        inputs: int = 3,
    ) -> None:
        self._share, self._device, self._count = share, device, len(seeds)
        sizes = [inputs] + [width] * layers + [3]
        self._shapes = list(zip(sizes[1:], sizes[:-1], strict=True))
        starts: dict[int, _Start] = {}
        for seed in seeds:
            if seed not in starts:
                starts[seed] = _Start(self._shapes, share, seed)
        chosen = [starts[seed] for seed in seeds]
        b = len(seeds)
        # All parameters lie in one vector, layer by layer and network by network within a layer,
        # so that Adam is four operations in all, and layers of one shape are one stack.
        b = len(seeds)
        count = b * sum(rows * columns + rows for rows, columns in self._shapes)
        self._flat = torch.empty(count, dtype=dtype, device=device)
        self._slope = torch.zeros_like(self._flat)
        self._weights, self._biases = self._views(self._flat)
        self._d_weights, self._d_biases = self._views(self._slope)
        for k in range(len(self._shapes)):
            self._weights[k].copy_(torch.stack([s.weights[k] for s in chosen]))
            self._biases[k].copy_(torch.stack([s.biases[k] for s in chosen]))
        effective = torch.empty_like(self._flat)
        self._effective, _ = self._views(effective)
        scratch = torch.empty_like(self._flat)
        self._groups: list[_Group] = []
        at = first = 0
        for shape, members in groupby(self._shapes):
            layers_here = len(list(members))
            span = slice(at, at + layers_here * b * shape[0] * shape[1])
            right = [s.right[k] for k in range(first, first + layers_here) for s in chosen]
            weight, slope, normal, space = (
                v[span].view(-1, *shape) for v in (self._flat, self._slope, effective, scratch)
            )
            right_now = torch.stack(right).to(self._flat)
            self._groups.append(_Group(weight, slope, normal, space, right_now))
            at, first = span.stop, first + layers_here

    def _views(self, flat: torch.Tensor) -> tuple[list[torch.Tensor], list[torch.Tensor]]:
        b, layers = self._count, len(self._shapes)
        counts = [b * rows * columns for rows, columns in self._shapes]
        counts += [b * rows for rows, _ in self._shapes]
        pieces = list(torch.split(flat, counts))
        weights = [p.view(b, *s) for p, s in zip(pieces[:layers], self._shapes, strict=True)]
        biases = [p.view(b, 1, s[0]) for p, s in zip(pieces[layers:], self._shapes, strict=True)]
        return weights, biases

    def train(
        self,
        x: Array,
        t: Array,
        epochs: int,
        learning_rate: float,
        progress: Progress,
        white: Array | None = None,
    ) -> list[Frozen | None]:
        """Minimise the mean squared error of each network by Adam, all samples in each step.

        At a constant rate Adam keeps jumping about the minimum, by a factor of ten in the loss,
        and power iteration lags by up to a per cent of a norm, which the frozen network has to
        give up: the last epoch is a draw of luck.  So the best few epochs are kept, normalised
        exactly at the end, and the best of those is returned.

        Parameters
        ----------
        x, t : ndarray (b, n, d), (b, n, 3)
            Scaled positions and targets.
        epochs, learning_rate
            Steps of Adam and its rate.
        progress : callable
            Told the share done.
        white : ndarray (b, n, 3, 3), optional
            Matrices that each misfit is multiplied by before it is squared.

        Returns
        -------
        list of Frozen or None
            None for a network that never had a finite loss.
        """
        inputs = torch.from_numpy(x).to(self._flat)
        targets = torch.from_numpy(t).to(self._flat)
        work = _Work(inputs, self._shapes)
        if white is not None:
            work.white = torch.from_numpy(white).to(self._flat)
        moment, square = torch.zeros_like(self._flat), torch.zeros_like(self._flat)
        size = torch.empty_like(self._flat)
        kept = _Snapshots(self._count, self._flat)
        for epoch in range(epochs):
            for group in self._groups:
                group.normalise(self._share)
            loss = self._forward(work, targets)
            if epoch % _CHECK_EVERY == 0 or epoch == epochs - 1:
                kept.offer(loss, self._effective, self._biases, last=epoch == epochs - 1)
            self._backward(work)
            step = epoch + 1
            moment.lerp_(self._slope, 1 - _BETA_1)
            square.mul_(_BETA_2).addcmul_(self._slope, self._slope, value=1 - _BETA_2)
            torch.sqrt(square, out=size).mul_(1 / math.sqrt(1 - _BETA_2**step)).add_(_EPSILON)
            self._flat.addcdiv_(moment, size, value=-learning_rate / (1 - _BETA_1**step))
            progress(step / epochs)
        each = [None] * self._count if white is None else list(white)
        return [self._best(kept.of(k), x[k], t[k], each[k]) for k in range(self._count)]

    def _forward(self, work: _Work, targets: torch.Tensor) -> torch.Tensor:
        """Fill ``work`` and return the losses (b,)."""
        h = work.inputs
        last = len(self._shapes) - 1
        for k, weight in enumerate(self._effective):
            torch.baddbmm(self._biases[k], h, weight.mT, out=work.outputs[k])
            h = work.outputs[k] if k == last else work.outputs[k].relu_()
        work.error = h - targets
        if work.white is not None:
            # sums of three products, whatever the size of the stack
            work.error = (work.white * work.error[:, :, None, :]).sum(dim=3)
        return (work.error**2).mean(dim=(1, 2))

    def _backward(self, work: _Work) -> None:
        """Write the slope of the loss into the flat vector."""
        error = work.error
        g = error.mul_(2.0 / (error.shape[1] * error.shape[2]))
        if work.white is not None:
            g = (work.white * g[:, :, :, None]).sum(dim=2)
        for k in range(len(self._shapes) - 1, -1, -1):
            below = work.outputs[k - 1] if k else work.inputs
            torch.bmm(g.mT, below, out=self._d_weights[k])
            torch.sum(g, dim=1, keepdim=True, out=self._d_biases[k])
            if k:
                torch.bmm(g, self._effective[k], out=work.slopes[k - 1])
                # The derivative of ReLU; zero on the kink itself.
                g = torch.ops.aten.threshold_backward.grad_input(
                    work.slopes[k - 1], below, 0.0, grad_input=work.slopes[k - 1]
                )
        for group in self._groups:
            group.to_raw(self._share)

    def _best(
        self, candidates: list[torch.Tensor], x: Array, t: Array, white: Array | None
    ) -> Frozen | None:
        best: Frozen | None = None
        for flat in candidates:
            frozen = self._freeze(flat.cpu().double().numpy(), x, t, white)
            if math.isfinite(frozen.loss) and (best is None or frozen.loss < best.loss):
                best = frozen
        return best

    def _freeze(self, flat: Array, x: Array, t: Array, white: Array | None) -> Frozen:
        """Return one network with matrices brought down to norm ``share`` where above."""
        weights, biases, at = [], [], 0
        for rows, columns in self._shapes:
            weight = flat[at : at + rows * columns].reshape(rows, columns)
            weights.append(weight * min(1.0, self._share / float(np.linalg.norm(weight, 2))))
            at += rows * columns
        for rows, _ in self._shapes:
            biases.append(flat[at : at + rows].copy())
            at += rows
        misfit = forward(weights, biases, x) - t
        if white is not None:
            misfit = (white @ misfit[:, :, None])[:, :, 0]
        return Frozen(weights, biases, float(np.mean(misfit**2)))


@dataclass
class _Group:
    """Matrices of one shape of all networks: raw, their slopes, normalised, and work space."""

    weight: torch.Tensor
    slope: torch.Tensor
    effective: torch.Tensor
    scratch: torch.Tensor
    right: torch.Tensor

    def normalise(self, share: float) -> None:
        """One step of power iteration, and the matrices brought to norm ``share``."""
        left = _apply(self.weight, self.right)
        left /= torch.linalg.vector_norm(left, dim=1, keepdim=True)
        right = _apply(self.weight.mT, left)
        # u'W v with v = W'u / |W'u| is |W'u|.
        self._norm = torch.linalg.vector_norm(right, dim=1, keepdim=True)
        self._left, self.right = left, right / self._norm
        torch.mul(self.weight, share / self._norm, out=self.effective)

    def to_raw(self, share: float) -> None:
        """Turn slopes by the normalised matrices into slopes by the raw ones."""
        # The normalised matrix is share W / norm, and d norm / d W = u v'.
        product = torch.mul(self.slope, self.effective, out=self.scratch)
        along = product.flatten(1).sum(dim=1)[:, None, None] / self._norm
        self.slope *= share / self._norm
        self.slope.addcmul_(along * self._left, self.right.mT, value=-1.0)


class _Start:
    """Initial parameters of one network from its seed."""

    def __init__(self, shapes: list[tuple[int, int]], share: float, seed: int) -> None:
        # A generator of its own: torch's global stream stays as it was.
        generator = torch.Generator().manual_seed(seed)

        def random(*shape: int) -> torch.Tensor:
            return torch.empty(shape, dtype=torch.float64).normal_(generator=generator)

        weights = [random(*shape) for shape in shapes]
        parts = [torch.linalg.svd(w) for w in weights]
        # Start on the bound, so that Adam's step is small against the weights' size, not 1.
        self.weights = [w * (share / p.S[0]) for w, p in zip(weights, parts, strict=True)]
        self.right = [p.Vh[0, :, None].clone() for p in parts]
        # Biases of the first layer spread its kinks over the samples, which have spread 1.
        spread = [1.0] + [0.1] * (len(shapes) - 2) + [0.0]
        self.biases = [s * random(1, rows) for s, (rows, _) in zip(spread, shapes, strict=True)]


class _Work:
    """Memory of one pass: outputs of each layer and slopes of the hidden ones."""

    def __init__(self, inputs: torch.Tensor, shapes: list[tuple[int, int]]) -> None:
        b, n, _ = inputs.shape
        self.inputs = inputs
        self.outputs = [inputs.new_empty(b, n, rows) for rows, _ in shapes]
        self.slopes = [inputs.new_empty(b, n, rows) for rows, _ in shapes[:-1]]
        self.error = inputs.new_empty(b, n, 3)
        self.white: torch.Tensor | None = None


class _Snapshots:
    """The effective parameters of each network at its epochs of lowest loss, and at the last."""

    def __init__(self, count: int, flat: torch.Tensor) -> None:
        self._losses = flat.new_full((_SNAPSHOTS + 1, count), math.inf)
        self._flats = flat.new_empty(_SNAPSHOTS + 1, count, len(flat) // count)

    def offer(
        self,
        loss: torch.Tensor,
        weights: list[torch.Tensor],
        biases: list[torch.Tensor],
        *,
        last: bool,
    ) -> None:
        slot = torch.argmax(self._losses[:_SNAPSHOTS], dim=0)
        if last:
            slot = torch.full_like(slot, _SNAPSHOTS)
        index = torch.arange(len(slot), device=slot.device)
        better = loss < self._losses[slot, index]  # False for NaN
        if not bool(better.any()):
            return
        slot, index = slot[better], index[better]
        self._losses[slot, index] = loss[better]
        parts = [p.flatten(1)[better] for p in (*weights, *biases)]
        self._flats[slot, index] = torch.cat(parts, dim=1)

    def of(self, k: int) -> list[torch.Tensor]:
        """Return the snapshots of network ``k``, the best first."""
        order = torch.argsort(self._losses[:, k], stable=True)
        return [self._flats[s, k] for s in order if bool(torch.isfinite(self._losses[s, k]))]


def _apply(matrix: torch.Tensor, vector: torch.Tensor) -> torch.Tensor:
    """Return products (b, m, 1) of matrices (b, m, n) and vectors (b, n, 1)."""
    if len(matrix) > 1:
        return torch.bmm(matrix, vector)
    # A stack of one would be handed to another routine, which rounds differently.
    return torch.bmm(matrix.expand(2, -1, -1), vector.expand(2, -1, -1))[:1]
