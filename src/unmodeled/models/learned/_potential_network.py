"""A small network of the potential: value, gradient, Laplacian, and their slopes by the weights.

Derivatives by the position are carried forward layer by layer beside the values (the forward
Laplacian of [Li2024]); slopes by the weights come from one backward pass a row. By hand in numpy:
the products are small, and a filter calls them point by point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import scipy.special

from unmodeled.core.arrays import Array

__all__ = ["Activation", "Jet", "Network", "Trace", "activate"]

#: First weights of inputs of order one, as a multiple of what makes their sums of order one: the
#: larger, the more of the high degrees.
_ROUGH = 3.0

Activation: TypeAlias = Literal["tanh", "sine"]


def activate(kind: str, a: Array) -> tuple[Array, Array, Array, Array]:
    """Return an activation and its first three derivatives, each of the shape of ``a``."""
    if kind == "sine":
        s, c = np.sin(a), np.cos(a)
        return s, c, -s, -c
    t = np.tanh(a)
    slope = 1.0 - t * t
    return t, slope, -2.0 * t * slope, slope * (6.0 * t * t - 2.0)


@dataclass(frozen=True)
class Jet:
    """Values with derivatives by the position at n points, k columns.

    Parameters
    ----------
    value : ndarray (n, k)
    gradient : ndarray (3, n, k)
    laplacian : ndarray (n, k), or None where it is not wanted
    hessian : ndarray (3, 3, n, k), or None where it is not wanted
    """

    value: Array
    gradient: Array
    laplacian: Array | None = None
    hessian: Array | None = None


@dataclass(frozen=True)
class _Layer:
    """What the backward pass needs of one layer.

    The jet below; three derivatives of the activation; gradient and Laplacian of what enters it,
    and the squares of that gradient added up.
    """

    below: Jet
    first: Array
    second: Array
    third: Array
    slope: Array
    bend: Array | None
    squares: Array | None


@dataclass(frozen=True)
class Trace:
    """A forward pass, kept for `Network.slopes`: the hidden layers and what leaves the last one."""

    layers: list[_Layer]
    top: Jet


class Network:
    """Fully connected layers with one output and no constant: the mass stands for it.

    Parameters
    ----------
    sizes : sequence of int
        Inputs, then each hidden layer.
    activation : {"tanh", "sine"}
        Of the hidden layers.
    """

    def __init__(self, sizes: Sequence[int], activation: str) -> None:
        self.activation = activation
        self._shapes = list(zip(sizes[1:], sizes[:-1], strict=True))
        self.count = sum(rows * columns + rows for rows, columns in self._shapes) + sizes[-1]
        #: Hidden weights come first, the output weights are the last of the vector.
        self.hidden = self.count - sizes[-1]

    def unpack(self, weights: Array) -> tuple[list[tuple[Array, Array]], Array]:
        """Return matrices and biases of the hidden layers, and the output weights."""
        layers, at = [], 0
        for rows, columns in self._shapes:
            end = at + rows * columns
            layers.append((weights[at:end].reshape(rows, columns), weights[end : end + rows]))
            at = end + rows
        return layers, weights[at:]

    def draw(self, random_state: int) -> tuple[Array, Array]:
        """Return first weights, the output's zero, and the scale (count,) of their prior."""
        generator = np.random.default_rng(random_state)
        scales, starts = [], []
        for k, (rows, columns) in enumerate(self._shapes):
            size = (_ROUGH if k == 0 else 1.0) / np.sqrt(columns)
            scales += [np.full(rows * columns, size), np.full(rows, 1.0 if k == 0 else 0.5)]
            if k == 0:
                starts += _spread(rows, columns, generator)
            else:
                starts += [generator.normal(size=rows * columns), generator.normal(size=rows)]
        outputs = self.count - self.hidden
        scales.append(np.full(outputs, 1.0 / np.sqrt(outputs)))
        scale = np.concatenate(scales)
        return scale * np.concatenate([*starts, np.zeros(outputs)]), scale

    def norms(self, weights: Array) -> list[float]:
        """Return the spectral norm of each layer, the output last; slopes are at most 1."""
        layers, output = self.unpack(weights)
        matrices = [matrix for matrix, _ in layers] + [output[None]]
        return [float(np.linalg.norm(matrix, 2)) for matrix in matrices]

    def bounded(self, weights: Array, share: float) -> Array:
        """Return weights with the spectral norm of each layer brought down to ``share``."""
        bounded = weights.copy()
        layers, output = self.unpack(bounded)  # views
        norms = self.norms(weights)
        for matrix, norm in zip([m for m, _ in layers] + [output], norms, strict=True):
            matrix *= min(1.0, share / max(norm, 1e-300))
        return bounded

    def forward(self, weights: Array, inputs: Jet) -> tuple[Jet, Trace]:
        """Return the output jet (one column) and what `slopes` needs."""
        layers, output = self.unpack(weights)
        jet, kept = inputs, []
        for matrix, bias in layers:
            a, da = jet.value @ matrix.T + bias, jet.gradient @ matrix.T
            value, first, second, third = activate(self.activation, a)
            bend = squares = laplacian = hessian = None
            if jet.laplacian is not None:
                bend, squares = jet.laplacian @ matrix.T, (da * da).sum(axis=0)
                laplacian = first * bend + second * squares
            if jet.hessian is not None:
                hessian = first * (jet.hessian @ matrix.T) + second * da[:, None] * da[None]
            kept.append(_Layer(jet, first, second, third, da, bend, squares))
            jet = Jet(value, first * da, laplacian, hessian)
        column = output[:, None]
        parts = [None if p is None else p @ column for p in (jet.laplacian, jet.hessian)]
        return Jet(jet.value @ column, jet.gradient @ column, *parts), Trace(kept, jet)

    def slopes(
        self, weights: Array, trace: Trace, value: Array, gradient: Array, laplacian: Array
    ) -> Array:
        """Return slopes by the weights of one linear function of the output jet a point.

        Parameters
        ----------
        weights, trace
            As given to and returned by `forward`.
        value, laplacian : ndarray (n,)
            Factors of value and Laplacian.
        gradient : ndarray (3, n)
            Factors of the gradient.

        Returns
        -------
        ndarray (n, count)
        """
        layers, output = self.unpack(weights)
        top = trace.top
        blocks = [value[:, None] * top.value + (gradient[:, :, None] * top.gradient).sum(axis=0)]
        h, d = value[:, None] * output, gradient[:, :, None] * output
        bends = top.laplacian is not None
        bar = laplacian[:, None] * output
        if top.laplacian is not None:
            blocks[0] = blocks[0] + laplacian[:, None] * top.laplacian
        for (matrix, _), layer in zip(reversed(layers), reversed(trace.layers), strict=True):
            a = layer.first * h + layer.second * (d * layer.slope).sum(axis=0)
            da = layer.first * d
            right = [layer.below.value, *layer.below.gradient]
            if bends:
                assert layer.bend is not None
                assert layer.squares is not None
                assert layer.below.laplacian is not None
                a = a + bar * (layer.second * layer.bend + layer.third * layer.squares)
                da = da + 2.0 * bar * layer.second * layer.slope
                bar = layer.first * bar
                right.append(layer.below.laplacian)
            left = [a, *da] + ([bar] if bends else [])
            outer = np.stack(left, axis=2) @ np.stack(right, axis=1)
            blocks += [a, outer.reshape(len(a), -1)]
            h, d, bar = a @ matrix, da @ matrix, bar @ matrix
        return np.concatenate(blocks[::-1], axis=1)


def _spread(rows: int, columns: int, generator: np.random.Generator) -> list[Array]:
    """Return weights (rows * columns,) and biases (rows,) of a first layer in units of their scale.

    Normal weights, but evenly so: directions are orthogonal in blocks, the squares of lengths are
    quantiles of chi squared, phases those of a period. Few units then span the directions and
    degrees that many independent ones do.
    """
    blocks = []
    for _ in range(-(-rows // columns)):
        q, r = np.linalg.qr(generator.normal(size=(columns, columns)))
        blocks.append(q * np.sign(np.diag(r)))
    share = (np.arange(rows) + 0.5) / rows
    length = np.sqrt(2.0 * scipy.special.gammaincinv(0.5 * columns, generator.permutation(share)))
    weights = np.concatenate(blocks)[:rows] * length[:, None]
    return [weights.ravel(), 2.0 * np.pi * (generator.permutation(share) - 0.5)]
