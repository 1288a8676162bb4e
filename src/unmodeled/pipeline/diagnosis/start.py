"""Where an exact fit starts, and what it estimates: from the linear answer and back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.result import Estimate
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["Chosen", "chosen_values", "estimates_of", "with_set"]

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


def estimates_of(candidate: Candidate, fit: OrbitFit, noise: float) -> tuple[Estimate, ...]:
    """Return what a fit says of a candidate's parameters; sigmas times ``noise``."""
    found = []
    for parameter, prior in zip(candidate.parameters, candidate.priors, strict=True):
        name = parameter.name
        value, sigma = float(fit.values[name]), float(fit.sigmas[name]) * noise
        accepted = pull = None
        if name in candidate.known:
            accepted, own = candidate.known[name]
            pull = (value - accepted) / float(np.hypot(sigma, own))
        found.append(Estimate(name, value, sigma, parameter.unit, float(prior), accepted, pull))
    return tuple(found)
