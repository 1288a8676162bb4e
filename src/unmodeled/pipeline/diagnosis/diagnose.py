"""The loop: score, refit, score again, until what is left is noise."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from unmodeled.core.errors import DataError, NumericalError, OrbitError
from unmodeled.core.seeds import Streams
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.comparison.whiteness import is_coloured, whiteness
from unmodeled.pipeline.diagnosis.describe import describe_candidates, describe_finding
from unmodeled.pipeline.diagnosis.further_data import further_data
from unmodeled.pipeline.diagnosis.held_out import held_out_rms
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.remainder import remainder_log_p
from unmodeled.pipeline.diagnosis.result import Diagnosis, Finding, Step, Verdict
from unmodeled.pipeline.diagnosis.search import best_set, pruned
from unmodeled.pipeline.diagnosis.start import Chosen, chosen_values, with_set
from unmodeled.pipeline.diagnosis.threshold import smallest_p_threshold
from unmodeled.pipeline.linearisation import Linearisation
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["diagnose"]

#: A free acceleration in the remainder must be this unlikely by chance to be reported.
_REMAINDER = float(np.log(1e-3))
#: Residuals above this many sigmas: the linear picture is rough, effects are added one by one.
_ROUGH = 3.0
#: A rival by linear score is refitted if it explains this share of what the best explains.
_NEAR = 0.8
_RIVALS = 3
#: An exchange must lower chi-square by this much in the exact fit, in units of the noise.
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
        names = frozenset(pool.members[m].candidate.name for m in chosen.members)
        if names == frozenset(state.accepted) or names in tried:
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
        gained = state.fit.cost - fresh.fit.cost
        if len(fresh.accepted) <= len(state.accepted) and gained < _GAIN * chosen.noise**2:
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
        gone = ", ".join(sorted(set(state.accepted) - set(last.accepted)))
        state = last
        steps.append(Step(f"without {gone}", state.fit.rms_in_sigmas, held_out_rms(state.case)))
        lin, pool, start = _linearised(case, state)
        chosen = pool.score(start)
    remainder = remainder_log_p(pool, chosen.members)
    white = whiteness(lin)
    coloured = remainder < _REMAINDER or is_coloured(white)
    findings = tuple(
        describe_finding(case, pool, chosen, m, limit, state.fit, coloured=coloured)
        for m in sorted(chosen.members, key=lambda m: -_drop_without(pool, chosen, m))
    )
    return Diagnosis(
        case=case,
        verdict=_verdict(findings, remainder),
        findings=findings,
        steps=tuple(steps),
        noise=chosen.noise,
        remainder_log10_p=remainder / np.log(10.0),
        log_p_limit=limit,
        candidates=describe_candidates(first_pool, limit),
        further=further_data(state.case, findings, case.candidates),
        final_case=state.case,
        fit=first_fit,
        final_fit=state.fit,
        whiteness=white,
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


def _verdict(findings: tuple[Finding, ...], remainder: float) -> Verdict:
    if remainder < _REMAINDER:
        return "outside the catalogue"
    if not findings:
        return "nothing missing"
    return "ambiguous" if any(f.rivals for f in findings) else "found"
