"""Skill on what was left out: whole stretches of time, predicted from the rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.residual_table import Index
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["left_out_errors", "skill_and_error", "stretches"]

#: Parts of each arc that are held out in turn: at least two, about this many of all arcs.
_PARTS = 8


def stretches(lin: Linearisation) -> Iterator[Index]:
    """Yield rows that are held out together: stretches of time of one arc."""
    rows = lin.rows()
    times, arcs = rows["t_s"].to_numpy(), rows["arc"].to_numpy()
    each = max(int(np.ceil(_PARTS / len(lin.arcs))), 2)
    for arc in dict.fromkeys(arcs):
        at = np.flatnonzero(arcs == arc)
        order = at[np.argsort(times[at], kind="stable")]
        yield from (np.sort(p) for p in np.array_split(order, each) if len(p))


def left_out_errors(known: Array, columns: Array, residual: Array, parts: Sequence[Index]) -> Array:
    """Return sums of squares (b,) of the errors of parts, each predicted from the rest.

    Parameters
    ----------
    known : ndarray (n, k)
        Of `known_basis`.
    columns : ndarray (n, q)
        Of a family, scaled by their posterior and orthogonal to ``known``.
    residual : ndarray (n,)
        Projected.
    parts : sequence of ndarray of int
        Of `stretches`.

    Notes
    -----
    With P = I - U U' the matrix that leaves residuals (U: known columns and the family's), the
    error of a left-out part b is (P_bb)^-1 (P r)_b.
    """
    U = np.concatenate([known, columns], axis=1)
    left = residual - U @ (U.T @ residual)
    errors = []
    for part in parts:
        own = U[part]
        core = np.eye(U.shape[1]) - own.T @ own
        size, axes = np.linalg.eigh(core)
        # A direction that only this part determines is not predicted at all: left as it is.
        kept = size > 1e-9
        lift = own @ axes[:, kept]
        error = left[part] + lift @ ((lift.T @ left[part]) / size[kept])
        errors.append(float(error @ error))
    return np.array(errors)


def skill_and_error(errors: Array, nothing: Array) -> tuple[float, float]:
    """Return the share of the left-out sum of squares that is explained, and its standard error.

    Parameters
    ----------
    errors, nothing : ndarray (b,)
        Sums of squares of each part with a model and with none.

    Notes
    -----
    Jackknife over the parts ([Efron1981]): what is correlated within a stretch counts
    once.

    Examples
    --------
    >>> skill_and_error(np.array([1.0, 1.0]), np.array([4.0, 4.0]))
    (0.75, 0.0)
    """
    skill = 1.0 - float(errors.sum() / nothing.sum())
    b = len(errors)
    if b < 2:
        return skill, float("inf")
    without = 1.0 - (errors.sum() - errors) / (nothing.sum() - nothing)
    return skill, float(np.sqrt((b - 1) / b * np.sum((without - without.mean()) ** 2)))
