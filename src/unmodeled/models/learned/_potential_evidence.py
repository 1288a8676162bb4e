"""Weights by Levenberg-Marquardt, the strengths of prior and penalty by the evidence.

The unknowns v minimise
    beta |W (t - a(v))|^2 + lambda |L(v)|^2 + alpha_1 |v_1 - c_1|^2 + alpha_2 |v_2 - c_2|^2,
with a the accelerations, W the roots of their weights, L the Laplacian all around, v_1 the hidden
weights about their start and v_2 the output weights about zero, each in units of its scale. After
every step beta, lambda and the alphas are re-estimated from the evidence of the linearised problem
[MacKay1992]. The penalty belongs to the prior, whose precision is
K = diag(alpha) + lambda L'L: counted as if zeros had been measured, several hundred of them, it
would drown a few hundred samples and be as weak as the fit of the zeros allows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.learned._potential_field import PotentialField
from unmodeled.models.learned._potential_prior import Prior, Strengths, Sums, factor, re_estimate

__all__ = ["Data", "improve", "normal_equations"]

#: Points whose slopes are in memory at once.
_CHUNK = 1024
#: Steps before strengths are estimated for the first time.
_WARM_UP = 2
#: Steps tried with more and more damping before the step counts as failed.
_TRIALS = 8
#: Relative change of the objective and of the strengths below which a fit has settled.
_SETTLED = 1e-4


@dataclass(frozen=True)
class Data:
    """Samples: dimensionless positions and accelerations (n, 3), roots (n, 3, 3) of weights."""

    x: Array
    target: Array
    root: Array


def improve(
    field: PotentialField,
    data: Data,
    prior: Prior,
    start: tuple[Array, Strengths],
    steps: int,
    tell: Callable[[float], None],
    floor: float,
) -> tuple[Array, Strengths]:
    """Return unknowns and strengths after at most ``steps`` steps.

    Parameters
    ----------
    field, data, prior
        What is fitted.
    start : (ndarray (p,), Strengths)
        Where to begin.
    steps : int
        At most.
    tell : callable
        Told the share done.
    floor : float
        Least noise, in units of the whitened residuals.

    Raises
    ------
    NumericalError
        If the objective is not finite.
    """
    unknowns, strengths = start
    damping = 1e-2
    sums = _sums(field, data, prior, unknowns)
    for k in range(steps):
        A, b, AL, bL = normal_equations(field, data, prior, unknowns)
        diagonal = prior.diagonal(strengths)
        offset = (unknowns - prior.centre) / prior.scale
        matrix = strengths.data * A + strengths.laplace * AL + np.diag(diagonal)
        downhill = strengths.data * b + strengths.laplace * bL - diagonal * offset
        before = sums.objective(prior, strengths)
        if not (math.isfinite(before) and np.isfinite(matrix).all()):
            raise NumericalError(
                f"the misfit of {len(data.x)} samples is not finite",
                do="look for samples at the origin, or for accelerations out of all proportion",
            )
        gain = 0.0
        for _ in range(_TRIALS):
            step = _solve(matrix + damping * np.diag(np.diag(matrix)), downhill)
            tried = prior.project(unknowns + prior.scale * step)
            new = _sums(field, data, prior, tried)
            gain = before - new.objective(prior, strengths)
            if gain > 0:
                unknowns, sums, damping = tried, new, max(damping / 5.0, 1e-9)
                break
            damping = min(damping * 8.0, 1e8)
        settled = gain <= _SETTLED * before
        if k >= _WARM_UP:
            old = strengths
            strengths = re_estimate(3 * len(data.x), prior, strengths, sums, A, AL, floor)
            pairs = zip(vars(old).values(), vars(strengths).values(), strict=True)
            if settled and all(abs(a - b) <= 10 * _SETTLED * a for a, b in pairs):
                break
        tell((k + 1) / steps)
    tell(1.0)
    return unknowns, strengths


def _sums(field: PotentialField, data: Data, prior: Prior, unknowns: Array) -> Sums:
    misfit = data.target - field.acceleration(data.x, unknowns)
    whitened = (data.root @ misfit[:, :, None]).ravel()
    uneven = field.laplacian(prior.points, unknowns) if len(prior.points) else np.zeros(1)
    d = ((unknowns - prior.centre) / prior.scale) ** 2
    inner = d[1 : prior.hidden + 1]
    outer = d[prior.hidden + 1 :]
    return Sums(
        float(whitened @ whitened),
        float(uneven @ uneven),
        float(d[0]),
        float(inner.sum()),
        float(outer.sum()),
    )


def normal_equations(
    field: PotentialField, data: Data, prior: Prior, unknowns: Array
) -> tuple[Array, Array, Array, Array]:
    """Return J'J and J'r of the data, and of the penalty, for scaled unknowns."""
    p = len(unknowns)
    A, b = np.zeros((p, p)), np.zeros(p)
    for k in range(0, len(data.x), _CHUNK):
        rows = slice(k, k + _CHUNK)
        value, slopes = field.slopes(data.x[rows], unknowns)
        J = (data.root[rows] @ slopes).reshape(-1, p) * prior.scale
        r = (data.root[rows] @ (data.target[rows] - value)[:, :, None]).ravel()
        A += J.T @ J
        b += J.T @ r
    AL, bL = np.zeros((p, p)), np.zeros(p)
    if len(prior.points):
        uneven, J = field.laplacian_slopes(prior.points, unknowns)
        J = J * prior.scale
        AL, bL = J.T @ J, -J.T @ uneven
    return A, b, AL, bL


def _solve(matrix: Array, right: Array) -> Array:
    return np.asarray(scipy.linalg.cho_solve((factor(matrix), True), right))
