"""The loop: score, refit, score again, until what is left is noise."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pandas as pd

from unmodeled.core.seeds import Streams
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.comparison.whiteness import is_coloured, whiteness
from unmodeled.pipeline.diagnosis.alternatives import other_sets
from unmodeled.pipeline.diagnosis.describe import describe_candidates, describe_finding
from unmodeled.pipeline.diagnosis.further_data import further_data
from unmodeled.pipeline.diagnosis.grown_model import ROUGH, GrownModel, best_refit, fitted, started
from unmodeled.pipeline.diagnosis.held_out import held_out_forecast
from unmodeled.pipeline.diagnosis.judgement import (
    alternatives_of,
    drop_without,
    is_imitation,
    verdict_of,
    weakest,
    weighed,
)
from unmodeled.pipeline.diagnosis.pool import SetScore
from unmodeled.pipeline.diagnosis.remainder import Remainder, remainder_of
from unmodeled.pipeline.diagnosis.remainder_model import learn_remainder
from unmodeled.pipeline.diagnosis.result import Diagnosis, Dismissed
from unmodeled.pipeline.diagnosis.search import MARGIN, best_set, pruned
from unmodeled.pipeline.diagnosis.threshold import smallest_p_threshold
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["diagnose"]

#: An exchange must lower chi-square by this much in the exact fit, in units of the noise, or by
#: what the linear picture promised less as much (fewer effects may fit a little worse).
_GAIN = 2.0

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
    loop = _Loop(case, most, say)
    loop.grow()
    loop.prune()
    remainder, white, coloured = loop.doubt()
    pool, chosen, model = loop.pool, loop.chosen, loop.model
    findings = tuple(
        describe_finding(case, pool, chosen, m, loop.limit, model.fit, coloured=coloured)
        for m in sorted(chosen.members, key=lambda m: -drop_without(pool, chosen, m))
    )
    sets = alternatives_of(pool, chosen, findings, loop.other_sets())
    findings = tuple(weighed(f, sets) for f in findings)
    verdict = verdict_of(findings, sets, remainder)
    imitation, rest = is_imitation(findings), None
    if verdict == "outside the catalogue":
        say("learning what no effect explains", 0.9)
        # What imitates it must not take its signal first.
        base = loop.first if imitation else model
        rest = learn_remainder(Linearisation(base.case, base.fit))
    nulls = {n: c.values[n] for c in case.candidates for n in c.estimate} | loop.first.fit.values
    return Diagnosis(
        case=case,
        verdict=verdict,
        findings=findings,
        alternatives=sets,
        dismissed=tuple(loop.dismissed),
        steps=tuple(loop.steps),
        noise=chosen.noise,
        remainder_log10_p=remainder.log_p / np.log(10.0),
        imitation=imitation,
        within_stated_noise=remainder.is_there and not remainder.is_force,
        log_p_limit=loop.limit,
        candidates=describe_candidates(loop.first_pool, loop.limit),
        further=further_data(model.case, findings, case.candidates),
        forecast=held_out_forecast(model.case, model.fit, nulls, chosen.noise),
        final_case=model.case,
        fit=loop.first.fit,
        final_fit=model.fit,
        whiteness=white,
        remainder=rest,
        seconds=time.perf_counter() - begin,
    )


class _Loop:
    """The model as it grows: what is in it, its linear picture, and what was tried."""

    def __init__(self, case: Case, most: int, say: Progress) -> None:
        self.given, self.most, self.say = case, most, say
        self.first = self.model = started(case)
        self.steps = [self.model.step()]
        self.dismissed: list[Dismissed] = []
        self._tried = [frozenset[str]()]
        self._banned = frozenset[str]()
        say(f"scoring {len(case.candidates)} candidates", 0.1)
        self._look()
        self.first_pool = self.pool
        generator = Streams(case.seed).generator("diagnosis threshold")
        self.limit = smallest_p_threshold(self.pool, (), case.false_alarm, generator)

    def grow(self) -> None:
        """Search, refit without approximation, search again, until the set stays."""
        turns = 2 * self.most + 2
        for turn in range(turns):
            wanted = self._wanted()
            if wanted is None:
                return
            self.say("refitting", (turn + 0.7) / turns)
            fresh = best_refit(self.given, self.model, self.pool, wanted)
            if fresh is None:
                # What cannot be fitted exactly is no answer; the next best may be.
                self._banned |= self.pool.names(wanted) - self.model.names
                continue
            self._tried.append(fresh.names)
            gained = (self.model.fit.cost - fresh.fit.cost) / wanted.noise**2
            promised = (wanted.drop - self.chosen.drop) / wanted.noise**2
            if len(fresh.names) <= len(self.model.names) and gained < min(_GAIN, promised - _GAIN):
                # The exact fit does not confirm an exchange: the search would go in circles.
                return
            self.say(f"scoring {len(self.given.candidates)} candidates", (turn + 1.0) / turns)
            self._change(fresh)

    def prune(self) -> None:
        """Take out what no longer passes: the exact fits moved on since it was chosen."""
        kept = pruned(self.pool, self.chosen, self.limit)
        if len(kept.members) < len(self.chosen.members):
            self._reduce(kept)

    def doubt(self) -> tuple[Remainder, pd.DataFrame, bool]:
        """Test what is left; take out what does not stand under residuals that are not white.

        White noise is what the threshold supposes: under coloured residuals slow changes pass it
        that are none of the catalogue's.
        """
        while True:
            self.say("testing what is left", 0.9)
            remainder, white = remainder_of(self.pool, self.chosen.members), whiteness(self.lin)
            coloured = remainder.is_there or is_coloured(white)
            doubt = weakest(self.pool, self.chosen) if coloured else None
            if doubt is None:
                return remainder, white, coloured
            member, dismissal = doubt
            rest = [m for m in self.chosen.members if m != member]
            if not self._reduce(self.pool.score(rest)):
                return remainder, white, coloured
            self.dismissed.append(dismissal)
            self._exchange()

    def other_sets(self) -> tuple[SetScore, ...]:
        """Return other sets that explain as much as the chosen one."""
        return other_sets(self.pool, self.chosen, self.limit, self._banned)

    def _wanted(self) -> SetScore | None:
        """Return the set that the model should have; None if it has it, or had it before."""
        room = self.most - len(self.chosen.members)
        growth = min(room, 1 if self.pool.score(()).noise > ROUGH else 2)
        best = best_set(self.pool, self.chosen.members, self.limit, growth, self._banned, self.most)
        names = self.pool.names(best)
        if names != self.model.names and names not in self._tried:
            return best
        # Settled. Another set may still be likelier, that no exchange of members leads to.
        others = self.other_sets()
        if not others or others[0].evidence <= self.chosen.evidence + MARGIN:
            return None
        names = self.pool.names(others[0])
        return None if names in self._tried or len(names) > self.most else others[0]

    def _exchange(self) -> None:
        """Look again which effects of this number explain most, without what was dismissed.

        What was taken out may have been why another effect was preferred.
        """
        banned = self._banned | {d.name for d in self.dismissed}
        best = best_set(self.pool, self.chosen.members, self.limit, 0, banned)
        if self.pool.names(best) == self.model.names:
            return
        fresh = fitted(self.given, self.pool, best)
        if fresh is not None and fresh.fit.cost < self.model.fit.cost + _GAIN * best.noise**2:
            self._change(fresh)

    def _reduce(self, kept: SetScore) -> bool:
        fresh = fitted(self.given, self.pool, kept)
        if fresh is not None:
            self._change(fresh)
        return fresh is not None

    def _change(self, fresh: GrownModel) -> None:
        self.steps.append(fresh.step(self.model))
        self.model = fresh
        self._look()

    def _look(self) -> None:
        self.lin, self.pool, own = self.model.linearised(self.given)
        self.chosen = self.pool.score(own)
