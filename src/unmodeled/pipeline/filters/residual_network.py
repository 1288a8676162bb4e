"""A small ReLU network of the state, trained on what a filter estimated: [Fereoli2024]."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import torch

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, NumericalError

__all__ = ["ResidualNetwork", "relative_percent", "train_residual_network"]


def relative_percent(y: Array, predicted: Array) -> float:
    """Return 100 sum |y - predicted| / sum |y|: [Fereoli2024] Eq. 31."""
    return 100.0 * float(np.abs(y - predicted).sum()) / float(np.abs(y).sum())


@dataclass(frozen=True)
class ResidualNetwork:
    """A trained network as bare arrays: a `LearnedAcceleration` of position and velocity.

    Parameters
    ----------
    weights, biases : tuple of ndarray
        Of each layer, in scaled units.
    x_mean, x_scale : ndarray (6,)
    y_mean, y_scale : ndarray (3,)
    training_percent, validation_percent : float
        Error against the labels, `relative_percent`. The labels are estimates: the error against
        the truth is another number.
    losses : ndarray
        Mean squared error of the scaled training labels, by epoch.
    validation : ndarray (checks, 2)
        Epochs and the error of the held-out labels there, percent: [Fereoli2024] Fig. 10.
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    x_mean: Array
    x_scale: Array
    y_mean: Array
    y_scale: Array
    training_percent: float = float("nan")
    validation_percent: float = float("nan")
    losses: Array = field(default_factory=lambda: np.empty(0), repr=False)
    validation: Array = field(default_factory=lambda: np.empty((0, 2)), repr=False)

    @property
    def size(self) -> int:
        """Number of weights and biases."""
        return sum(w.size for w in self.weights) + sum(b.size for b in self.biases)

    def evaluate(self, x: Array, t: float) -> tuple[Array, Array, None]:
        """Return acceleration (b, 3) and Jacobian (b, 3, n); it knows no covariance."""
        h = (x[:, :6] - self.x_mean) / self.x_scale
        slopes = np.broadcast_to(np.diag(1.0 / self.x_scale), (len(x), 6, 6))
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            h = h @ weight.T + bias
            active = h > 0.0
            h = np.where(active, h, 0.0)
            slopes = active[:, :, None] * (weight @ slopes)
        J = np.zeros((len(x), 3, x.shape[1]))
        J[:, :, :6] = self.y_scale[:, None] * (self.weights[-1] @ slopes)
        return self.y_mean + self.y_scale * (h @ self.weights[-1].T + self.biases[-1]), J, None


def train_residual_network(
    states: Array,
    labels: Array,
    hidden: tuple[int, ...] = (10, 10, 10),
    epochs: int = 5000,
    learning_rate: float = 1e-3,
    training_share: float = 0.8,
    seed: int = 0,
    checks: int = 0,
    tell: Callable[[float], None] | None = None,
) -> ResidualNetwork:
    """Train on estimates of state and unmodelled acceleration.

    All training samples in each step, Adam, mean squared error: [Fereoli2024] Table II, which
    has 200,000 epochs at 1e-4. Its three hidden layers of 10 have 323 parameters; the 433 that
    the text counts are those of four, ``hidden=(10, 10, 10, 10)``. Inputs and labels are
    centred and scaled by axis (the paper does not say). An input that does not vary is left out
    by a scale of one; an axis of the labels that does not vary is not trained and answered with
    its value, for what an untrained output leaves there would count against the others.

    Parameters
    ----------
    states : ndarray (k, 6)
        Estimated positions and velocities.
    labels : ndarray (k, 3)
        Estimated accelerations: the Gauss-Markov states of a filter.
    hidden : tuple of int
    epochs : int
    learning_rate : float
    training_share : float
        Of the samples, drawn at random; the rest validates.
    seed : int
        Of the split and of the first weights.
    checks : int
        How often the held-out labels are looked at, at epochs that are equal in their logarithm;
        the network does not learn from it.
    tell : callable, optional
        Told the share of the epochs that is done.

    Raises
    ------
    DataError, NumericalError
    """
    X = as_array(states, ("k", 6), "states")
    y = as_array(labels, ("k", 3), "labels")
    if len(X) != len(y) or len(X) < 10:
        raise DataError(f"{len(X)} states and {len(y)} labels", allowed="10 or more pairs")
    if epochs < 1 or not learning_rate > 0.0 or not 0.0 < training_share < 1.0:
        raise ConfigError(
            f"epochs {epochs}, learning_rate {learning_rate}, training_share {training_share}",
            allowed="epochs >= 1, a positive rate, a share between 0 and 1",
        )
    order = np.random.default_rng(seed).permutation(len(X))
    cut = round(training_share * len(X))
    train, validate = order[:cut], order[cut:]
    x_mean, x_scale = _scaling(X[train])
    y_mean, y_spread = _scaling(y[train])
    varies = np.ptp(y[train], axis=0) > 0.0
    y_scale = np.where(varies, y_spread, 0.0)
    inputs = torch.from_numpy((X[train] - x_mean) / x_scale)
    targets = torch.from_numpy((y[train] - y_mean) / y_spread)
    trained = torch.from_numpy(np.flatnonzero(varies))
    if not varies.any():
        raise DataError("no label varies", do="train on estimates of a disturbance")
    layers = _layers((6, *hidden, 3), seed)
    parameters = [p for pair in layers for p in pair]
    optimizer = torch.optim.Adam(parameters, lr=learning_rate)
    losses = np.empty(epochs)
    held_out = torch.from_numpy((X[validate] - x_mean) / x_scale)
    at = _check_epochs(epochs, checks)
    validation = []
    for epoch in range(epochs):
        wrong = _outputs(layers, inputs) - targets
        loss = torch.mean(wrong[:, trained] ** 2)
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        losses[epoch] = loss.item()
        if epoch + 1 in at:
            with torch.no_grad():
                said = _outputs(layers, held_out).numpy()
            percent = relative_percent(y[validate], y_mean + y_scale * said)
            validation.append((epoch + 1.0, percent))
            if tell is not None:
                tell((epoch + 1) / epochs)
    if not np.isfinite(losses[-1]):
        raise NumericalError("the loss of the network is not finite", do="lower learning_rate")
    weights = tuple(w.detach().numpy().copy() for w, _ in layers)
    biases = tuple(b.detach().numpy().copy() for _, b in layers)
    plain = ResidualNetwork(weights, biases, x_mean, x_scale, y_mean, y_scale)
    fitted, checked = (
        relative_percent(y[part], plain.evaluate(X[part], 0.0)[0]) for part in (train, validate)
    )
    return replace(
        plain,
        training_percent=fitted,
        validation_percent=checked,
        losses=losses,
        validation=np.array(validation).reshape(-1, 2),
    )


def _outputs(
    layers: Sequence[tuple[torch.Tensor, torch.Tensor]], inputs: torch.Tensor
) -> torch.Tensor:
    h = inputs
    for weight, bias in layers[:-1]:
        h = torch.relu(torch.nn.functional.linear(h, weight, bias))
    return torch.nn.functional.linear(h, *layers[-1])


def _check_epochs(epochs: int, checks: int) -> frozenset[int]:
    if checks < 1:
        return frozenset()
    return frozenset(np.unique(np.geomspace(1, epochs, checks).round().astype(int)).tolist())


def _scaling(values: Array) -> tuple[Array, Array]:
    mean, spread = values.mean(axis=0), values.std(axis=0)
    size = np.abs(values).max(axis=0)
    return mean, np.where(spread > 1e-12 * np.maximum(size, 1e-300), spread, 1.0)


def _layers(sizes: tuple[int, ...], seed: int) -> list[tuple[torch.Tensor, torch.Tensor]]:
    """Return weights and biases, uniform within 1 / sqrt(inputs) as torch draws them."""
    generator = torch.Generator().manual_seed(seed)
    layers = []
    for inputs, outputs in pairwise(sizes):
        bound = inputs**-0.5
        shapes = ((outputs, inputs), (outputs,))
        pair = [
            ((2.0 * torch.rand(s, generator=generator, dtype=torch.float64) - 1.0) * bound)
            for s in shapes
        ]
        layers.append((pair[0].requires_grad_(), pair[1].requires_grad_()))
    return layers
