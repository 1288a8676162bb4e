"""Cases with effects hidden in their data: simulated, so that the truth is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.core.seeds import Streams
from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.station import Station
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.cases.case_config import CaseConfig
from unmodeled.pipeline.cases.catalogue import candidate_by_name
from unmodeled.pipeline.cases.load_case import Ground, case_from_mapping
from unmodeled.pipeline.cases.outside_effects import OUTSIDE, outside_effects
from unmodeled.pipeline.cases.quantities import write_quantity
from unmodeled.pipeline.cases.read_data import stations_of
from unmodeled.pipeline.cases.scenario_orbits import Flight, Scenario, scenario
from unmodeled.pipeline.fit_problem import Arc
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["HiddenEffect", "Simulated", "scenario_case", "simulate"]

#: Lowest elevation at which stations track, rad.
_HORIZON = np.radians(10.0)
#: Amplitudes beyond this many times the expected size are not simulated.
_LARGEST = 100.0
_ANGLES = ("right_ascension_declination", "azimuth_elevation")


@dataclass(frozen=True)
class HiddenEffect:
    """An effect that acts on the data and not on the case's model.

    Parameters
    ----------
    name : str
        Of a candidate of the case, or of an effect that the catalogue does not have
        (`outside_effects`).
    values : mapping of str to float
        Parameters, SI; those not given are the candidate's.
    noncentrality : float, optional
        Strength instead of values of the estimated parameters: they are drawn in the ratio of
        their expected sizes and scaled so that the best possible test has this non-centrality
        (the mean drop of chi-square beyond the number of parameters).
    """

    name: str
    values: Mapping[str, float] = field(default_factory=dict)
    noncentrality: float | None = None


@dataclass(frozen=True)
class Simulated:
    """A simulated case and what is hidden in it.

    Parameters
    ----------
    case : Case
        As `load_case` gives it; it knows nothing of the truth.
    truth : mapping of str to mapping
        Of each hidden effect its parameters as they act, SI.
    states : ndarray (a, 6)
        True initial states of the arcs, fitted ones first.
    data : tuple of Measurements
        All that was measured, one set a file.
    units : mapping of str to str
        Of the parameters in ``truth``.
    """

    case: Case
    truth: Mapping[str, Mapping[str, float]]
    states: Array
    data: tuple[Measurements, ...]
    units: Mapping[str, str]


def scenario_case(name: str, seed: int, hidden: Sequence[HiddenEffect] = ()) -> Case:
    """Return the case of `simulate`, without its truth."""
    return simulate(name, seed, hidden).case


def simulate(
    name: str,
    seed: int,
    hidden: Sequence[HiddenEffect] = (),
    *,
    noise_factor: float = 1.0,
    held_out: bool = False,
) -> Simulated:
    """Simulate a case in memory.

    Parameters
    ----------
    name : str
        Scenario.
    seed : int
        Of orbit, noise and strengths.
    hidden : sequence of HiddenEffect
        What the model will lack.
    noise_factor : float
        True standard deviation of the noise over the stated one.
    held_out : bool
        Add an arc on another orbit that is not fitted.

    Raises
    ------
    ConfigError
        If the scenario, an effect or a parameter is unknown.
    NumericalError
        If a strength is asked for that no amplitude gives, because the data do not see the effect.
    """
    plan = scenario(name, seed, held_out=held_out)
    mapping = _with_data(plan)
    config = CaseConfig.resolve(dict(mapping))
    ground = Ground.of(config, Path())
    stations = stations_of(config, ground.around)
    last = max(float(f.times[-1]) for f in plan.flights)
    dynamics = ground.dynamics(plan.flights[0].start, last)
    clean = _measured(plan, _empty_sets(plan, dynamics, stations, config.epoch), dynamics)
    case = case_from_mapping(mapping, data=clean)
    truth_case = case
    truth: dict[str, dict[str, float]] = {}
    units: dict[str, str] = {}
    fitted: Linearisation | None = None
    for number, effect in enumerate(hidden):
        candidate = _candidate(effect.name, case)
        rng = Streams(seed).generator(f"hidden.{number}.{effect.name}")
        values = _values(effect, candidate, case, rng)
        if effect.noncentrality is not None:
            fitted = fitted or _linear(case, plan)
            values |= _scaled(candidate, values, effect.noncentrality, fitted, rng)
        truth_case = _acting(truth_case, candidate, values, effect.values)
        truth[effect.name] = values
        units |= {p.name: p.unit for p in (*case.dynamics.parameters, *candidate.effect.parameters)}
    exact = _measured(plan, clean, truth_case.dynamics, truth_case)
    data = _noisy(exact, seed, noise_factor)
    states = np.array([f.state for f in plan.flights])
    return Simulated(_with_arcs(case, plan, data), truth, states, data, units)


def _with_data(plan: Scenario) -> dict[str, Any]:
    """Return the case file with its measurements and arcs."""
    measurements = []
    for p in plan.plans:
        entry = {
            "file": p.file,
            "kind": p.kind,
            "sigma": "file",
            "label": p.file.removesuffix(".csv"),
        }
        measurements.append(entry | ({"station": p.station} if p.station else {}))
    arcs = []
    for f in plan.flights:
        arc: dict[str, Any] = {
            "name": f.name,
            "start": write_quantity(f.start, "s"),
            "end": write_quantity(float(f.times[-1]), "s"),
            "initial_state": {
                "position": [write_quantity(v, "m") for v in f.guess[:3]],
                "velocity": [write_quantity(v, "m s-1") for v in f.guess[3:]],
            },
        }
        arcs.append(arc | ({"role": "held_out"} if f.held_out else {}))
    return {**plan.mapping, "measurements": measurements, "arcs": arcs}


def _empty_sets(
    plan: Scenario, dynamics: Dynamics, stations: Mapping[str, Station], epoch: str
) -> tuple[Measurements, ...]:
    """Return sets at the right times, without values."""
    sets = []
    orbits = [_orbit(dynamics, f, f.times) for f in plan.flights]
    for p in plan.plans:
        station = stations[p.station] if p.station else None
        kept = []
        for f, orbit in zip(plan.flights, orbits, strict=True):
            seen = np.ones(len(f.times), dtype=bool)
            if station is not None:
                track = station.track(epoch, f.times)
                towards = orbit[:, :3] - track.positions
                up = np.einsum("nj,nj->n", towards, track.north_east_up[:, 2])
                seen = np.arcsin(up / np.linalg.norm(towards, axis=1)) > _HORIZON
            kept.append(f.times[seen])
        times = np.concatenate(kept)
        width = {"position": 3, "position_velocity": 6, "range": 1, "range_rate": 1}.get(p.kind, 2)
        label = p.file.removesuffix(".csv")
        sets.append(
            Measurements(
                p.kind,  # type: ignore[arg-type]
                times,
                np.zeros((len(times), width)),
                p.sigma,
                label,
                station,
                epoch,
            )
        )
    return tuple(sets)


def _measured(
    plan: Scenario,
    sets: Sequence[Measurements],
    dynamics: Dynamics,
    truth: Case | None = None,
) -> tuple[Measurements, ...]:
    """Return the sets with what perfect instruments, or those of the truth, would read."""
    applied = []
    for m in sets:
        made = m
        for effect in truth.instruments if truth is not None else ():
            if truth is not None and effect.concerns(made):
                made = effect.applied(made, truth.instrument_values)
        applied.append(made)
    out = []
    for m, made in zip(sets, applied, strict=True):
        values = np.empty_like(m.values)
        for f in plan.flights:
            inside = (m.times > f.start) & (m.times <= f.times[-1])
            part = made.subset(inside)
            values[inside] = part.observed(_orbit(dynamics, f, part.times))
        out.append(replace(m, values=values))
    return tuple(out)


def _orbit(dynamics: Dynamics, flight: Flight, times: Array) -> Array:
    """States of a flight at increasing times after its start."""
    grid = np.concatenate([[flight.start], times])
    return dynamics.propagate(flight.state, grid)[1:]


def _noisy(sets: Sequence[Measurements], seed: int, factor: float) -> tuple[Measurements, ...]:
    out = []
    for m in sets:
        noise = Streams(seed).generator(f"noise.{m.label}").normal(size=m.values.shape)
        noise = factor * m.sigmas * noise
        if m.kind in _ANGLES:
            noise[:, 0] /= np.cos(m.values[:, 1])
        out.append(replace(m, values=m.values + noise))
    return tuple(out)


def _with_arcs(case: Case, plan: Scenario, data: Sequence[Measurements]) -> Case:
    """Return the case with other data in its arcs."""

    def refill(arcs: Sequence[Arc]) -> tuple[Arc, ...]:
        out = []
        for arc in arcs:
            f = next(f for f in plan.flights if f.name == arc.name)
            cut = [(m, (m.times >= f.start) & (m.times <= f.times[-1])) for m in data]
            inside = tuple(m.subset(mask) for m, mask in cut if mask.any())
            out.append(replace(arc, measurements=inside))
        return tuple(out)

    return replace(case, arcs=refill(case.arcs), held_out=refill(case.held_out))


def _candidate(name: str, case: Case) -> Candidate:
    outside = {c.name: c for c in outside_effects(case)}
    return outside[name] if name in outside else candidate_by_name(name, case.candidates)


def _values(
    effect: HiddenEffect, candidate: Candidate, case: Case, rng: np.random.Generator
) -> dict[str, float]:
    """Return all its parameters; a place is drawn among those that would be searched."""
    known = {p.name for p in candidate.effect.parameters} | set(candidate.values)
    for name in effect.values:
        if name not in known:
            raise ConfigError(
                f'{effect.name} has no parameter "{name}"', allowed=", ".join(sorted(known))
            )
    # An error of what the model has starts from the model's value.
    model = case.dynamics.values | dict(case.instrument_values)
    values = {k: model.get(k, v) for k, v in candidate.values.items()}
    if candidate.places:
        values |= candidate.places[int(rng.integers(len(candidate.places)))]
    return values | {k: float(v) for k, v in effect.values.items()}


def _acting(
    case: Case, candidate: Candidate, values: Mapping[str, float], given: Mapping[str, float]
) -> Case:
    """Return the case in whose model the effect acts."""
    if candidate.is_force and set(candidate.estimate) <= set(case.dynamics.values):
        # Its own parameters only: others of the same effect may belong to what was hidden before.
        own = {*candidate.estimate, *candidate.searched, *given}
        known = {k: values[k] for k in own & set(case.dynamics.values)}
        return replace(case, dynamics=case.dynamics.with_values(known))
    return case.with_effect(candidate, values, {})


def _linear(case: Case, plan: Scenario) -> Linearisation:
    """Linearise the case of perfect data at its true states: nothing is left over."""
    states = {f.name: f.state for f in plan.flights}
    exact = replace(case, arcs=tuple(replace(a, state=states[a.name]) for a in case.arcs))
    return Linearisation(exact, exact.fit())


def _scaled(
    candidate: Candidate,
    values: Mapping[str, float],
    noncentrality: float,
    linear: Linearisation,
    rng: np.random.Generator,
) -> dict[str, float]:
    """Return the estimated parameters of the wanted strength, in a random direction."""
    if not noncentrality >= 0:
        raise ConfigError(f"noncentrality is {noncentrality}", allowed="a number >= 0")
    free = [n for n in candidate.estimate if n not in candidate.searched]
    priors = dict(zip(candidate.estimate, candidate.priors, strict=True))
    draws = rng.normal(size=len(free))
    draws = np.where([n in candidate.positive for n in free], np.abs(draws), draws)
    direction = np.array([priors[n] for n in free]) * draws / np.linalg.norm(draws)
    columns = linear.columns(candidate.effect, values, free)
    size = float(np.linalg.norm(linear.project(columns @ direction)))
    # Of what no catalogue has no size is expected.
    largest = np.inf if candidate.family == OUTSIDE else _LARGEST
    if not size * largest >= np.sqrt(noncentrality):
        raise NumericalError(
            f"the measurements do not see {candidate.name}: no amplitude has this strength",
            do="hide another effect, or give its values",
        )
    theta = direction * np.sqrt(noncentrality) / size
    return {n: float(values[n] + v) for n, v in zip(free, theta, strict=True)}
