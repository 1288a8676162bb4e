"""Spectrally normalised ReLU network with a certified Lipschitz bound."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import torch

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["SpectralMLP"]

#: Epochs between two frozen networks; the norms cost as much as two epochs.
_CHECK_EVERY = 10


class SpectralMLP(Learner):
    """ReLU network whose slope is bounded by construction.

    The network of [Neamati2022] Table 1: 6 hidden layers of 80 units, ReLU, spectral
    normalisation, mean squared error, Adam at a constant rate, all samples in each step.
    [Miyato2018] divides each weight matrix by an estimate of its largest singular value, got by
    power iteration; here each of the ``layers + 1`` matrices is then multiplied by
    ``lipschitz ** (1 / (layers + 1))``, as in [Shi2019].  ReLU does not lengthen differences, so
    the whole network has a Lipschitz constant of at most ``lipschitz`` in scaled coordinates.
    After training the matrices are frozen, their norms computed by singular value decomposition
    and any excess of the estimate divided out: the bound holds for the network that predicts.

    Parameters
    ----------
    layers, width : int
        Number and size of the hidden layers.
    epochs : int
        Adam steps.
    learning_rate : float
        Of Adam.
    lipschitz : float
        Bound in scaled coordinates: root-mean-square spreads of acceleration per spread of
        position (`Standardiser`).
    random_state : int
        Seed of the initial weights; the only randomness.

    Attributes
    ----------
    lipschitz_bound_ : float
        Certified: ``|a(x) - a(x')| <= lipschitz_bound_ |x - x'|`` for all positions, in units of
        acceleration per length.
    loss_ : float
        Mean squared error of the frozen network on the scaled samples.

    Notes
    -----
    The paper gives neither bound nor rate nor number of epochs.  The defaults were measured on 238
    noise-free samples along one orbit about a Bennu-like body (medians of six orbits; fractional
    error between the samples).  The field's own largest slope there is 3 to 11 in scaled
    coordinates, and 7 to 33 with the point mass taken off, so that 30 leaves room for both:
    bounds of 1, 10, 30 and 100 give 3e-1, 4e-3, 5e-3 and 5e-3.  Beyond that the rate hardly
    matters (5e-4, 1e-3 and 2e-3 give 4e-3 to 5e-3), nor do 3000 epochs against 5000; 1000 give
    6e-3.  What remains is the jitter of a constant rate on a piecewise linear function.
    """

    name: ClassVar[str] = "spectral_mlp"

    lipschitz_bound_: float
    loss_: float

    def __init__(
        self,
        layers: int = 6,
        width: int = 80,
        epochs: int = 3000,
        learning_rate: float = 1e-3,
        lipschitz: float = 30.0,
        random_state: int = 0,
    ) -> None:
        self.layers = layers
        self.width = width
        self.epochs = epochs
        self.learning_rate = learning_rate
        self.lipschitz = lipschitz
        self.random_state = random_state

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        for key in ("layers", "width", "epochs", "learning_rate", "lipschitz"):
            if not (math.isfinite(getattr(self, key)) and getattr(self, key) > 0):
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}", allowed="> 0")
        scaling = Standardiser.of(X, y)
        share = self.lipschitz ** (1.0 / (self.layers + 1))
        network = _Network(self.layers, self.width, share, self.random_state)
        weights, biases, self.loss_ = network.train(
            scaling.positions(X), scaling.targets(y), self.epochs, self.learning_rate, progress
        )
        if not weights:
            raise NumericalError(
                f"{self.name}: the loss of {len(X)} samples is not finite",
                do="lower learning_rate",
            )
        self._set_state(scaling, weights, biases)

    def _set_state(self, scaling: Standardiser, weights: list[Array], biases: list[Array]) -> None:
        self._scaling, self._weights, self._biases = scaling, weights, biases
        norms = [float(np.linalg.norm(w, 2)) for w in weights]
        self.lipschitz_bound_ = math.prod(norms) * scaling.slope

    def _predict(self, X: Array) -> Array:
        scaled = _forward(self._weights, self._biases, self._scaling.positions(X))
        return self._scaling.accelerations(scaled)

    def _jacobian(self, X: Array) -> Array:
        h = self._scaling.positions(X)
        slopes = np.broadcast_to(np.eye(3), (len(X), 3, 3))
        for weight, bias in zip(self._weights[:-1], self._biases[:-1], strict=True):
            h = h @ weight.T + bias
            active = h > 0.0  # the derivative of ReLU; zero on the kink itself
            h = np.where(active, h, 0.0)
            slopes = active[:, :, None] * (weight @ slopes)
        jacobian: Array = self._scaling.slope * (self._weights[-1] @ slopes)
        return jacobian

    def facts(self) -> dict[str, float | str]:
        """Return the certified bound (acceleration per length), its scaled value and the loss."""
        self._require_fitted()
        return {
            "lipschitz_bound": self.lipschitz_bound_,
            "lipschitz_bound_scaled": self.lipschitz_bound_ / self._scaling.slope,
            "loss": self.loss_,
            "weights": float(sum(w.size for w in self._weights + self._biases)),
        }

    def _arrays(self) -> dict[str, Array]:
        arrays = self._scaling.arrays() | {"loss": np.array([self.loss_])}
        for k, (weight, bias) in enumerate(zip(self._weights, self._biases, strict=True)):
            arrays |= {f"weight_{k}": weight, f"bias_{k}": bias}
        return arrays

    def _restore(self, arrays: dict[str, Array]) -> None:
        weights = [arrays[f"weight_{k}"] for k in range(self.layers + 1)]
        biases = [arrays[f"bias_{k}"] for k in range(self.layers + 1)]
        self._set_state(Standardiser.restore(arrays), weights, biases)
        self.loss_ = float(arrays["loss"][0])


def _forward(weights: list[Array], biases: list[Array], x: Array) -> Array:
    """Return outputs (n, 3) at scaled positions ``x`` (n, 3)."""
    for weight, bias in zip(weights[:-1], biases[:-1], strict=True):
        x = np.maximum(x @ weight.T + bias, 0.0)
    outputs: Array = x @ weights[-1].T + biases[-1]
    return outputs


class _Network:
    """The network in training: each matrix times ``share`` over its estimated spectral norm.

    The hidden matrices lie in one stack, so that one power iteration serves them all.
    """

    def __init__(self, layers: int, width: int, share: float, seed: int) -> None:
        # A generator of its own: torch's global stream stays as it was.
        generator = torch.Generator().manual_seed(seed)

        def random(*shape: int) -> torch.Tensor:
            return torch.empty(shape, dtype=torch.float64).normal_(generator=generator)

        self._share = share
        weights = [random(1, width, 3), random(layers - 1, width, width), random(1, 3, width)]
        # Start on the bound, so that Adam's step is small against the weights' size, not 1.
        weights = [w * (share / torch.linalg.matrix_norm(w, ord=2, keepdim=True)) for w in weights]
        # Biases of the first layer spread its kinks over the samples, which have spread 1.
        biases = [random(1, width), 0.1 * random(layers - 1, width), 0.0 * random(1, 3)]
        self._right = [torch.linalg.svd(w).Vh[:, 0, :, None] for w in weights]
        self._weights = [w.requires_grad_() for w in weights]
        self._biases = [b.requires_grad_() for b in biases]

    def _normalised(self) -> list[torch.Tensor]:
        """One step of power iteration, and the matrices brought to norm ``share``."""
        stacks = []
        for k, weight in enumerate(self._weights):
            with torch.no_grad():
                left = torch.nn.functional.normalize(weight @ self._right[k], dim=1)
                self._right[k] = torch.nn.functional.normalize(weight.mT @ left, dim=1)
            norm = left.mT @ weight @ self._right[k]
            stacks.append(weight * (self._share / norm))
        return [*stacks[0].unbind(0), *stacks[1].unbind(0), *stacks[2].unbind(0)]

    def _frozen(self, tensors: list[torch.Tensor]) -> list[Array]:
        """Return copies in numpy, matrices brought down to norm ``share`` where above."""
        arrays = [np.array(t.detach().numpy()) for t in tensors]
        return [
            a * min(1.0, self._share / float(np.linalg.norm(a, 2))) if a.ndim == 2 else a
            for a in arrays
        ]

    def train(
        self, x: Array, t: Array, epochs: int, learning_rate: float, progress: Progress
    ) -> tuple[list[Array], list[Array], float]:
        """Minimise the mean squared error; return frozen matrices, biases and their loss.

        At a constant rate Adam keeps jumping about the minimum, by a factor of ten in the loss,
        and power iteration lags by up to a per cent of a norm, which the frozen network has to
        give up: the last epoch is a draw of luck.  So every few epochs the network is frozen,
        and of these the best is returned; no matrices if there was none with a finite loss.
        """
        inputs, targets = torch.from_numpy(x), torch.from_numpy(t)
        adam = torch.optim.Adam([*self._weights, *self._biases], lr=learning_rate, fused=True)
        kept: tuple[list[Array], list[Array], float] = ([], [], math.inf)
        for epoch in range(epochs):
            adam.zero_grad()
            weights = self._normalised()
            biases = [b for stack in self._biases for b in stack.unbind(0)]
            h = inputs
            for weight, bias in zip(weights[:-1], biases[:-1], strict=True):
                h = torch.relu(torch.addmm(bias, h, weight.T))
            loss = torch.mean((torch.addmm(biases[-1], h, weights[-1].T) - targets) ** 2)
            # The comparison is False for NaN.
            if (epoch % _CHECK_EVERY == 0 or epoch == epochs - 1) and loss.item() < kept[2]:
                frozen = self._frozen(weights), self._frozen(biases)
                true_loss = float(np.mean((_forward(*frozen, x) - t) ** 2))
                if true_loss < kept[2]:
                    kept = (*frozen, true_loss)
            loss.backward()  # type: ignore[no-untyped-call]
            adam.step()
            progress((epoch + 1) / epochs)
        return kept
