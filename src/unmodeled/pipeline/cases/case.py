"""A case: a force model, what was measured, and what might be missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from unmodeled.core.errors import ConfigError
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.measurement_effects import MeasurementEffect
from unmodeled.models.physics import Dynamics, Effect
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.spacecraft import Spacecraft
from unmodeled.pipeline.fit_problem import Arc
from unmodeled.pipeline.orbit_fit import OrbitFit, fit_orbits

__all__ = ["Case"]


@dataclass(frozen=True)
class Case:
    """Everything that `compare`, `diagnose` and `add` need, in SI and ready to compute.

    Parameters
    ----------
    name : str
        Of folders and reports.
    body : Body
        Central body.
    epoch : str
        Time zero with its scale, e.g. ``"2016-03-13T00:00:00 UTC"``.
    dynamics : Dynamics
        The known effects with their values, in surroundings that cover all arcs.
    arcs : tuple of Arc
        To be fitted.
    held_out : tuple of Arc
        Never fitted to: their states only, to see whether the model predicts.
    estimate : mapping of str to float or None
        Free parameters of the known model with the sigma of their priors.
    instruments : tuple of MeasurementEffect
        Known effects of the measurements.
    instrument_values : mapping of str to float
        Their parameters.
    candidates : tuple of Candidate
        What might be missing.
    spacecraft : Spacecraft, optional
        Sizes the expected radiation pressure and drag.
    false_alarm : float
        Probability of a false finding on data that miss nothing.
    seed : int
        Of everything that is drawn.
    source : mapping
        The case file as read: `add` writes its successor.
    """

    name: str
    body: Body
    epoch: str
    dynamics: Dynamics
    arcs: tuple[Arc, ...]
    held_out: tuple[Arc, ...] = ()
    estimate: Mapping[str, float | None] = field(default_factory=dict)
    instruments: tuple[MeasurementEffect, ...] = ()
    instrument_values: Mapping[str, float] = field(default_factory=dict)
    candidates: tuple[Candidate, ...] = ()
    spacecraft: Spacecraft | None = None
    false_alarm: float = 0.01
    seed: int = 0
    source: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if not 0 < self.false_alarm < 0.5:
            raise ConfigError(
                f"false_alarm is {self.false_alarm}", allowed="a probability between 0 and 0.5"
            )
        # What is free in the fit has no error to be looked for.
        left = tuple(c for c in self.candidates if not set(c.estimate) & set(self.estimate))
        object.__setattr__(self, "candidates", left)

    def fit(self, edit_sigmas: float | None = None, settled: float = 0.0) -> OrbitFit:
        """Fit the states of all arcs and the free parameters, see `fit_orbits`."""
        return fit_orbits(
            self.dynamics,
            self.arcs,
            self.estimate,
            instruments=self.instruments,
            instrument_values=self.instrument_values,
            edit_sigmas=edit_sigmas,
            settled=settled,
        )

    def with_effect(
        self,
        candidate: Candidate,
        values: Mapping[str, float],
        estimate: Mapping[str, float | None],
    ) -> Case:
        """Return the case whose model also has a candidate, which leaves the candidates.

        Parameters
        ----------
        candidate : Candidate
            The effect.
        values : mapping of str to float
            Values of its parameters; those not given keep the candidate's.
        estimate : mapping of str to float or None
            Which of its parameters stay free, with the sigma of their priors.
        """
        own = {**candidate.values, **values}
        rest = tuple(c for c in self.candidates if c.name != candidate.name)
        free = {**self.estimate, **estimate}
        if isinstance(candidate.effect, Effect):
            # A2 after A1, or an error of what the model has: the effect is there already, and what
            # the candidate does not estimate stays as the model has it.
            known, kept = self.dynamics.effects, {*candidate.estimate, *candidate.searched}
            effects = known if candidate.effect in known else (*known, candidate.effect)
            model = self.dynamics.values
            own = {k: v for k, v in own.items() if k in kept or k not in model}
            dynamics = self.dynamics.with_effects(effects, own)
            return replace(self, dynamics=dynamics, candidates=rest, estimate=free)
        return replace(
            self,
            instruments=(*self.instruments, candidate.effect),
            instrument_values={**self.instrument_values, **own},
            candidates=rest,
            estimate=free,
        )

    def at(self, fit: OrbitFit) -> Case:
        """Return the case started from the result of a fit: nothing is lost to convergence."""
        arcs = tuple(
            replace(arc, state=state) for arc, state in zip(self.arcs, fit.states, strict=True)
        )
        force = {k: v for k, v in fit.values.items() if k in self.dynamics.values}
        rest = {k: v for k, v in fit.values.items() if k not in force}
        return replace(
            self,
            arcs=arcs,
            dynamics=self.dynamics.with_values(force),
            instrument_values={**self.instrument_values, **rest},
        )
