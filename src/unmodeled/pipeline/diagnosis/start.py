"""Where an exact fit starts, and what it estimates: from the linear answer and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.result import Estimate
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["Chosen", "chosen_values", "estimates_of", "place_of", "with_set"]

#: Candidates with values of all their parameters.
Chosen = list[tuple[Candidate, dict[str, float]]]


def chosen_values(pool: Pool, chosen: SetScore) -> Chosen:
    """Return the candidates of a set at their linear estimates, kept inside their bounds."""
    found, first = [], 0
    for m in chosen.members:
        member = pool.members[m]
        candidate = member.candidate
        change = chosen.estimate[first : first + member.size] * np.array(candidate.priors)
        first += member.size
        values = dict(member.values)
        for parameter, size in zip(candidate.parameters, change, strict=True):
            value = candidate.values[parameter.name] + float(size)
            values[parameter.name] = float(np.clip(value, parameter.lower, parameter.upper))
        found.append((candidate, values))
    return found


def with_set(case: Case, pool: Pool, chosen: SetScore) -> Case:
    """Return a case with a set of effects, all of their parameters free.

    Parameters
    ----------
    case : Case
        Without the set.
    pool : Pool
        Its linearisation tells where the initial states are now.
    chosen : SetScore
        The set; states and parameters start at its linear answer.
    """
    arcs = tuple(
        replace(arc, state=arc.state + step)
        for arc, step in zip(pool.lin.case.arcs, pool.state_steps(chosen), strict=True)
    )
    model = replace(case, arcs=arcs)
    for candidate, values in chosen_values(pool, chosen):
        free: dict[str, float | None] = dict.fromkeys(candidate.estimate)
        free |= {name: candidate.reach(name) for name in candidate.searched}
        model = model.with_effect(candidate, values, free)
    return model


def estimates_of(
    candidate: Candidate, fit: OrbitFit, noise: float, spread: Mapping[str, float] | None = None
) -> tuple[Estimate, ...]:
    """Return what a fit says of a candidate's parameters.

    Sigmas are the fit's times ``noise``, and the ``spread`` of each parameter over other places.
    """
    found = []
    for parameter, prior in zip(candidate.parameters, candidate.priors, strict=True):
        name = parameter.name
        value, sigma = _value(name, fit, noise, spread)
        accepted = pull = None
        if name in candidate.known:
            accepted, own = candidate.known[name]
            pull = (value - accepted) / float(np.hypot(sigma, own))
        found.append(Estimate(name, value, sigma, parameter.unit, float(prior), accepted, pull))
    return tuple(found)


def place_of(
    candidate: Candidate, fit: OrbitFit, noise: float, spread: Mapping[str, float]
) -> tuple[Estimate, ...]:
    """Return where or when an effect that was searched over places acts.

    The expected size of each is the step of the search.
    """
    units = {p.name: p.unit for p in candidate.effect.parameters}
    return tuple(
        Estimate(n, *_value(n, fit, noise, spread), units[n], candidate.reach(n))
        for n in candidate.searched
    )


def _value(
    name: str, fit: OrbitFit, noise: float, spread: Mapping[str, float] | None
) -> tuple[float, float]:
    sigma = float(np.hypot(fit.sigmas[name] * noise, (spread or {}).get(name, 0.0)))
    return float(fit.values[name]), sigma
