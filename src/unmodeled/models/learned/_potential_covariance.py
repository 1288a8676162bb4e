"""Covariance of the unknowns: linearised about the fit, averaged over the strengths.

At one set of strengths the covariance is the inverse of the curvature (Laplace's approximation).
Where samples say little of how strong penalty and priors are, that is too narrow. So the strengths
are averaged over, too: their logarithms are normal about the estimate, the curvature of their log
evidence and prior is the precision, and at the points of a cubature rule the fit is moved by one
linear step and its covariance taken again. The mean of those covariances and the spread of the
moved fits add up.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.models.learned._potential_evidence import Data, normal_equations
from unmodeled.models.learned._potential_field import PotentialField
from unmodeled.models.learned._potential_prior import SHAPE, Prior, Strengths, factor

__all__ = ["covariance_root", "strengths_precision"]


def covariance_root(
    field: PotentialField, data: Data, prior: Prior, unknowns: Array, strengths: Strengths
) -> Array:
    """Return R (p, p) with R R' the covariance of the unknowns.

    Parameters
    ----------
    field, data, prior
        What was fitted.
    unknowns : ndarray (p,)
        The fit.
    strengths : Strengths
        Found with it.
    """
    A, b, AL, bL = normal_equations(field, data, prior, unknowns)
    offset = (unknowns - prior.centre) / prior.scale
    names = [name for name in ("laplace", "hidden", "output") if getattr(strengths, name) > 0]
    precision = strengths_precision(prior, strengths, A, AL, bL, offset, names)
    values, axes = np.linalg.eigh(precision)
    # What is left below the prior's own curvature is no knowledge, and may be negative.
    reach = axes * np.sqrt(len(names) / np.maximum(values, SHAPE))
    rows = []
    for move in np.concatenate([reach.T, -reach.T]):
        moved = {n: getattr(strengths, n) * np.exp(m) for n, m in zip(names, move, strict=True)}
        s = replace(strengths, **moved)
        diagonal = prior.diagonal(s)
        lower = factor(s.data * A + s.laplace * AL + np.diag(diagonal))
        inverse = scipy.linalg.solve_triangular(lower, np.eye(len(lower)), lower=True)
        downhill = s.data * b + s.laplace * bL - diagonal * offset
        rows += [inverse, (inverse.T @ (inverse @ downhill))[None]]
    stacked = np.concatenate(rows) / np.sqrt(2 * len(names))
    upper = np.asarray(np.linalg.qr(stacked, mode="r"))
    return np.ascontiguousarray(prior.scale[:, None] * upper.T)


def strengths_precision(
    prior: Prior,
    strengths: Strengths,
    A: Array,
    AL: Array,
    bL: Array,
    offset: Array,
    names: list[str],
) -> Array:
    """Return minus the second derivatives (k, k) of the log evidence by logarithms of strengths.

    At the estimate, where the first derivatives vanish; the gamma prior of the strengths included.

    Parameters
    ----------
    prior, strengths
        The prior, and the strengths found.
    A, AL : ndarray (p, p)
        J'J of data and penalty for scaled unknowns.
    bL : ndarray (p,)
        -J'L of the penalty.
    offset : ndarray (p,)
        Scaled unknowns beyond the centre of the prior.
    names : list of str
        Which strengths.
    """
    before = strengths.laplace * AL + np.diag(prior.diagonal(strengths))
    after = before + strengths.data * A
    kinds = np.repeat(["", "hidden", "output"], prior.counts)
    parts, pulls = [], []
    for name in names:
        if name == "laplace":
            part, pull = strengths.laplace * AL, -strengths.laplace * bL
        else:
            share = getattr(strengths, name) * (kinds == name)
            part, pull = np.diag(share), share * offset
        parts.append((_divided(before, part), _divided(after, part)))
        pulls.append(pull)
    found = SHAPE * np.eye(len(names))
    for i, (free, held) in enumerate(parts):
        for j, (other_free, other_held) in enumerate(parts):
            volume = 0.5 * float((free * other_free.T).sum() - (held * other_held.T).sum())
            found[i, j] += volume - float(pulls[i] @ _divided(after, pulls[j]))
    return 0.5 * (found + found.T)


def _divided(matrix: Array, right: Array) -> Array:
    return np.asarray(scipy.linalg.cho_solve((factor(matrix), True), right))
