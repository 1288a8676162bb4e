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

__all__ = ["Data", "Prior", "Strengths", "covariance_root", "improve", "usual_strengths"]

#: Points whose slopes are in memory at once.
_CHUNK = 1024
#: Largest change of a strength in one step, as a factor.
_STRIDE = 4.0
#: Gamma prior of lambda and the alphas: shape, and mean in the order hidden, output, Laplacian.
#: Without it the evidence of noisy samples switches the network off, and the band with it (it held
#: 45 % at sigma_a = 1). An output of 100 lets N be 0.02 (root mean square over the shell), about
#: what small bodies are; a Laplacian of 1e4 allows 0.01 where a free network of that size has 0.08.
_SHAPE, _HIDDEN, _OUTPUT, _LAPLACE = 2.0, 1.0, 100.0, 1e4
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


@dataclass(frozen=True)
class Prior:
    """Prior of the unknowns and where the Laplacian is penalised.

    Parameters
    ----------
    centre, scale : ndarray (p,)
        Unknowns where the prior is highest, and their units.
    mass_precision : float
        Of the mass, fixed; nearly zero if nothing is known of it.
    hidden : int
        Number of hidden weights, which follow the mass.
    points : ndarray (m, 3)
        Where the Laplacian is penalised; none for no penalty.
    project : callable
        Applied to unknowns after each step: the bound on spectral norms.
    """

    centre: Array
    scale: Array
    mass_precision: float
    hidden: int
    points: Array
    project: Callable[[Array], Array]

    def diagonal(self, strengths: Strengths) -> Array:
        """Precisions (p,) of scaled unknowns, without the penalty."""
        rest = len(self.centre) - 1 - self.hidden
        counts = [1, self.hidden, rest]
        return np.repeat([self.mass_precision, strengths.hidden, strengths.output], counts)


@dataclass(frozen=True)
class Strengths:
    """beta, lambda and the two alphas."""

    data: float
    laplace: float
    hidden: float
    output: float


def usual_strengths(harmonic: bool) -> Strengths:
    """Return the strengths before any sample is seen, with or without the penalty."""
    return Strengths(1.0, _LAPLACE if harmonic else 0.0, _HIDDEN, _OUTPUT)


@dataclass(frozen=True)
class _Sums:
    """Squares of data and penalty, and of the scaled unknowns of either kind."""

    data: float
    laplace: float
    mass: float
    hidden: float
    output: float

    def objective(self, prior: Prior, s: Strengths) -> float:
        own = prior.mass_precision * self.mass + s.hidden * self.hidden + s.output * self.output
        return s.data * self.data + s.laplace * self.laplace + own


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
        A, b, AL, bL = _normal(field, data, prior, unknowns)
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
            strengths = _strengths(data, prior, strengths, sums, A, AL, floor)
            pairs = zip(vars(old).values(), vars(strengths).values(), strict=True)
            if settled and all(abs(a - b) <= 10 * _SETTLED * a for a, b in pairs):
                break
        tell((k + 1) / steps)
    tell(1.0)
    return unknowns, strengths


def covariance_root(
    field: PotentialField, data: Data, prior: Prior, unknowns: Array, strengths: Strengths
) -> Array:
    """Return R (p, p) with R R' the covariance of the unknowns, linearised about them."""
    A, _, AL, _ = _normal(field, data, prior, unknowns)
    matrix = strengths.data * A + strengths.laplace * AL + np.diag(prior.diagonal(strengths))
    lower = _factor(matrix)
    inverse = scipy.linalg.solve_triangular(lower, np.eye(len(matrix)), lower=True)
    return np.ascontiguousarray(prior.scale[:, None] * inverse.T)


def _strengths(
    data: Data, prior: Prior, old: Strengths, sums: _Sums, A: Array, AL: Array, floor: float
) -> Strengths:
    """Return the strengths at which the evidence of the linearised problem is stationary."""
    posterior = _inverse(
        old.data * A + old.laplace * AL + np.diag(prior.diagonal(old)),
    )
    before = _inverse(old.laplace * AL + np.diag(prior.diagonal(old)))
    gained = before - posterior  # what the data say beyond the prior
    count = 3.0 * len(data.x)
    freedom = old.data * float((posterior * A).sum())
    beta = max(count - freedom, 1e-3 * count) / max(sums.data, 1e-300)
    known = np.diag(gained)[1:]
    groups = (known[: prior.hidden], known[prior.hidden :])
    hidden, output = (
        _estimate(precision * float(group.sum()), square, usual, precision)
        for precision, group, square, usual in zip(
            (old.hidden, old.output),
            groups,
            (sums.hidden, sums.output),
            (_HIDDEN, _OUTPUT),
            strict=True,
        )
    )
    laplace = old.laplace
    if laplace:
        freedom = laplace * float((gained * AL).sum())
        laplace = _estimate(freedom, sums.laplace, _LAPLACE, laplace)
    return Strengths(_held(min(beta, floor**-2), old.data), laplace, hidden, output)


def _estimate(freedom: float, square: float, usual: float, old: float) -> float:
    """Return a strength from what the data determine and the squares, with its gamma prior."""
    return _held((max(freedom, 0.0) + 2 * _SHAPE) / (square + 2 * _SHAPE / usual), old)


def _held(value: float, old: float) -> float:
    return min(max(value, old / _STRIDE), old * _STRIDE)


def _sums(field: PotentialField, data: Data, prior: Prior, unknowns: Array) -> _Sums:
    misfit = data.target - field.acceleration(data.x, unknowns)
    whitened = (data.root @ misfit[:, :, None]).ravel()
    uneven = field.laplacian(prior.points, unknowns) if len(prior.points) else np.zeros(1)
    d = ((unknowns - prior.centre) / prior.scale) ** 2
    inner = d[1 : prior.hidden + 1]
    outer = d[prior.hidden + 1 :]
    return _Sums(
        float(whitened @ whitened),
        float(uneven @ uneven),
        float(d[0]),
        float(inner.sum()),
        float(outer.sum()),
    )


def _normal(
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


def _factor(matrix: Array) -> Array:
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)
    except np.linalg.LinAlgError as exc:
        raise NumericalError(
            f"the normal equations of {len(matrix)} weights are singular to working precision",
            do="use fewer hidden units, or give the noise of the samples",
        ) from exc


def _solve(matrix: Array, right: Array) -> Array:
    return np.asarray(scipy.linalg.cho_solve((_factor(matrix), True), right))


def _inverse(matrix: Array) -> Array:
    inverse, info = scipy.linalg.lapack.dpotri(_factor(matrix), lower=1)
    assert info == 0
    return np.asarray(np.tril(inverse) + np.tril(inverse, -1).T)
