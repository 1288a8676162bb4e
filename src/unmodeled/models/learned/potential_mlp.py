"""A small network of the potential; the acceleration is its gradient."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import ClassVar, Literal

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.threads import one_thread
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned._potential_evidence import (
    Data,
    Prior,
    Strengths,
    covariance_root,
    improve,
)
from unmodeled.models.learned._potential_field import PotentialField, shell
from unmodeled.models.learned._potential_network import Network
from unmodeled.models.learned._potential_noise import (
    likely_places,
    mass_by_moments,
    student_factors,
    weight_roots,
)
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress

__all__ = ["PotentialMLP"]

STUDENT=True
MOVE=True
BETA=True
FLOOR=1e-7

class PotentialMLP(Learner):
    name: ClassVar[str] = "potential_mlp"
    has_covariance = True
    stands_alone: ClassVar[bool] = True

    def __init__(
        self,
        layers: int = 2,
        width: int = 12,
        activation: Literal["tanh", "sine"] = "sine",
        inputs: Literal["kelvin", "direction"] = "kelvin",
        harmonic: bool = True,
        mass_error: float | None = None,
        lipschitz: float | None = None,
        steps: int = 60,
        passes: int = 4,
        points: int = 300,
        spread: float = 1.0,
        gm: float = NORMALISED_GM,
        radius: float = 1.0,
        random_state: int = 0,
    ) -> None:
        self.layers = layers
        self.width = width
        self.activation = activation
        self.inputs = inputs
        self.harmonic = harmonic
        self.mass_error = mass_error
        self.lipschitz = lipschitz
        self.steps = steps
        self.passes = passes
        self.points = points
        self.spread = spread
        self.gm = gm
        self.radius = radius
        self.random_state = random_state

    def _fit(self, X, y, noise, progress):
        field = self._field = self._network()
        start, scale = field.network.draw(self.random_state, self.spread)
        away = noise.gradient is not None
        unit = self.gm / self.radius**2
        x, t = X / self.radius, y / unit
        s = noise.position / self.radius
        level = NoiseLevel(s, noise.acceleration / unit, None if noise.samples is None else noise.samples / unit)
        outer = None if not away else noise.gradient * (self.radius / unit)
        known = 0.0 if away else 1.0
        fixed = self.mass_error
        if fixed is not None: mass, precision = known, min(max(fixed,1e-6)**-2, 1e12)
        else:
            precision = 1e-6
            mass = known if away else mass_by_moments(x, t, s)
        centre = np.concatenate([[known if fixed is not None else mass], start])
        prior = Prior(centre, np.concatenate([[1.0], scale]), precision, field.network.hidden,
                      shell(self.points) if self.harmonic else np.empty((0, 3)), lambda u: u)
        has = noise.position > 0 or noise.acceleration > 0 or noise.samples is not None
        u = centre.copy(); u[0] = mass
        places, target = x, t
        strengths = None
        passes = self.passes if noise.position > 0 else 1
        with one_thread():
            factors = np.ones(len(x))
            G = lambda p: self._field.gradient(p, u) + (0.0 if outer is None else outer)
            for k in range(passes):
                if has:
                    root0 = weight_roots(level, G(places))
                    root = root0 * factors[:, None, None]
                    floor = 1e-3
                else:
                    root = np.tile(np.eye(3), (len(x), 1, 1)); root0=root
                    floor = FLOOR
                data = Data(places, target, root)
                if strengths is None:
                    mis = (root @ (target - field.acceleration(places, u))[:, :, None]).ravel()
                    b = 1.0 if has else min(len(mis) / float(mis @ mis), 1e12)
                    strengths = Strengths(b, 1e4 if self.harmonic else 0.0, 1.0, 400.0)
                u, strengths = improve(field, data, prior, (u, strengths), self.steps if k == 0 else max(10, self.steps // 3), lambda z: None, floor)
                if noise.position > 0 and k<passes-1:
                    g = G(places)
                    rest = target - field.acceleration(places, u)
                    if STUDENT:
                        factors = student_factors((root0 @ rest[:, :, None])[:, :, 0]*np.sqrt(strengths.data))
                    if MOVE and not away:
                        restm = t - field.acceleration(places, u) - (g @ (x - places)[:, :, None])[:, :, 0]
                        places = likely_places(x, level, weight_roots(level, g), g, restm)
                        # keep out of the origin
                        g = field.gradient(places, u)
                        target = t - (g @ (x - places)[:, :, None])[:, :, 0]
            self._unknowns = u
            self._root = covariance_root(field, data, prior, u, strengths)
            self.strengths_ = strengths
        progress(1.0)

    def _network(self):
        return PotentialField(Network([3 if self.inputs == "kelvin" else 4] + [self.width] * self.layers, self.activation), self.inputs)

    def _predict(self, X):
        return self.gm / self.radius**2 * self._field.acceleration(X / self.radius, self._unknowns)

    def _jacobian(self, X):
        return self.gm / self.radius**3 * self._field.gradient(X / self.radius, self._unknowns)

    def _predict_covariance(self, X):
        _, slopes = self._field.slopes(X / self.radius, self._unknowns)
        half = self.gm / self.radius**2 * slopes @ self._root
        return half @ half.mT
    def _arrays(self): return {}
    def _restore(self, a): pass
