"""The model with what was added so far, and its exact refits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from unmodeled.core.errors import DataError, NumericalError, OrbitError
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.held_out import held_out_rms
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.result import Step
from unmodeled.pipeline.diagnosis.start import Chosen, chosen_values, with_set
from unmodeled.pipeline.linearisation import Linearisation
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["ROUGH", "GrownModel", "best_refit", "fitted", "started"]

#: Residuals above this many sigmas: the linear picture is rough, effects are added one by one.
ROUGH = 3.0
#: A rival by linear score is refitted if it explains this share of what the best explains.
_NEAR = 0.8
_RIVALS = 3
#: Fits on the way stop when chi-square falls by less than this.
_SETTLED = 1e-3


@dataclass(frozen=True)
class GrownModel:
    """A case with effects added, fitted.

    Parameters
    ----------
    case : Case
        At the values of its fit.
    fit : OrbitFit
        Its fit.
    accepted : mapping of str to mapping
        Parameters of what was added, by candidate.
    """

    case: Case
    fit: OrbitFit
    accepted: Mapping[str, Mapping[str, float]]

    @property
    def names(self) -> frozenset[str]:
        """What was added."""
        return frozenset(self.accepted)

    def step(self, before: GrownModel | None = None) -> Step:
        """Return the bar of the waterfall after a change from another model."""
        label = ""
        if before is not None:
            added = ", ".join(sorted(self.names - before.names))
            gone = ", ".join(sorted(before.names - self.names))
            label = f"{added or 'nothing'} for {gone}" if gone else added
        return Step(label, self.fit.rms_in_sigmas, held_out_rms(self.case))

    def linearised(self, given: Case) -> tuple[Linearisation, Pool, list[int]]:
        """Return the linear picture, all candidates in it, and which are in the model.

        Only what the case as ``given`` leaves free is projected out: what was added can be taken
        back.
        """
        lin = Linearisation(replace(self.case, estimate=given.estimate), self.fit)
        pool = Pool(lin, given.candidates, self.accepted)
        own = [k for k, m in enumerate(pool.members) if m.candidate.name in self.accepted]
        return lin, pool, own


def started(case: Case) -> GrownModel:
    """Return the model as given, fitted."""
    fit = case.fit(settled=_SETTLED)
    return GrownModel(case.at(fit), fit, {})


def best_refit(case: Case, model: GrownModel, pool: Pool, chosen: SetScore) -> GrownModel | None:
    """Refit with the chosen set, or with a near rival of its newest member if that fits better."""
    options = [chosen]
    new = [m for m in chosen.members if pool.members[m].candidate.name not in model.accepted]
    if len(new) == 1 and pool.score(()).noise > ROUGH:
        rest = [m for m in chosen.members if m != new[0]]
        drops, _ = pool.gains(rest)
        best = drops[new[0]]
        seen = set(pool.names(chosen) | pool.excluded(rest))
        for k in np.argsort(-drops):
            name = pool.members[k].candidate.name
            if name in seen or drops[k] < _NEAR * best or len(options) > _RIVALS:
                continue
            seen.add(name)
            options.append(pool.score((*rest, int(k))))
    results = [r for s in options if (r := fitted(case, pool, s)) is not None]
    return min(results, key=lambda r: r.fit.cost, default=None)


def fitted(case: Case, pool: Pool, chosen: SetScore) -> GrownModel | None:
    """Fit a case with a set of effects without approximation; None if that does not converge."""
    model, members = with_set(case, pool, chosen), chosen_values(pool, chosen)
    fit = _fit_or_none(model) or _fit_or_none(_held(model, members))
    if fit is None:
        return None
    model = model.at(fit)
    now = {**model.dynamics.values, **model.instrument_values}
    accepted = {c.name: {k: now.get(k, v) for k, v in values.items()} for c, values in members}
    return GrownModel(model, fit, accepted)


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
