"""Spectrally normalised ReLU network with a certified Lipschitz bound."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar, Literal

import numpy as np
import torch

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned._sample_noise import covariances, relative, whitening
from unmodeled.models.learned._spectral_training import SpectralStack, forward
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["SpectralMLP"]

_PRECISIONS = {"double": torch.float64, "single": torch.float32}


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

    Stated noise weighs the misfits where it differs between samples or axes: noise of single
    samples, and that of the positions through the gradient of the point mass below (`Residual`).
    The paper's network, of the raw acceleration under one noise level, has no weights.

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
    precision : {"double", "single"}
        Numbers of the training. ``single`` takes half the time; what predicts is in double
        precision in any case, and so is its certified bound.

    Attributes
    ----------
    lipschitz_bound_ : float
        Certified: ``|a(x) - a(x')| <= lipschitz_bound_ |x - x'|`` for all positions, in units of
        acceleration per length; inputs beyond the position are then the same at both.
    loss_ : float
        Mean squared error of the frozen network on the scaled samples, weighted as in the fit.

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
    takes_features = True

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
        precision: Literal["double", "single"] = "double",
    ) -> None:
        self.layers = layers
        self.width = width
        self.epochs = epochs
        self.learning_rate = learning_rate
        self.lipschitz = lipschitz
        self.random_state = random_state
        self.precision = precision

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        self._fit_stack([self], [X], [y], [noise], torch.device("cpu"), progress)

    @classmethod
    def _fit_stack(
        cls,
        members: Sequence[SpectralMLP],
        X: Sequence[Array],
        y: Sequence[Array],
        noise: Sequence[NoiseLevel],
        device: torch.device,
        progress: Progress,
    ) -> list[NumericalError | None]:
        """Train members that differ in nothing but seed and data of one size; see `fit_batch`.

        Raises
        ------
        NumericalError
            For a single member; of several, the error stands in the place of the member.
        """
        first = members[0]
        for key in ("layers", "width", "epochs", "learning_rate", "lipschitz"):
            if not (math.isfinite(getattr(first, key)) and getattr(first, key) > 0):
                raise ConfigError(f"{cls.name}: {key} is {getattr(first, key)}", allowed="> 0")
        if first.precision not in _PRECISIONS:
            raise ConfigError(
                f'{cls.name}: precision is "{first.precision}"', allowed="double, single"
            )
        scalings = [Standardiser.of(a, b) for a, b in zip(X, y, strict=True)]
        stack = SpectralStack(
            first.layers,
            first.width,
            first.lipschitz ** (1.0 / (first.layers + 1)),
            [m.random_state for m in members],
            device,
            _PRECISIONS[first.precision],
            X[0].shape[1],
        )
        networks = stack.train(
            np.stack([s.positions(a) for s, a in zip(scalings, X, strict=True)]),
            np.stack([s.targets(b) for s, b in zip(scalings, y, strict=True)]),
            first.epochs,
            first.learning_rate,
            progress,
            first._weights_of(noise, X, scalings),
        )
        errors: list[NumericalError | None] = []
        for member, scaling, network, samples in zip(members, scalings, networks, X, strict=True):
            errors.append(None)
            if network is None:
                errors[-1] = NumericalError(
                    f"{cls.name}: the loss of {len(samples)} samples is not finite",
                    do="lower learning_rate",
                )
                continue
            member.loss_ = network.loss
            member._set_state(scaling, network.weights, network.biases)
        if len(members) == 1 and errors[0] is not None:
            raise errors[0]
        return errors

    @staticmethod
    def _weights_of(
        noise: Sequence[NoiseLevel], X: Sequence[Array], scalings: Sequence[Standardiser]
    ) -> Array | None:
        """Return weights (b, n, 3, 3) of the misfits, None where every sample counts the same."""
        found = []
        for n, a, s in zip(noise, X, scalings, strict=True):
            found.append(relative(whitening(covariances(n, len(a), s.slope))))
        if all(w is None for w in found):
            return None
        one = np.broadcast_to(np.eye(3), (len(X[0]), 3, 3))
        return np.stack([one if w is None else w for w in found])

    def _set_state(self, scaling: Standardiser, weights: list[Array], biases: list[Array]) -> None:
        self._scaling, self._weights, self._biases = scaling, weights, biases
        norms = [float(np.linalg.norm(w, 2)) for w in weights]
        self.lipschitz_bound_ = math.prod(norms) * scaling.slope

    def _predict(self, X: Array) -> Array:
        scaled = forward(self._weights, self._biases, self._scaling.positions(X))
        return self._scaling.accelerations(scaled)

    def _jacobian(self, X: Array) -> Array:
        h = self._scaling.positions(X)
        d = X.shape[1]
        slopes = np.broadcast_to(np.eye(d), (len(X), d, d))
        for weight, bias in zip(self._weights[:-1], self._biases[:-1], strict=True):
            h = h @ weight.T + bias
            active = h > 0.0  # the derivative of ReLU; zero on the kink itself
            h = np.where(active, h, 0.0)
            slopes = active[:, :, None] * (weight @ slopes)
        jacobian: Array = self._scaling.slopes * (self._weights[-1] @ slopes)
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
