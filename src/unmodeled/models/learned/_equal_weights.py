"""Bayesian linear regression where some weights are free and the others share one prior."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError

__all__ = ["EqualWeights", "fit_equal_weights"]

#: Logarithms of (amplitude x largest singular value / noise) squared that are tried.
_RATIOS = np.linspace(math.log(1e-12), math.log(1e34), 425)


@dataclass(frozen=True)
class EqualWeights:
    """Posterior of the weights.

    Parameters
    ----------
    mean : ndarray (p,)
    root : ndarray (p, p)
        The covariance is ``root @ root.T``.
    amplitude, noise : float
        Prior standard deviation of the weights that are not free; of the weighted noise.
    log_evidence : float
        With the free weights integrated out.
    """

    mean: Array
    root: Array
    amplitude: float
    noise: float
    log_evidence: float


def fit_equal_weights(
    chunks: Iterator[Array], free: int, largest: float, log_weight: float
) -> EqualWeights:
    """Maximise the evidence over amplitude, up to ``largest``, and noise.

    Parameters
    ----------
    chunks : iterator of ndarray (m, p + 1)
        Weighted equations: the design, ``free`` columns first, and the data in the last column.
    free : int
        Columns with a flat prior.
    largest : float
        Upper bound of the amplitude.
    log_weight : float
        Sum of the logarithms of the weights.
    """
    triangle, count = _triangle(chunks)
    p = triangle.shape[1] - 1
    design, target = triangle[:p, :p], triangle[:p, p]
    pivots = np.abs(np.diag(design)[:free])
    if len(design) < free or pivots.min() <= 1e-13 * pivots.max():
        raise NumericalError(
            "the samples do not determine mass and centre of mass",
            do="use samples from more than one direction",
        )
    u, s, _ = np.linalg.svd(design[free:, free:], full_matrices=False)
    along = u.T @ target[free:]
    # What no weight reaches: of data fewer than weights nothing.
    beyond = float(((target[free:] - u @ along) ** 2).sum()) + float((triangle[p:, p] ** 2).sum())
    freedom = count - free
    # Data are rounded: no noise is smaller than that.
    floor = (np.finfo(float).eps * math.sqrt(float((triangle[:, p] ** 2).sum()) / count)) ** 2

    def evidence(log_ratio: float) -> tuple[float, float]:
        gain = math.exp(log_ratio) * s**2
        left = beyond + float((along**2 / (1.0 + gain)).sum())
        variance = max(left / freedom, floor)
        value = freedom * math.log(2.0 * math.pi * variance) + left / variance
        value += float(np.log1p(gain).sum())
        return -0.5 * value, variance

    # For a ratio of the two the best noise has a closed form; ratios beyond the bound are left out.
    scale = math.log(max(float(s[0]) ** 2, 1e-300)) if len(s) else 0.0
    found = [(*evidence(ratio), ratio) for ratio in _RATIOS - scale]
    amplitudes = [math.exp(0.5 * ratio) * math.sqrt(variance) for _, variance, ratio in found]
    allowed = [k for k, amplitude in enumerate(amplitudes) if amplitude <= largest]
    best = max(allowed or [int(np.argmin(amplitudes))], key=lambda k: found[k][0])
    value, noise2, _ = found[best]
    amplitude = min(amplitudes[best], largest)
    mean, root = _solve(design, target, free, amplitude, math.sqrt(noise2))
    value += log_weight - float(np.log(pivots).sum())  # the free weights, integrated out
    return EqualWeights(mean, root, amplitude, math.sqrt(noise2), value)


def _triangle(chunks: Iterator[Array]) -> tuple[Array, int]:
    """Return the triangle of the QR decomposition of all equations, and their number."""
    root, count = None, 0
    for rows in chunks:
        count += len(rows)
        stacked = rows if root is None else np.concatenate([root, rows])
        root = scipy.linalg.qr(stacked, mode="r", check_finite=False)[0]
        root = np.triu(root[: root.shape[1]])
    if root is None or not np.isfinite(root).all():
        raise NumericalError("the equations of the samples are not finite")
    return np.asarray(root, dtype=np.float64), count


def _solve(
    design: Array, target: Array, free: int, amplitude: float, noise: float
) -> tuple[Array, Array]:
    p = design.shape[1]
    unit = np.full(p, amplitude)
    unit[:free] = noise / np.linalg.norm(design[:, :free], axis=0)
    stacked = np.concatenate([design * unit, noise * np.eye(p)[free:]])
    q, r = scipy.linalg.qr(stacked, mode="economic")
    rhs = np.concatenate([target, np.zeros(p - free)])
    mean = unit * scipy.linalg.solve_triangular(r, q.T @ rhs)
    inverse = scipy.linalg.solve_triangular(r, np.eye(p))
    return np.ascontiguousarray(mean), np.ascontiguousarray(noise * unit[:, None] * inverse)
