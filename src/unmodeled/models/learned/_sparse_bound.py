"""Titsias' collapsed bound of sparse processes, with its gradient in closed form.

[Titsias2009] Eq. 9 with a noise variance lambda_i of each sample: the log likelihood of targets
with covariance Q + diag(lambda), Q = K_fu K_uu^-1 K_uf, less sum_i (k_ii - q_ii) / (2 lambda_i).
Everything is whitened, A = L^-1 K_uf with K_uu = L L^T: the only matrix that is inverted beside the
triangular L is B = 1 + A diag(1/lambda) A^T, whose eigenvalues are above 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_solve, cholesky, solve_triangular

from unmodeled.core.arrays import Array
from unmodeled.models.learned._exact_gp_likelihood import Evaluation, Indices
from unmodeled.models.learned._kernels import correlation, scaled_squares, steepness

__all__ = ["JITTER", "SparseBound", "SparsePosterior"]

#: Share of the signal variance on the diagonal of K_uu, always: a part of the model.
JITTER = 1e-10
#: Samples taken at once.
_BLOCK = 4096


@dataclass(frozen=True, slots=True)
class SparsePosterior:
    """What a prediction needs of one component.

    Parameters
    ----------
    mean : float
        Constant mean, scaled.
    weights : ndarray (m,)
        Of the kernel at the inducing points.
    root, inner : ndarray (m, m)
        Lower factors of K_uu and of B.
    """

    mean: float
    weights: Array
    root: Array
    inner: Array


class SparseBound:
    """The negative bounds of three components, means at their most likely values.

    Parameters
    ----------
    x, t, own : ndarray (n, d), (n, 3), (n, 3)
        Scaled inputs and targets; known noise variances beside the estimated one, scaled.
    z : ndarray (m, d)
        Scaled inducing points.
    kernel : str
        Of `_kernels.KERNELS`.
    """

    def __init__(self, x: Array, t: Array, own: Array, z: Array, kernel: str) -> None:
        self._x, self._t, self._own, self._z, self._kernel = x, t, own, z, kernel

    def __call__(self, log_theta: Array, *, which: Indices) -> Evaluation:
        """Evaluate components ``which`` (k,) at ``log_theta`` (k, q), as `Likelihood`."""
        rows = [self._one(int(c), np.exp(a)) for c, a in zip(which, log_theta, strict=True)]
        value, gradient, mean = (np.array(column) for column in zip(*rows, strict=True))
        empty = np.full((*gradient.shape, gradient.shape[1]), math.nan)
        return Evaluation(value, gradient, empty, mean, np.zeros(len(value)))

    def values(self, log_theta: Array) -> Array:
        """Return the negative bounds (3,) at ``log_theta`` (3, q); infinite where there is none."""
        found = np.full(3, math.inf)
        for i, row in enumerate(log_theta):
            try:
                value = self._condition(i, np.exp(row))[3]
            except (LinAlgError, ValueError):
                continue
            found[i] = value if math.isfinite(value) else math.inf
        return found

    def posterior(self, component: int, theta: Array) -> SparsePosterior:
        """Return mean and weights of one component at ``theta`` (q,).

        Raises
        ------
        LinAlgError
            If a factorisation fails.
        """
        return self._condition(component, theta)[0]

    def _noise(self, component: int, theta: Array) -> Array:
        noise: Array = theta[-1] + self._own[:, component]
        return noise

    def _root(self, theta: Array) -> Array:
        kernel = theta[-2] * correlation(self._kernel, scaled_squares(self._z, self._z, theta[:-2]))
        kernel[np.diag_indices_from(kernel)] += JITTER * theta[-2]
        return cholesky(kernel, lower=True)

    def _condition(
        self, component: int, theta: Array
    ) -> tuple[SparsePosterior, list[Array], Array, float]:
        """Return the posterior, blocks of A, whitened weights and the value of the bound."""
        length, signal = theta[:-2], float(theta[-2])
        root = self._root(theta)
        noise, target = self._noise(component, theta), self._t[:, component]
        inner, both = np.eye(len(root)), np.zeros((len(root), 2))
        blocks, explained = [], 0.0
        for k in range(0, len(self._x), _BLOCK):
            rows = slice(k, k + _BLOCK)
            cross = signal * correlation(
                self._kernel, scaled_squares(self._z, self._x[rows], length)
            )
            block = solve_triangular(root, cross, lower=True, overwrite_b=True)
            weighted = block / noise[rows]
            inner += weighted @ block.T
            both += weighted @ np.column_stack([np.ones(block.shape[1]), target[rows]])
            explained += float((block * weighted).sum())
            blocks.append(block)
        factor = cholesky(inner, lower=True)
        solved = cho_solve((factor, True), both)
        one, cross_one = 1.0 / noise, target / noise
        gram = both.T @ solved
        mean = float((cross_one.sum() - gram[0, 1]) / (one.sum() - gram[0, 0]))
        white = solved[:, 1] - mean * solved[:, 0]
        rest = target - mean
        quadratic = float((rest**2 / noise).sum() - (both[:, 1] - mean * both[:, 0]) @ white)
        value = 0.5 * (
            2 * np.log(np.diag(factor)).sum()
            + np.log(noise).sum()
            + quadratic
            + (signal / noise).sum()
            - explained
            + len(rest) * math.log(2 * math.pi)
        )
        weights = solve_triangular(root, white, lower=True, trans="T")
        return SparsePosterior(mean, weights, root, factor), blocks, white, float(value)

    def _one(self, component: int, theta: Array) -> tuple[float, Array, float]:
        length, signal = theta[:-2], float(theta[-2])
        gradient = np.zeros(len(theta))
        try:
            posterior, blocks, white, value = self._condition(component, theta)
        except (LinAlgError, ValueError):
            return math.inf, gradient, 0.0
        root, noise = posterior.root, self._noise(component, theta)
        rest = self._t[:, component] - posterior.mean
        unit = np.eye(len(root))
        inverse = cho_solve((posterior.inner, True), unit)
        for k, block in enumerate(blocks):
            rows = slice(k * _BLOCK, (k + 1) * _BLOCK)
            size, error = noise[rows], rest[rows] - block.T @ white
            moved = inverse @ block
            # by the noise of each sample
            spread = signal - (block**2).sum(axis=0)
            by_noise = size - (moved * block).sum(axis=0) - error**2 - spread
            gradient[-1] += 0.5 * theta[-1] * float((by_noise / size**2).sum())
            gradient[-2] += 0.5 * signal * float((1.0 / size).sum())
            # by the covariances with the inducing points
            change = (moved - block - white[:, None] * error) / size
            change = solve_triangular(root, change, lower=True, trans="T", overwrite_b=True)
            self._add(gradient, change, self._x[rows], length, signal)
        inner = posterior.inner @ posterior.inner.T
        change = 0.5 * (inverse + inner - 2 * unit + np.outer(white, white))
        half = solve_triangular(root, change, lower=True, trans="T")
        change = solve_triangular(root, half.T, lower=True, trans="T")
        self._add(gradient, change, self._z, length, signal)
        gradient[-2] += JITTER * signal * float(np.trace(change))
        return value, gradient, posterior.mean

    def _add(self, gradient: Array, change: Array, x: Array, length: Array, signal: float) -> None:
        """Add the derivatives by lengthscales and signal, given those by the covariances."""
        scaled = scaled_squares(self._z, x, length)
        gradient[-2] += signal * float((change * correlation(self._kernel, scaled)).sum())
        slope = change * steepness(self._kernel, scaled)
        if len(length) == 1:
            gradient[0] += signal * float((slope * scaled).sum())
            return
        for j, size in enumerate(length):
            square = ((self._z[:, None, j] - x[None, :, j]) / size) ** 2
            gradient[j] += signal * float((slope * square).sum())
