"""A gravity network of the third generation (PINN-GM-III), in torch, after its published design."""

from __future__ import annotations

import copy
import math
from itertools import pairwise
from typing import Self

import numpy as np
import torch
from torch import Tensor, nn

from unmodeled.core.arrays import Array
from unmodeled.core.threads import one_thread

__all__ = ["PinnGM"]


class PinnGM:
    r"""Potential of a network beside that of a point mass, blended far away; a = grad U.

    Features [r_i, 1/r_e, x/r, y/r, z/r] (r_i is r within the reference radius and 1 beyond, r_e the
    other way round); GELU layers, the last one zero at the start; :math:`U_{nn} / r^2` beyond the
    radius (power 2 where a point mass is fused); :math:`U = g (U_{nn} + U_{pm}) + h U_{pm}`, h =
    (1 + tanh k (r - r_ref)) / 2, g = 1 - h, k and r_ref trained; loss the mean of
    :math:`|\Delta a| + |\Delta a| / |a|`; Adam from 2^-8, halved on a plateau of the loss on a
    tenth held out; the best state is kept, as a copy. Single precision, as published.

    C20 is not fused: for asteroids the published code takes the point mass alone.

    Parameters
    ----------
    gm, radius : float
        Gravitational parameter and reference radius in the units of the samples.
    units, layers : int
        Width and number of hidden layers.
    epochs, batch : int
        Passes and samples of a step.
    most_steps : int
        Where training ends at the latest: the honest limit of a small machine.
    patience : int
        Epochs without a better loss before the rate is halved.
    reach : float
        Where the blend begins, radii.
    random_state : int
    """

    def __init__(
        self,
        gm: float,
        radius: float,
        units: int = 64,
        layers: int = 8,
        epochs: int = 2**14,
        batch: int = 2**11,
        most_steps: int = 4000,
        patience: int = 200,
        reach: float = 10.0,
        random_state: int = 0,
    ) -> None:
        self.gm, self.radius = gm, radius
        self.units, self.layers = units, layers
        self.epochs, self.batch, self.most_steps = epochs, batch, most_steps
        self.patience, self.reach, self.random_state = patience, reach, random_state

    def fit(self, X: Array, y: Array) -> Self:
        """Learn from positions (n, 3) and accelerations (n, 3)."""
        with one_thread():
            torch.manual_seed(self.random_state)
            generator = np.random.default_rng(self.random_state)
            x = X / self.radius
            # Units of acceleration: the largest that the point mass leaves is one.
            left = y + self.gm * X / np.linalg.norm(X, axis=1)[:, None] ** 3
            self.scale_ = float(np.linalg.norm(left, axis=1).max())
            self._mass = self.gm / self.radius**2 / self.scale_
            order = generator.permutation(len(x))
            held = max(1, len(x) // 10)
            to = [torch.as_tensor(v, dtype=torch.float32) for v in (x, y / self.scale_)]
            train, check = (
                [v[order[part]] for v in to] for part in (slice(held, None), slice(held))
            )
            self._model = _Potential(self.units, self.layers, self._mass, self.reach)
            self._train(train, check[0], check[1], generator)
        return self

    def _train(
        self, train: list[Tensor], x: Tensor, a: Tensor, generator: np.random.Generator
    ) -> None:
        model = self._model
        optimizer = torch.optim.Adam(model.parameters(), lr=2.0**-8)
        scheduler = torch.optim.lr_scheduler.ReduceLROnPlateau(
            optimizer, factor=0.5, patience=self.patience, min_lr=1e-6
        )
        best, kept = math.inf, copy.deepcopy(model.state_dict())
        self.steps_ = self.epochs_ = 0
        count = len(train[0])
        for _ in range(self.epochs):
            order = torch.as_tensor(generator.permutation(count))
            for k in range(0, count, self.batch):
                chosen = order[k : k + self.batch]
                optimizer.zero_grad()
                loss = _loss(model, train[0][chosen], train[1][chosen], True)
                loss.backward()
                optimizer.step()
                self.steps_ += 1
            self.epochs_ += 1
            value = self.last_loss_ = float(_loss(model, x, a, False))
            scheduler.step(value)
            if value < best:
                best, kept = value, copy.deepcopy(model.state_dict())
            if self.steps_ >= self.most_steps:
                break
        model.load_state_dict(kept)
        self.loss_ = best

    def predict(self, X: Array) -> Array:
        """Return accelerations (n, 3)."""
        x = torch.as_tensor(X / self.radius, dtype=torch.float32)
        a: Array = self._model.acceleration(x, False).detach().numpy().astype(float)
        return a * self.scale_

    @property
    def parameters(self) -> int:
        """Number of weights."""
        return sum(p.numel() for p in self._model.parameters())


def _loss(model: _Potential, x: Tensor, a: Tensor, training: bool) -> Tensor:
    error = torch.linalg.vector_norm(model.acceleration(x, training) - a, dim=1)
    total: Tensor = (error + error / torch.linalg.vector_norm(a, dim=1)).mean()
    return total


class _Potential(nn.Module):
    """The force function U in scaled units, a = +grad U."""

    def __init__(self, units: int, layers: int, mass: float, reach: float) -> None:
        super().__init__()
        sizes = [5, *[units] * layers]
        parts: list[nn.Module] = []
        for inner, outer in pairwise(sizes):
            dense = nn.Linear(inner, outer)
            nn.init.xavier_normal_(dense.weight)
            nn.init.zeros_(dense.bias)
            parts += [dense, nn.GELU()]
        last = nn.Linear(units, 1)
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)
        self.net = nn.Sequential(*parts, last)
        self.mass = mass
        self.k = nn.Parameter(torch.tensor(0.5))
        self.r_ref = nn.Parameter(torch.tensor(reach))

    def forward(self, x: Tensor) -> Tensor:
        r = torch.linalg.vector_norm(x, dim=1, keepdim=True)
        within = torch.clamp(r, max=1.0)
        beyond = torch.clamp(r, min=1.0)
        u = self.net(torch.cat([within, 1.0 / beyond, x / r], dim=1)) / beyond**2
        point = self.mass / r
        h = 0.5 * (1 + torch.tanh(self.k * (r - self.r_ref)))
        total: Tensor = (1 - h) * u + point
        return total

    def acceleration(self, x: Tensor, training: bool) -> Tensor:
        x = x.detach().requires_grad_(True)
        (gradient,) = torch.autograd.grad(self(x).sum(), x, create_graph=training)
        return gradient
