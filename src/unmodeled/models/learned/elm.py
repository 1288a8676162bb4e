"""Extreme learning machine: a random hidden layer, output weights by ridge regression."""

from __future__ import annotations

import math
from typing import ClassVar, Self

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.core.threads import one_thread
from unmodeled.models.learned._input_noise import PASSES, sample_variances
from unmodeled.models.learned.learner import Learner, NoiseLevel, Progress
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["ELM"]

#: Ridges tried by cross-validation, as shares of the largest squared singular value.
_RIDGES = np.logspace(-16, 4, 81)
#: Samples added, or predicted, at once.
_BLOCK = 1024


class ELM(Learner):
    """Network of one hidden layer that stays as it was drawn [Huang2006].

    Nodes are tanh(w . x - w . c), with w normal and c a sample drawn at random, so that every node
    bends where there are data.  The output weights solve a ridge regression; its ridge minimises
    generalised cross-validation ([Golub1979] Eq. 1.4) over the three components together, or,
    where noise is stated, maximises the evidence, with a factor of the noise of at least 1.  The
    constant is free of it.

    `update` adds samples without the earlier ones: the triangular root of the normal equations is
    carried along, so that the weights, ridge included, are those of one fit to all samples.  Only
    scale and nodes stay those of the first fit.

    Parameters
    ----------
    nodes : int
        Hidden nodes.
    weight_scale : float
        Standard deviation of the hidden weights, per scaled input.
    ridge : float, optional
        Fixed ridge, as a share of the largest squared singular value; chosen if not given.
    position_noise : bool
        Whether samples are weighted by the noise of the positions, through the gradient of the
        fit before, fitted three times.
    random_state : int
        Of the hidden layer.

    Attributes
    ----------
    ridge_ : float
        Ridge in use, as a share of the largest squared singular value.
    freedom_ : float
        Effective number of parameters of a component, of ``nodes + 1``.

    Notes
    -----
    Measured on 238 samples along one orbit about a Bennu-like body (medians of three seeds,
    fractional error between the samples): without noise scales 0.2, 0.5, 1 and 2 give 3e-5, 3e-6,
    2e-6 and 7e-6, at 1 100 and 400 nodes 2e-4 and 4e-7; with noise of 0.1 all of them 5e-3 to 7e-3.
    """

    name: ClassVar[str] = "elm"
    takes_features = True

    ridge_: float
    freedom_: float

    def __init__(
        self,
        nodes: int = 200,
        weight_scale: float = 1.0,
        ridge: float | None = None,
        position_noise: bool = True,
        random_state: int = 0,
    ) -> None:
        self.nodes = nodes
        self.weight_scale = weight_scale
        self.ridge = ridge
        self.position_noise = position_noise
        self.random_state = random_state

    def _fit(self, X: Array, y: Array, noise: NoiseLevel, progress: Progress) -> None:
        for key in ("nodes", "weight_scale"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"{self.name}: {key} is {getattr(self, key)}", allowed="> 0")
        if self.ridge is not None and not (math.isfinite(self.ridge) and self.ridge >= 0):
            raise ConfigError(f"{self.name}: ridge is {self.ridge}", allowed="a number >= 0")
        passes = PASSES if self.position_noise and noise.position else 1
        self._draw(Standardiser.of(X, y), X)
        for k in range(passes):
            size = self._noise_of(X, noise, k > 0)
            self._level = 0.0 if size is None else float(size[size > 0].min(initial=np.inf))
            self._root = np.zeros((self.nodes + 4, self.nodes + 4))
            self._count = 0
            self._add(X, y, size)
            self._solve()
            progress((k + 1) / passes)

    def update(self, X: Array, y: Array, noise: NoiseLevel | None = None) -> Self:
        """Learn from more samples.

        Parameters
        ----------
        X, y, noise
            As for ``fit``; noise is given here if and only if it was given there.

        Raises
        ------
        InputError
            Before ``fit``, or noise that is known for one part of the samples only.
        """
        self._require_fitted()
        X, y = as_array(X, ("n", self.n_inputs_), "X"), as_array(y, ("n", 3), "y")
        if len(X) != len(y):
            raise DataError(
                f"X has {len(X)} samples and y has {len(y)}", allowed="one acceleration a position"
            )
        size = self._noise_of(X, noise or NoiseLevel(), True)
        if (size is None) != (self._level == 0.0):
            raise InputError(
                f"{self.name}: the noise of the new samples is {'not ' * (size is None)}known, "
                f"that of the first ones is {'not ' * (self._level == 0.0)}",
                do="give the noise to both fit and update, or to neither",
            )
        with one_thread():
            self._add(X, y, size)
            self._solve()
        self.n_samples_ += len(X)
        return self

    def _draw(self, scaling: Standardiser, X: Array) -> None:
        generator = np.random.default_rng(self.random_state)
        x = scaling.positions(X)
        weights = self.weight_scale * generator.normal(size=(self.nodes, x.shape[1]))
        centres = x[generator.integers(len(x), size=self.nodes)]
        self._scaling, self._hidden = scaling, weights
        self._offset = -(weights * centres).sum(axis=1)

    def _noise_of(self, X: Array, noise: NoiseLevel, fitted: bool) -> Array | None:
        """Return the noise (n,) of each sample, None where none is known."""
        position = noise.position if self.position_noise else 0.0
        known = NoiseLevel(position, noise.acceleration, noise.samples, noise.gradient)
        jacobian = self._jacobian(X) if position and fitted else None
        variances = sample_variances(known, len(X), jacobian) + noise.acceleration**2
        return np.sqrt(variances.mean(axis=1)) if variances.any() else None

    def _nodes(self, x: Array) -> Array:
        """Values (m, nodes) at scaled inputs ``x`` (m, d), each row independent of the others."""
        products = sum(x[:, None, j] * self._hidden[None, :, j] for j in range(x.shape[1]))
        values: Array = np.tanh(products + self._offset)
        return values

    def _add(self, X: Array, y: Array, size: Array | None) -> None:
        """Take samples into the triangular root of the normal equations."""
        x, t = self._scaling.positions(X), self._scaling.targets(y)
        weight = np.ones(len(x))
        if size is not None:
            # a sample without noise counts as the best, not infinitely
            weight = self._level / np.where(size > 0, size, self._level)
        for k in range(0, len(x), _BLOCK):
            rows = slice(k, k + _BLOCK)
            nodes = self._nodes(x[rows])
            equations = np.column_stack([np.ones(len(nodes)), nodes, t[rows]])
            stacked = np.concatenate([self._root, weight[rows, None] * equations])
            root = scipy.linalg.qr(stacked, mode="r", overwrite_a=True, check_finite=False)[0]
            self._root = np.triu(root[: stacked.shape[1]])
        self._count += len(x)

    def _solve(self) -> None:
        p = self.nodes + 1
        # The constant comes first: below its row it is projected out of everything.
        u, s, vt = scipy.linalg.svd(self._root[1:p, 1:p])
        along, left = u.T @ self._root[1:p, p:], float((self._root[p:, p:] ** 2).sum())
        top = float(s[0]) ** 2
        ridges = _RIDGES if self.ridge is None else np.array([self.ridge])
        shrink = [r * top / np.maximum(s**2 + r * top, 1e-300) for r in ridges]
        freedom = np.array([float((1 - a).sum()) for a in shrink])
        misfit = np.array([left + float(((a[:, None] * along) ** 2).sum()) for a in shrink])
        if self._level:
            scores = -self._evidence(s, along, left, ridges * top)
        else:
            scores = misfit / np.maximum(self._count - 1 - freedom, 1e-9 * self._count) ** 2
        best = int(np.argmin(scores))
        self.ridge_, self.freedom_ = float(ridges[best]), 1.0 + float(freedom[best])
        # Directions that no sample shows are rounding of the root.
        usable = s**2 > top * (np.finfo(float).eps * p) ** 2
        gain = np.where(usable, s / np.maximum(s**2 + self.ridge_ * top, 1e-300), 0.0)
        weights = vt.T @ (gain[:, None] * along)
        constant = (self._root[0, p:] - self._root[0, 1:p] @ weights) / self._root[0, 0]
        self._constant = np.ascontiguousarray(constant)
        self._weights = np.ascontiguousarray(weights.T)

    def _evidence(self, s: Array, along: Array, left: float, ridges: Array) -> Array:
        """Log evidence of each prior variance ``level^2 / ridge``, up to a constant."""
        # [Rasmussen2006] Eq. 2.30 with a factor of the noise, at its most likely value but no
        # less than stated; the constant is projected out
        variance = (self._level / self._scaling.y_scale) ** 2
        count = 3 * (self._count - 1)
        total = 1.0 + s**2 / np.maximum(ridges[:, None], 1e-300)
        energy = (along**2).sum(axis=1)
        quadratic = ((energy / total).sum(axis=1) + left) / variance
        factor = np.maximum(1.0, quadratic / count)
        log_total = 3.0 * np.log(total).sum(axis=1)
        evidence: Array = -0.5 * (quadratic / factor + log_total + count * np.log(factor))
        return evidence

    def _predict(self, X: Array) -> Array:
        x, blocks = self._scaling.positions(X), [np.empty((0, 3))]
        for k in range(0, len(x), _BLOCK):
            nodes = self._nodes(x[k : k + _BLOCK])
            # Sums along the last axis, not BLAS, so that a row does not depend on its batch.
            columns = [(nodes * w).sum(axis=-1) for w in self._weights]
            blocks.append(self._constant + np.stack(columns, axis=1))
        return self._scaling.accelerations(np.concatenate(blocks))

    def _jacobian(self, X: Array) -> Array:
        x, blocks = self._scaling.positions(X), [np.empty((0, 3, X.shape[1]))]
        for k in range(0, len(x), _BLOCK):
            slope = 1.0 - self._nodes(x[k : k + _BLOCK]) ** 2
            rows = [
                np.stack([(slope * (w * h)).sum(axis=-1) for h in self._hidden.T], axis=1)
                for w in self._weights
            ]
            blocks.append(np.stack(rows, axis=1))
        return self._scaling.slopes * np.concatenate(blocks)

    def facts(self) -> dict[str, float | str]:
        """Return nodes, ridge, effective parameters and the largest weight (acceleration)."""
        self._require_fitted()
        return {
            "nodes": float(self.nodes),
            "ridge": self.ridge_,
            "effective parameters": self.freedom_,
            "largest_weight": float(np.abs(self._weights).max()) * self._scaling.y_scale,
        }

    def _arrays(self) -> dict[str, Array]:
        return self._scaling.arrays() | {
            "hidden": self._hidden,
            "offset": self._offset,
            "root": self._root,
            "weights": self._weights,
            "constant": self._constant,
            "numbers": np.array([self.ridge_, self.freedom_, self._level, float(self._count)]),
        }

    def _restore(self, arrays: dict[str, Array]) -> None:
        self._scaling = Standardiser.restore(arrays)
        self._hidden, self._offset = arrays["hidden"], arrays["offset"]
        self._root, self._weights = arrays["root"], arrays["weights"]
        self._constant = arrays["constant"]
        ridge, freedom, level, count = (float(v) for v in arrays["numbers"])
        self.ridge_, self.freedom_, self._level, self._count = ridge, freedom, level, int(count)
