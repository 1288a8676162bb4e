"""The loop: score, refit, score again, until what is left is noise."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from unmodeled.core.errors import DataError, NumericalError, OrbitError
from unmodeled.core.seeds import Streams
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.comparison.whiteness import is_coloured, whiteness
from unmodeled.pipeline.diagnosis.alternatives import other_sets
from unmodeled.pipeline.diagnosis.describe import describe_candidates, describe_finding
from unmodeled.pipeline.diagnosis.further_data import further_data
from unmodeled.pipeline.diagnosis.held_out import held_out_forecast, held_out_rms
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.remainder import Remainder, remainder_of
from unmodeled.pipeline.diagnosis.remainder_model import learn_remainder
from unmodeled.pipeline.diagnosis.result import (
    Alternative,
    Diagnosis,
    Dismissed,
    Finding,
    Step,
    Verdict,
)
from unmodeled.pipeline.diagnosis.search import MARGIN, best_set, pruned
from unmodeled.pipeline.diagnosis.start import Chosen, chosen_values, with_set
from unmodeled.pipeline.diagnosis.stretches import DOUBTFUL, strength_by_stretches
from unmodeled.pipeline.diagnosis.threshold import smallest_p_threshold
from unmodeled.pipeline.linearisation import Linearisation
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["diagnose"]

#: Residuals above this many sigmas: the linear picture is rough, effects are added one by one.
_ROUGH = 3.0
#: A rival by linear score is refitted if it explains this share of what the best explains.
_NEAR = 0.8
_RIVALS = 3
#: An exchange must lower chi-square by this much in the exact fit, in units of the noise, or by
#: what the linear picture promised less as much (fewer effects may fit a little worse).
_GAIN = 2.0
#: Fits on the way stop when chi-square falls by less than this.
_SETTLED = 1e-3

Progress = Callable[[str, float], None]


def diagnose(case: Case, *, most: int = 5, progress: Progress | None = None) -> Diagnosis:
    """Say which effects a model lacks.

    Parameters
    ----------
    case : Case
        Model, measurements and candidates.
    most : int
        Largest number of effects to add.
    progress : callable, optional
        Called with a text and the share done.

    Returns
    -------
    Diagnosis

    Notes
    -----
    Every candidate's first-order signature is computed from one propagation; initial states and
    free parameters are projected out; the set of candidates with the most evidence whose members
    pass a threshold simulated for this very set of candidates is refitted without approximation;
    and again, until the set stays. Nothing empirical is estimated on the way: once-per-revolution
    terms would absorb most of what is looked for.

    Raises
    ------
    NumericalError
        If the model as given cannot be fitted.
    """
    begin = time.perf_counter()
    say = progress or (lambda text, share: None)
    say("fitting the model as given", 0.0)
    fit = case.fit(settled=_SETTLED)
    state = _State(case.at(fit), fit, {})
    first_fit = fit
    steps = [Step("", fit.rms_in_sigmas, held_out_rms(state.case))]
    limit, first_pool, tried = 0.0, None, [frozenset[str]()]
    pool, chosen, lin, banned = None, None, None, frozenset[str]()
    for turn in range(2 * most + 2):
        say(f"scoring {len(case.candidates)} candidates", (turn + 0.3) / (2 * most + 2))
        lin, pool, start = _linearised(case, state)
        if first_pool is None:
            first_pool = pool
            generator = Streams(case.seed).generator("diagnosis threshold")
            limit = smallest_p_threshold(pool, (), case.false_alarm, generator)
        room = most - len(start)
        growth = min(room, 1 if pool.score(()).noise > _ROUGH else 2)
        chosen = best_set(pool, start, limit, growth, banned)
        names = pool.names(chosen)
        if names == frozenset(state.accepted) or names in tried:
            # Settled. Another set may still be likelier, that no exchange of members leads to.
            chosen = pool.score(start)
            others = other_sets(pool, chosen, limit, banned)
            if not others or others[0].evidence <= chosen.evidence + MARGIN:
                break
            chosen, names = others[0], pool.names(others[0])
            if names in tried or len(names) > most:
                chosen = pool.score(start)
                break
        say("refitting", (turn + 0.7) / (2 * most + 2))
        fresh = _refit(case, state, pool, chosen)
        if fresh is None:
            # What cannot be fitted exactly is no answer; the next best may be.
            banned |= names - frozenset(state.accepted)
            chosen = pool.score(start)
            continue
        tried.append(frozenset(fresh.accepted))
        gained = (state.fit.cost - fresh.fit.cost) / chosen.noise**2
        promised = (chosen.drop - pool.score(start).drop) / chosen.noise**2
        if len(fresh.accepted) <= len(state.accepted) and gained < min(_GAIN, promised - _GAIN):
            # An exchange that the exact fit does not confirm: the search would go round in circles.
            chosen = pool.score(start)
            break
        added = ", ".join(sorted(set(fresh.accepted) - set(state.accepted)))
        gone = ", ".join(sorted(set(state.accepted) - set(fresh.accepted)))
        state = fresh
        label = added if not gone else f"{added or 'nothing'} for {gone}"
        steps.append(Step(label, state.fit.rms_in_sigmas, held_out_rms(state.case)))
    if pool is None or chosen is None or first_pool is None or lin is None:
        raise NumericalError("no turn was made")  # most is 0 or more: there is at least one
    kept = pruned(pool, chosen, limit)
    if len(kept.members) < len(chosen.members) and (last := _fitted(case, pool, kept)):
        # The exact fits moved on since a member was chosen: what no longer passes is taken out.
        steps.append(_taken_out(state, last))
        state = last
        lin, pool, start = _linearised(case, state)
        chosen = pool.score(start)
    dismissed: list[Dismissed] = []
    while True:
        say("testing what is left", 0.9)
        remainder, white = remainder_of(pool, chosen.members), whiteness(lin)
        coloured = remainder.is_there or is_coloured(white)
        doubt = _weakest(pool, chosen) if coloured else None
        if doubt is None:
            break
        # White noise is what the threshold supposes: under coloured residuals slow changes pass
        # it that are none of the catalogue's. What does not stand by stretches is taken out.
        member, dismissal = doubt
        kept = pool.score([m for m in chosen.members if m != member])
        last = _fitted(case, pool, kept)
        if last is None:
            break
        dismissed.append(dismissal)
        steps.append(_taken_out(state, last))
        state = last
        lin, pool, start = _linearised(case, state)
        chosen = pool.score(start)
    findings = tuple(
        describe_finding(case, pool, chosen, m, limit, state.fit, coloured=coloured)
        for m in sorted(chosen.members, key=lambda m: -_drop_without(pool, chosen, m))
    )
    sets = _alternatives(pool, chosen, findings, other_sets(pool, chosen, limit, banned))
    findings = tuple(_among(f, sets) for f in findings)
    nulls = {n: c.values[n] for c in case.candidates for n in c.estimate} | first_fit.values
    forecast = held_out_forecast(state.case, state.fit, nulls, chosen.noise)
    verdict = _verdict(findings, sets, remainder)
    rest = None
    if verdict == "outside the catalogue":
        say("learning what no effect explains", 0.9)
        rest = learn_remainder(Linearisation(state.case, state.fit))
    return Diagnosis(
        case=case,
        verdict=verdict,
        findings=findings,
        alternatives=sets,
        dismissed=tuple(dismissed),
        steps=tuple(steps),
        noise=chosen.noise,
        remainder_log10_p=remainder.log_p / np.log(10.0),
        within_stated_noise=remainder.is_there and not remainder.is_force,
        log_p_limit=limit,
        candidates=describe_candidates(first_pool, limit),
        further=further_data(state.case, findings, case.candidates),
        forecast=forecast,
        final_case=state.case,
        fit=first_fit,
        final_fit=state.fit,
        whiteness=white,
        remainder=rest,
        seconds=time.perf_counter() - begin,
    )


@dataclass(frozen=True)
class _State:
    """The model so far, its fit, and the parameters of what was added."""

    case: Case
    fit: OrbitFit
    accepted: Mapping[str, Mapping[str, float]]


def _linearised(case: Case, state: _State) -> tuple[Linearisation, Pool, list[int]]:
    """Return the linear picture about a state, all candidates in it, and which are in the model.

    Only what the case itself leaves free is projected out: what was added can be taken back.
    """
    lin = Linearisation(replace(state.case, estimate=case.estimate), state.fit)
    pool = Pool(lin, case.candidates, state.accepted)
    return lin, pool, [k for k, m in enumerate(pool.members) if m.candidate.name in state.accepted]


def _refit(case: Case, state: _State, pool: Pool, chosen: SetScore) -> _State | None:
    """Refit with the chosen set, or with a near rival of its newest member if that fits better."""
    options = [chosen]
    new = [m for m in chosen.members if pool.members[m].candidate.name not in state.accepted]
    if len(new) == 1 and pool.score(()).noise > _ROUGH:
        rest = [m for m in chosen.members if m != new[0]]
        drops, _ = pool.gains(rest)
        best = drops[new[0]]
        seen = {pool.members[m].candidate.name for m in chosen.members}
        for k in np.argsort(-drops):
            name = pool.members[k].candidate.name
            if name in seen or drops[k] < _NEAR * best or len(options) > _RIVALS:
                continue
            seen.add(name)
            options.append(pool.score((*rest, int(k))))
    results = [r for s in options if (r := _fitted(case, pool, s)) is not None]
    if not results:
        return None
    return min(results, key=lambda r: r.fit.cost)


def _fitted(case: Case, pool: Pool, chosen: SetScore) -> _State | None:
    model, members = with_set(case, pool, chosen), chosen_values(pool, chosen)
    fit = _fit_or_none(model) or _fit_or_none(_held(model, members))
    if fit is None:
        return None
    model = model.at(fit)
    now = {**model.dynamics.values, **model.instrument_values}
    accepted = {c.name: {k: now.get(k, v) for k, v in values.items()} for c, values in members}
    return _State(model, fit, accepted)


def _fit_or_none(model: Case) -> OrbitFit | None:
    try:
        return model.fit(settled=_SETTLED)
    except (NumericalError, OrbitError, DataError):
        return None


def _held(model: Case, members: Chosen) -> Case:
    """Hold what was added by its expected size: a part of it may be absorbed by the states."""
    free = dict(model.estimate)
    for candidate, values in members:
        for name, prior in zip(candidate.estimate, candidate.priors, strict=True):
            free[name] = max(prior, abs(values[name] - candidate.values[name]))
    return replace(model, estimate=free)


def _drop_without(pool: Pool, chosen: SetScore, member: int) -> float:
    return chosen.drop - pool.score([m for m in chosen.members if m != member]).drop


def _taken_out(before: _State, after: _State) -> Step:
    gone = ", ".join(sorted(set(before.accepted) - set(after.accepted)))
    return Step(f"nothing for {gone}", after.fit.rms_in_sigmas, held_out_rms(after.case))


def _weakest(pool: Pool, chosen: SetScore) -> tuple[int, Dismissed] | None:
    """Return the member that stands least by stretches of time, if it is doubtful."""
    strength = {m: strength_by_stretches(pool, chosen, m) for m in chosen.members}
    weakest = min(strength, key=lambda m: strength[m], default=None)
    if weakest is None or strength[weakest] >= DOUBTFUL:
        return None
    c = pool.members[weakest].candidate
    drop = _drop_without(pool, chosen, weakest)
    return weakest, Dismissed(c.name, c.title, drop, strength[weakest])


def _alternatives(
    pool: Pool, chosen: SetScore, findings: tuple[Finding, ...], sets: tuple[SetScore, ...]
) -> tuple[Alternative, ...]:
    """Return the sets that are more than an exchange of findings by their rivals."""
    found = []
    for s in sets:
        candidates = [pool.members[m].candidate for m in s.members]
        names = tuple(c.name for c in candidates)
        if len(names) == len(findings) and any(
            all(n in f.class_names for n, f in zip(order, findings, strict=True))
            for order in itertools.permutations(names)
        ):
            continue
        odds = float(np.exp(np.clip(chosen.evidence - s.evidence, -700.0, 700.0)))
        found.append(Alternative(names, tuple(c.title for c in candidates), odds, s.drop))
    return tuple(found)


def _among(finding: Finding, others: tuple[Alternative, ...]) -> Finding:
    """Return a finding whose confidence also counts the sets that do without it."""
    against = sum(1.0 / a.odds for a in others if finding.name not in a.effects)
    return replace(finding, confidence=1.0 / (1.0 / finding.confidence + against))


def _verdict(
    findings: tuple[Finding, ...], others: tuple[Alternative, ...], remainder: Remainder
) -> Verdict:
    if remainder.is_force:
        return "outside the catalogue"
    if not findings:
        return "nothing missing"
    return "ambiguous" if others or any(f.rivals for f in findings) else "found"
