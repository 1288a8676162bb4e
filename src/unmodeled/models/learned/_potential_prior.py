"""Prior of a network of the potential, and how strong the evidence makes its parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError

__all__ = ["SHAPE", "Prior", "Strengths", "Sums", "factor", "re_estimate", "usual_strengths"]

#: Largest change of a strength in one step, as a factor.
_STRIDE = 4.0
#: Gamma prior of lambda and the alphas: shape, and mean in the order hidden, output, Laplacian.
#: Without it the evidence of noisy samples switches the network off, and the band with it (it held
#: 45 % at sigma_a = 1). The Laplacian counts for as much as the output: of a free network with an
#: output of 100, N is 0.07 (root mean square over the shell), of a penalised one 0.007, with
#: coefficients of degree two of 0.0017. Small bodies have 0.009 (Bennu) to 0.06.
SHAPE, _HIDDEN, _OUTPUT, _LAPLACE = 2.0, 1.0, 100.0, 1e4


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
        own = [self.mass_precision, strengths.hidden, strengths.output]
        return np.repeat(own, self.counts)

    @property
    def counts(self) -> list[int]:
        """Number of unknowns of each kind: the mass, hidden and output weights."""
        return [1, self.hidden, len(self.centre) - 1 - self.hidden]


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
class Sums:
    """Squares of data and penalty, and of the scaled unknowns of either kind."""

    data: float
    laplace: float
    mass: float
    hidden: float
    output: float

    def objective(self, prior: Prior, s: Strengths) -> float:
        own = prior.mass_precision * self.mass + s.hidden * self.hidden + s.output * self.output
        return s.data * self.data + s.laplace * self.laplace + own


def re_estimate(
    count: int, prior: Prior, old: Strengths, sums: Sums, A: Array, AL: Array, floor: float
) -> Strengths:
    """Return the strengths at which the evidence of the linearised problem is stationary.

    Parameters
    ----------
    count : int
        Number of residuals of the data.
    prior, old, sums
        The prior, the strengths so far, and the squares at the present unknowns.
    A, AL : ndarray (p, p)
        J'J of data and penalty for scaled unknowns.
    floor : float
        Least noise, in units of the whitened residuals.
    """
    posterior = _inverse(
        old.data * A + old.laplace * AL + np.diag(prior.diagonal(old)),
    )
    before = _inverse(old.laplace * AL + np.diag(prior.diagonal(old)))
    gained = before - posterior  # what the data say beyond the prior
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
    return _held((max(freedom, 0.0) + 2 * SHAPE) / (square + 2 * SHAPE / usual), old)


def _held(value: float, old: float) -> float:
    return min(max(value, old / _STRIDE), old * _STRIDE)


def factor(matrix: Array) -> Array:
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)
    except np.linalg.LinAlgError as exc:
        raise NumericalError(
            f"the normal equations of {len(matrix)} weights are singular to working precision",
            do="use fewer hidden units, or give the noise of the samples",
        ) from exc


def _inverse(matrix: Array) -> Array:
    inverse, info = scipy.linalg.lapack.dpotri(factor(matrix), lower=1)
    assert info == 0
    return np.asarray(np.tril(inverse) + np.tril(inverse, -1).T)
