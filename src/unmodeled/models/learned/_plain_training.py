"""Training of a few small networks side by side in numpy, with a backward pass by hand.

Networks of ten units spend all their time on the bookkeeping of a larger framework. Arrays have
the network as their first axis; networks of one call share samples and split.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned.learner import Progress

__all__ = ["Trained", "activate", "outputs", "train"]

#: Epochs between two looks at the validation loss.
_CHECK_EVERY = 10
#: Adam's decay rates and the guard of its quotient, [Kingma2015].
_BETA_1, _BETA_2, _EPSILON = 0.9, 0.999, 1e-8


@dataclass(frozen=True)
class Trained:
    """Networks at the epoch of their least validation loss.

    Parameters
    ----------
    weights, biases : list of ndarray (k, out, in), (k, 1, out)
        By layer.
    loss : ndarray (k,)
        Validation loss of each network, infinite if its training left the finite numbers.
    epoch : ndarray (k,)
        At which epoch.
    """

    weights: list[Array]
    biases: list[Array]
    loss: Array
    epoch: Array


def activate(values: Array, activation: str) -> Array:
    """Return the activation ``relu`` or ``tanh`` of values."""
    return np.maximum(values, 0.0) if activation == "relu" else np.tanh(values)


def outputs(weights: list[Array], biases: list[Array], x: Array, activation: str) -> list[Array]:
    """Return the outputs (k, n, width) of each layer at inputs ``x`` (n, d)."""
    h, layers = x[None], []
    for at, (w, b) in enumerate(zip(weights, biases, strict=True)):
        h = h @ w.mT + b
        if at < len(weights) - 1:
            h = activate(h, activation)
        layers.append(h)
    return layers


def train(
    sizes: list[int],
    seeds: list[list[int]],
    samples: tuple[Array, Array, Array | None],
    held: tuple[Array, Array, Array | None],
    activation: str,
    epochs: int,
    learning_rate: float,
    progress: Progress,
) -> Trained:
    """Minimise the mean squared misfit by Adam at a constant rate, all samples in each step.

    Parameters
    ----------
    sizes : list of int
        Inputs, hidden units of each layer, outputs.
    seeds : list of list of int
        Of the initial weights, one entry a network.
    samples, held : tuple of ndarray (n, d), ndarray (n, 3), ndarray (n, 3, 3) or None
        Scaled inputs, targets and weights, for the steps and for the choice of the epoch.
    activation : {"relu", "tanh"}
        Of the hidden layers.
    epochs, learning_rate
        Steps and rate of Adam.
    progress : callable
        Told the share done.
    """
    shapes = list(zip(sizes[1:], sizes[:-1], strict=True))
    draws = [np.random.default_rng(seed) for seed in seeds]
    # He's start: the variance of the values stays the same through ReLU layers
    weights = [
        np.stack([np.sqrt(2.0 / c) * d.normal(size=(r, c)) for d in draws]) for r, c in shapes
    ]
    biases = [np.stack([0.1 * d.normal(size=(1, r)) for d in draws]) for r, _ in shapes]
    values = weights + biases
    moments = [np.zeros_like(v) for v in values]
    squares = [np.zeros_like(v) for v in values]
    best = Trained(
        [w.copy() for w in weights],
        [b.copy() for b in biases],
        np.full(len(seeds), np.inf),
        np.zeros(len(seeds)),
    )
    x, t, white = samples
    with np.errstate(over="ignore", invalid="ignore"):  # a loss that overflows is not the best
        for epoch in range(epochs + 1):
            if epoch % _CHECK_EVERY == 0 or epoch == epochs:
                _keep(best, weights, biases, held, activation, epoch)
            if epoch == epochs:
                break
            layers = outputs(weights, biases, x, activation)
            g = _slope(layers[-1] - t, white) * (2.0 / t.size)
            slopes: list[Array] = [np.empty(0)] * len(values)
            for k in range(len(shapes) - 1, -1, -1):
                below = layers[k - 1] if k else np.broadcast_to(x, (len(seeds), *x.shape))
                slopes[k] = g.mT @ below
                slopes[len(shapes) + k] = g.sum(axis=1, keepdims=True)
                if k:
                    g = g @ weights[k]
                    g = g * ((below > 0.0) if activation == "relu" else (1.0 - below**2))
            rate = learning_rate / (1 - _BETA_1 ** (epoch + 1))
            for v, s, m, q in zip(values, slopes, moments, squares, strict=True):
                m += (1 - _BETA_1) * (s - m)
                q += (1 - _BETA_2) * (s * s - q)
                v -= rate * m / (np.sqrt(q / (1 - _BETA_2 ** (epoch + 1))) + _EPSILON)
            progress((epoch + 1) / epochs)
    lost = [~np.isfinite(v).reshape(len(seeds), -1).all(axis=1) for v in values]
    best.loss[np.any(lost, axis=0)] = np.inf
    return best


def _slope(misfit: Array, white: Array | None) -> Array:
    """Return half the slope of the squared, weighted misfit."""
    if white is None:
        return misfit
    product: Array = white.mT @ (white @ misfit[..., None])
    return product[..., 0]


def _keep(
    best: Trained,
    weights: list[Array],
    biases: list[Array],
    held: tuple[Array, Array, Array | None],
    activation: str,
    epoch: int,
) -> None:
    x, t, white = held
    misfit = outputs(weights, biases, x, activation)[-1] - t
    if white is not None:
        misfit = (white @ misfit[..., None])[..., 0]
    loss = (misfit**2).mean(axis=(1, 2))
    better = loss < best.loss  # False for NaN
    for mine, now in zip(best.weights + best.biases, weights + biases, strict=True):
        mine[better] = now[better]
    best.loss[better], best.epoch[better] = loss[better], epoch
