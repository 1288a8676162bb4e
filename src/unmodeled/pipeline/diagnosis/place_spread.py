"""How far a parameter moves over the places where an effect fits nearly as well."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore

__all__ = ["place_spread"]


def place_spread(
    pool: Pool, chosen: SetScore, member: int, candidate: Candidate, values: dict[str, float]
) -> dict[str, float]:
    """Return the spread of a finding's parameters over the places that were searched.

    A fit knows how sure its amplitude is where it ended. Elsewhere (a mass at another longitude, a
    manoeuvre at another time) the effect may fit nearly as well with another amplitude: each place
    counts with its likelihood, and the root mean square distance from the fitted values is the
    part of the uncertainty that the fit does not know.

    Parameters
    ----------
    pool : Pool
        About the final fit.
    chosen : SetScore
        The answer.
    member : int
        The finding.
    candidate : Candidate
        With its places; without any the answer is empty.
    values : dict of str to float
        The fitted parameters.

    Returns
    -------
    dict
        One standard deviation of each estimated and each searched parameter.
    """
    if not candidate.places:
        return {}
    rest = [m for m in chosen.members if m != member]
    known = pool.columns[:, pool.index(rest)]
    residual = _without(pool.residual, known)
    drops, found = [], []
    for place, raw in zip(candidate.places, pool.lin.candidate_columns(candidate), strict=True):
        columns = _without(pool.lin.project(raw * np.array(candidate.priors)), known)
        theta = np.linalg.lstsq(columns, residual, rcond=1e-10)[0]
        drops.append(float(residual @ columns @ theta) / chosen.noise**2)
        null = [candidate.values[n] for n in candidate.estimate]
        at = np.array(null) + theta * np.array(candidate.priors)
        found.append([*at, *(place[n] for n in candidate.searched)])
    names = (*candidate.estimate, *candidate.searched)
    weights = np.exp(0.5 * (np.array(drops) - max(drops)))
    off = np.array(found) - np.array([values[n] for n in names])
    mean_square = weights @ off**2 / weights.sum()
    # The place of the fit itself is between those of the grid: half a step off is no uncertainty.
    best = off[int(np.argmax(drops))] ** 2
    spread = np.sqrt(np.maximum(mean_square - best, 0.0))
    return dict(zip(names, map(float, spread), strict=True))


def _without(columns: Array, known: Array) -> Array:
    """Return what other columns cannot explain."""
    if not known.shape[1]:
        return columns
    left: Array = columns - known @ np.linalg.lstsq(known, columns, rcond=1e-10)[0]
    return left
