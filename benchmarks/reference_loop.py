"""The plain loop that a sweep is measured against: one data set after another, as most write it.

Nothing here is tuned for speed, and nothing is slowed down on purpose: a gpytorch exact process
for the three components as one batch, and a torch network with the library's own spectral
normalisation, both in torch's default float32, standardised, trained by Adam at a constant rate
with all samples in each step ([Neamati2022] Table 1).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

with warnings.catch_warnings():
    warnings.filterwarnings("ignore", r"`torch\.jit\.script` is deprecated", DeprecationWarning)
    import gpytorch

Array = np.ndarray

__all__ = ["ReferenceModel", "reference_gp", "reference_network"]


@dataclass
class ReferenceModel:
    """What the plain loop returns: a prediction and its loss (see the function)."""

    predict: Callable[[Array], Array]
    loss: float


class _Process(gpytorch.models.ExactGP):  # type: ignore[misc]
    def __init__(self, x: torch.Tensor, t: torch.Tensor, likelihood: object) -> None:
        super().__init__(x, t, likelihood)
        shape = torch.Size([3])
        self.mean_module = gpytorch.means.ConstantMean(batch_shape=shape)
        self.covar_module = gpytorch.kernels.ScaleKernel(
            gpytorch.kernels.RBFKernel(batch_shape=shape), batch_shape=shape
        )

    def forward(self, x: torch.Tensor) -> object:
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), self.covar_module(x))


def reference_gp(
    X: Array,
    y: Array,
    epochs: int = 100,
    learning_rate: float = 0.1,
    dtype: torch.dtype = torch.float32,
) -> ReferenceModel:
    """Train gpytorch's exact process on samples (n, 3); loss: negative log likelihood, summed.

    The likelihood is of the scaled targets, as gpytorch computes it.
    """
    scale = _Scale(X, y)
    x, t = scale.tensors(X, y, dtype)
    shape = torch.Size([3])
    likelihood = gpytorch.likelihoods.GaussianLikelihood(batch_shape=shape).to(dtype)
    model = _Process(x, t.T.contiguous(), likelihood).to(dtype)
    model.train()
    objective = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, model)
    adam = torch.optim.Adam(model.parameters(), lr=learning_rate)
    value = float("nan")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # jitter and slow convergence are only warned about
        for _ in range(epochs):
            adam.zero_grad()
            loss = -objective(model(*model.train_inputs), model.train_targets).sum()
            loss.backward()
            adam.step()
            value = float(loss.detach()) * len(X)
        model.eval()

    def predict(points: Array) -> Array:
        with torch.no_grad(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mean = model(scale.positions(points, dtype)).mean.T
        return scale.accelerations(mean)

    predict(X[:1])  # the weights of the mean are part of the training
    return ReferenceModel(predict, value)


def reference_network(
    X: Array,
    y: Array,
    epochs: int = 1000,
    learning_rate: float = 1e-3,
    lipschitz: float = 30.0,
    seed: int = 0,
) -> ReferenceModel:
    """Train torch's spectrally normalised network on samples (n, 3); loss: mean squared error.

    The output is multiplied by ``lipschitz``: with torch's own bound of 1 the network cannot
    follow the field.
    """
    torch.manual_seed(seed)
    norm = torch.nn.utils.parametrizations.spectral_norm
    sizes = [3, 80, 80, 80, 80, 80, 80, 3]
    parts: list[torch.nn.Module] = []
    for k in range(7):
        parts += [norm(torch.nn.Linear(sizes[k], sizes[k + 1])), torch.nn.ReLU()]
    model = torch.nn.Sequential(*parts[:-1])
    scale = _Scale(X, y)
    x, t = scale.tensors(X, y, torch.float32)
    adam = torch.optim.Adam(model.parameters(), lr=learning_rate)
    criterion = torch.nn.MSELoss()
    for _ in range(epochs):
        adam.zero_grad()
        loss = criterion(lipschitz * model(x), t)
        loss.backward()
        adam.step()
    model.eval()

    def predict(points: Array) -> Array:
        with torch.no_grad():
            return scale.accelerations(lipschitz * model(scale.positions(points, torch.float32)))

    with torch.no_grad():
        final = float(criterion(lipschitz * model(x), t))
    return ReferenceModel(predict, final)


class _Scale:
    """Centre and one scale for positions and accelerations, as the suite's learners use."""

    def __init__(self, X: Array, y: Array) -> None:
        self.x_mean, self.y_mean = X.mean(axis=0), y.mean(axis=0)
        self.x_scale = np.sqrt(((X - self.x_mean) ** 2).mean())
        self.y_scale = np.sqrt(((y - self.y_mean) ** 2).mean())

    def positions(self, X: Array, dtype: torch.dtype) -> torch.Tensor:
        return torch.tensor((X - self.x_mean) / self.x_scale, dtype=dtype)

    def tensors(self, X: Array, y: Array, dtype: torch.dtype) -> tuple[torch.Tensor, torch.Tensor]:
        return self.positions(X, dtype), torch.tensor((y - self.y_mean) / self.y_scale, dtype=dtype)

    def accelerations(self, scaled: torch.Tensor) -> Array:
        return self.y_mean + self.y_scale * scaled.double().numpy()
