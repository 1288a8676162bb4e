"""Plain multilayer perceptron, alone or as a deep ensemble with a calibrated covariance."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.models.learned._plain_training import Trained, outputs, train
from unmodeled.models.learned._sample_noise import covariances, relative, whitening
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["MLP"]

_ACTIVATIONS = ("relu", "tanh")
#: The held-out components that the band is scaled to hold: 95 % within 1.96 standard deviations.
_COVERED, _BAND = 0.95, 1.959963984540054
#: Factors of the variance that are looked through; the spread is never made smaller, or stated
#: noise that hides the misfit of the model would make the band vanish.
_FACTORS = np.logspace(0, 8, 161)


class MLP(Learner):
    """Small network of [Fereoli2024]: three hidden layers of ten units, ReLU, Adam, squared error.

    A fifth of the samples is held out, as there; the weights of the epoch that does best on them
    are kept. Inputs and targets are scaled (`Standardiser`), which the paper leaves open, and its
    200,000 epochs at a rate of 1e-4 are 5,000 at 3e-3 here. All samples are in each step: its
    batch is the whole set. Six inputs, position and velocity, come by `InputFeatures`.

    With ``members`` above one it is a deep ensemble [Lakshminarayanan2017]: networks that differ in
    their start; the mean predicts, and their spread times one factor is the standard deviation,
    the same on all axes. The factor, at least 1, makes the band of 95 % hold 95 % of the held-out
    components, their stated noise taken into account.

    Parameters
    ----------
    layers, width : int
        Number and size of the hidden layers.
    activation : {"relu", "tanh"}
        Of the hidden layers.
    epochs : int
        Adam steps.
    learning_rate : float
        Of Adam.
    validation : float
        Share of the samples that is held out, more than 0 and less than 1.
    members : int
        Networks; 1 gives no covariance.
    random_state : int
        Of split and initial weights.

    Attributes
    ----------
    validation_error_ : float
        [Fereoli2024] Eq. 31 as a share: sum of |misfits| over sum of |accelerations|, of what is
        learned, on the held-out samples.
    best_epoch_ : float
        Epoch of the weights kept, mean over the members.
    spread_factor_ : float
        What the spread is multiplied by; 1 for one member.
    """

    name: ClassVar[str] = "mlp"
    takes_features = True

    validation_error_: float
    best_epoch_: float
    spread_factor_: float

    def __init__(
        self,
        layers: int = 3,
        width: int = 10,
        activation: Literal["relu", "tanh"] = "relu",
        epochs: int = 5000,
        learning_rate: float = 3e-3,
        validation: float = 0.2,
        members: int = 1,
        random_state: int = 0,
    ) -> None:
        self.layers = layers
        self.width = width
        self.activation = activation
        self.epochs = epochs
        self.learning_rate = learning_rate
        self.validation = validation
        self.members = members
        self.random_state = random_state
        self.has_covariance = members > 1

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        self._check()
        scaling = Standardiser.of(X, y)
        x, t = scaling.positions(X), scaling.targets(y)
        covariance = covariances(noise, len(X), scaling.slope)
        white = relative(whitening(covariance))
        order = np.random.default_rng([self.random_state, 0]).permutation(len(X))
        count = min(max(1, round(self.validation * len(X))), len(X) - 1)
        held, rest = order[:count], order[count:]
        found = train(
            [x.shape[1], *[self.width] * self.layers, 3],
            [[self.random_state, 1 + k] for k in range(self.members)],
            (x[rest], t[rest], None if white is None else white[rest]),
            (x[held], t[held], None if white is None else white[held]),
            self.activation,
            self.epochs,
            self.learning_rate,
            progress,
        )
        if not np.isfinite(found.loss).all():
            raise NumericalError(
                f"{self.name}: the loss of {len(X)} samples is not finite",
                do="lower learning_rate",
            )
        self._set_state(scaling, found)
        misfit = y[held] - self._predict(X[held])
        size = float(np.abs(y[held]).sum())
        self.validation_error_ = float(np.abs(misfit).sum()) / max(size, 1e-300)
        self.best_epoch_ = float(found.epoch.mean())
        known = np.diagonal(covariance[held], axis1=1, axis2=2)
        self.spread_factor_ = 1.0
        if self.members > 1:
            self.spread_factor_ = _factor(misfit, self._spread(X[held]), known)
        progress(1.0)

    def _check(self) -> None:
        for key in ("layers", "width", "epochs", "learning_rate", "members"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}", allowed="> 0")
        if not 0 < self.validation < 1:
            raise ConfigError(
                f"{self.name}: validation is {self.validation}", allowed="more than 0, less than 1"
            )
        if self.activation not in _ACTIVATIONS:
            raise ConfigError(
                f'{self.name}: activation is "{self.activation}"', allowed=", ".join(_ACTIVATIONS)
            )

    def _set_state(self, scaling: Standardiser, found: Trained) -> None:
        self._scaling, self._found = scaling, found

    def _layers(self, X: Array) -> list[Array]:
        x = self._scaling.positions(X)
        return outputs(self._found.weights, self._found.biases, x, self.activation)

    def _predict(self, X: Array) -> Array:
        return self._scaling.accelerations(self._layers(X)[-1].mean(axis=0))

    def _spread(self, X: Array) -> Array:
        """Return the variance (n,) of the members, mean over the axes, unscaled."""
        members = self._scaling.y_scale * self._layers(X)[-1]
        variance: Array = members.var(axis=0, ddof=1).mean(axis=1)
        return variance

    def _predict_covariance(self, X: Array) -> Array:
        return self.spread_factor_ * self._spread(X)[:, None, None] * np.eye(3)

    def _jacobian(self, X: Array) -> Array:
        layers, weights = self._layers(X), self._found.weights
        slopes = np.broadcast_to(np.eye(X.shape[1]), (self.members, len(X), *(X.shape[1],) * 2))
        for h, weight in zip(layers[:-1], weights[:-1], strict=True):
            own = (h > 0.0) if self.activation == "relu" else (1.0 - h**2)
            slopes = own[..., None] * (weight[:, None] @ slopes)
        jacobian: Array = self._scaling.slopes * (weights[-1][:, None] @ slopes).mean(axis=0)
        return jacobian

    def facts(self) -> dict[str, float | str]:
        """Return the validation error (Eq. 31), the epoch kept, weights and factor of the band."""
        self._require_fitted()
        found = self._found
        facts: dict[str, float | str] = {
            "validation_error": self.validation_error_,
            "best_epoch": self.best_epoch_,
            "weights": float(sum(w.size for w in found.weights + found.biases)),
        }
        return facts | ({"spread_factor": self.spread_factor_} if self.members > 1 else {})

    def _arrays(self) -> dict[str, Array]:
        arrays = self._scaling.arrays() | {
            "numbers": np.array([self.validation_error_, self.best_epoch_, self.spread_factor_])
        }
        for k, pair in enumerate(zip(self._found.weights, self._found.biases, strict=True)):
            arrays |= {f"weight_{k}": pair[0], f"bias_{k}": pair[1]}
        return arrays

    def _restore(self, arrays: dict[str, Array]) -> None:
        weights = [arrays[f"weight_{k}"] for k in range(self.layers + 1)]
        biases = [arrays[f"bias_{k}"] for k in range(self.layers + 1)]
        none = np.zeros(self.members)
        self._set_state(Standardiser.restore(arrays), Trained(weights, biases, none, none))
        numbers = (float(v) for v in arrays["numbers"])
        self.validation_error_, self.best_epoch_, self.spread_factor_ = numbers


def _factor(misfit: Array, spread: Array, known: Array) -> float:
    """Return the least factor of ``spread`` (n,) whose 95 % band holds 95 % of the misfits."""
    for factor in _FACTORS:
        band = _BAND * np.sqrt(factor * spread[:, None] + known)
        if np.mean(np.abs(misfit) <= band) >= _COVERED:
            return float(factor)
    return float(_FACTORS[-1])
