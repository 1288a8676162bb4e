"""Add one effect to the model of a case, fit without and with it, and see the error fall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.errors import ConfigError, DataError, NumericalError, OrbitError, nearest
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.cases.catalogue import default_candidates
from unmodeled.pipeline.diagnosis.held_out import held_out_rms
from unmodeled.pipeline.diagnosis.next_case import next_case, plain_name, renamed
from unmodeled.pipeline.diagnosis.pool import Pool
from unmodeled.pipeline.diagnosis.result import Estimate
from unmodeled.pipeline.diagnosis.start import estimates_of, with_set
from unmodeled.pipeline.linearisation import Linearisation
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["Addition", "add", "addable"]


@dataclass(frozen=True)
class Addition:
    """What adding one effect changed.

    Parameters
    ----------
    case : Case
        As given.
    candidate : Candidate
        What was added.
    estimates : tuple of Estimate
        Of its parameters; sigmas with the noise as found after the addition.
    fit, final_fit : OrbitFit
        Without and with it.
    final_case : Case
        With it, at the values of its fit.
    held_out_before, held_out_after : float or None
        Residual RMS of the held-out arcs in sigmas, None if there are none.
    """

    case: Case = field(repr=False)
    candidate: Candidate = field(repr=False)
    estimates: tuple[Estimate, ...]
    fit: OrbitFit = field(repr=False)
    final_fit: OrbitFit = field(repr=False)
    final_case: Case = field(repr=False)
    held_out_before: float | None
    held_out_after: float | None

    @property
    def rms_before(self) -> float:
        """Residual RMS without it, in sigmas."""
        return self.fit.rms_in_sigmas

    @property
    def rms_after(self) -> float:
        """Residual RMS with it, in sigmas."""
        return self.final_fit.rms_in_sigmas

    @property
    def delta_chi_square(self) -> float:
        """By how much chi-square fell."""
        return self.fit.cost - self.final_fit.cost

    @property
    def source(self) -> dict[str, Any]:
        """Content of the next case file."""
        content = next_case(self.final_case, (self.candidate,))
        return renamed(content, f"with-{plain_name(self.candidate.name)}")

    def rms(self) -> pd.DataFrame:
        """Residual RMS before and after, a row a data set and unit.

        Returns
        -------
        DataFrame
            Columns label, unit, before, after (in that unit), before_in_sigmas, after_in_sigmas,
            count (of used components).
        """
        before, after = (self._by_set(f.residuals) for f in (self.fit, self.final_fit))
        keys = ["label", "unit"]
        return before.merge(
            after.drop(columns="count"), on=keys, suffixes=("_before", "_after")
        ).rename(
            columns={
                "rms_before": "before",
                "rms_after": "after",
                "in_sigmas_before": "before_in_sigmas",
                "in_sigmas_after": "after_in_sigmas",
            }
        )

    def as_json(self) -> dict[str, Any]:
        """Return plain data; the schema is `unmodeled schema add`."""
        return {
            "case": self.case.name,
            "effect": self.candidate.name,
            "title": self.candidate.title,
            "family": self.candidate.family,
            "parameters": [vars(e) for e in self.estimates],
            "delta_chi_square": self.delta_chi_square,
            "residual_rms_before": self.rms_before,
            "residual_rms_after": self.rms_after,
            "held_out_rms_before": self.held_out_before,
            "held_out_rms_after": self.held_out_after,
            "data": self.rms().to_dict(orient="records"),
        }

    def _by_set(self, residuals: pd.DataFrame) -> pd.DataFrame:
        kinds = {m.label: m.kind for arc in self.case.arcs for m in arc.measurements}
        used = residuals[residuals["used"]]
        table = pd.DataFrame(
            {
                "label": used["label"],
                "unit": [
                    unit_of(kinds[label], component)
                    for label, component in zip(used["label"], used["component"], strict=True)
                ],
                "rms": used["residual"] ** 2,
                "in_sigmas": (used["residual"] / used["sigma"]) ** 2,
            }
        )
        grouped = table.groupby(["label", "unit"], sort=False)
        means = grouped[["rms", "in_sigmas"]].mean() ** 0.5
        return means.assign(count=grouped.size()).reset_index()


def add(
    case: Case, effect: str, *, progress: Callable[[str, float], None] | None = None
) -> Addition:
    """Fit a case without and with one more effect.

    Parameters
    ----------
    case : Case
        Model and measurements.
    effect : str
        Name of a candidate of the catalogue for this case; the case need not list it.
    progress : callable, optional
        Called with a text and the share done.

    Raises
    ------
    ConfigError
        If the effect is unknown, or in the model already.
    NumericalError
        If the fit with it does not converge, or leads where nothing can be computed.
    """
    candidate = _candidate(case, effect)
    say = progress or (lambda text, share: None)
    say("fitting without it", 0.0)
    fit = case.fit()
    say("fitting with it", 0.4)
    start = _with_first_guess(case.at(fit), fit, candidate)
    try:
        final = start.fit()
    except (NumericalError, OrbitError, DataError) as exc:
        raise NumericalError(
            f"{case.name} cannot be fitted with {candidate.name}: {exc.found}",
            do="it does not explain these data; run diagnose to see what does",
        ) from exc
    final_case = start.at(final)
    say("predicting the held-out arcs", 0.8)
    noise = float(np.sqrt(final.cost / max(final.freedom, 1)))
    return Addition(
        case=case,
        candidate=candidate,
        estimates=estimates_of(candidate, final, noise),
        fit=fit,
        final_fit=final,
        final_case=final_case,
        held_out_before=held_out_rms(case.at(fit)),
        held_out_after=held_out_rms(final_case),
    )


def addable(case: Case) -> tuple[Candidate, ...]:
    """Return the candidates of a case and the rest of the catalogue that its model lacks."""
    every = default_candidates(
        case.body, case.dynamics, case.arcs, case.spacecraft, case.instruments, case.epoch
    )
    own = {c.name for c in case.candidates}
    return (*case.candidates, *(c for c in every if c.name not in own))


def unit_of(kind: str, component: str) -> str:
    """Return the SI unit of a measured component of a kind of data.

    Examples
    --------
    >>> unit_of("position_velocity", "vx"), unit_of("azimuth_elevation", "azimuth")
    ('m/s', 'rad')
    """
    if kind in ("right_ascension_declination", "azimuth_elevation"):
        return "rad"
    if kind == "range_rate" or (kind == "position_velocity" and component.startswith("v")):
        return "m/s"
    return "m"


def _candidate(case: Case, name: str) -> Candidate:
    found = {c.name: c for c in addable(case)}
    if name in found:
        free = [n for n in found[name].estimate if n in case.estimate]
        if not free:
            return found[name]
        raise ConfigError(
            f"the model of {case.name} has {name} already: {', '.join(free)} is free in it",
            do="add another effect, or run diagnose",
        )
    if name in _names_in_model(case):
        raise ConfigError(
            f"the model of {case.name} has {name} already",
            do="add another effect, or run diagnose",
        )
    raise ConfigError(f'there is no effect "{name}" for {case.name}', do=nearest(name, found))


def _names_in_model(case: Case) -> set[str]:
    """Names of effects, and of candidates that the catalogue would offer to a bare model."""
    effects = case.dynamics.effects
    point = [e for e in effects if "GM" in {p.name for p in e.parameters}]
    bare = case.dynamics.with_effects(point[:1] or effects, case.dynamics.values)
    offered = default_candidates(case.body, bare, case.arcs, case.spacecraft, epoch=case.epoch)
    present = {e.name for e in effects} | {e.name for e in case.instruments}
    return {c.name for c in offered} | present


def _with_first_guess(case: Case, fit: OrbitFit, candidate: Candidate) -> Case:
    """Return the case with the effect at its linear estimate, at the best place if searched."""
    pool = Pool(Linearisation(case, fit), (candidate,))
    drops, _ = pool.gains(())
    best = int(np.argmax(drops))
    if not drops[best] > 0:
        raise ConfigError(
            f"the measurements of {case.name} do not see {candidate.name}",
            do="add another effect, or more data",
        )
    return with_set(case, pool, pool.score((best,)))
