"""Fly filters on a scenario: Monte-Carlo runs, errors against truth, consistency, cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.errors import ConfigError, NumericalError
from unmodeled.core.provenance import collect_provenance
from unmodeled.pipeline.filters.consistency import consistency
from unmodeled.pipeline.filters.run import FilterRun, run_filter
from unmodeled.pipeline.learned_field import LearnedField
from unmodeled.pipeline.navigation.contestants import Contestant, build, entry
from unmodeled.pipeline.navigation.flight import Flight, draw
from unmodeled.pipeline.navigation.floor import riccati_floor
from unmodeled.pipeline.navigation.learning_contestants import fixed_field
from unmodeled.pipeline.navigation.network_contestant import fed_back, train_on_dmc
from unmodeled.pipeline.navigation.result import Flown, NavigationResult
from unmodeled.pipeline.navigation.scenario_config import (
    CislunarConfig,
    FormationConfig,
    ScenarioConfig,
    load_scenario,
    resolve_scenario,
)

__all__ = ["fly", "navigate", "simulate_flight"]

Tell = Callable[[str, float], None]


def navigate(
    scenario: ScenarioConfig | Path | str,
    *,
    filters: Sequence[str] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    learner: Path | str | None = None,
    tell: Tell = lambda text, share: None,
) -> NavigationResult:
    """Fly filters on a scenario, side by side on the same draws.

    Parameters
    ----------
    scenario : ScenarioConfig or path
        A file of ``scenarios/``, or one already read.
    filters : sequence of str, optional
        Names that replace those of the file.
    runs : int, optional
        Monte-Carlo runs.
    seed : int, optional
    learner : path, optional
        A learned field (``.safetensors``) that flies as the residual, small bodies only.
    tell : callable
        Told what is done and the share of it.

    Raises
    ------
    ConfigError
        Unknown scenario, key or filter, or a learner where none can fly.
    """
    config = scenario if not isinstance(scenario, str | Path) else load_scenario(scenario)
    changes: dict[str, Any] = {}
    if filters is not None:
        changes["filters"] = list(filters)
    if runs is not None:
        changes["runs"] = runs
    if seed is not None:
        changes["seed"] = seed
    if changes:
        config = resolve_scenario(config.as_dict() | changes, config.name)
    for name in config.filters:
        entry(name)
    for name in config.tuning:
        entry(name)
    if learner is not None and config.kind != "small_body":
        raise ConfigError(
            f"--learner with the {config.kind} scenario {config.name}",
            allowed="a learned field in scenarios about a small body",
            do="leave --learner out",
        )
    made: dict[str, Callable[[Any], Contestant]] = {}
    notes: tuple[str, ...] = ()
    if learner is not None and "learned" not in config.filters:
        more = [*config.filters, "learned"]
        config = resolve_scenario(config.as_dict() | {"filters": more}, config.name)
    tell("truth", 0.0)
    flight = simulate_flight(config)
    if learner is not None:
        field = LearnedField.load(learner)
        noise = config.tuning.get("learned", {}).get("noise", entry("learned").tuning["noise"])
        made["learned"] = lambda starts: fixed_field(flight, starts, field, noise)
        notes = (f"The filter learned flies the field of {Path(learner).name}.",)
    if "network" in config.filters:
        tell("training the network", 0.1)
        dmc, own = (_numbers(config, name) for name in ("dmc", "network"))
        trained = train_on_dmc(flight, config.seed, dmc["sigma"], dmc["time_constant"])
        made["network"] = lambda starts: fed_back(flight, starts, trained.network, **own)
        notes += (trained.sentence,)
    return fly(config, flight, tell, made, notes)


def _numbers(config: ScenarioConfig, name: str) -> dict[str, float]:
    """Return the numbers of a filter with Gauss-Markov states, all of them given."""
    numbers = config.tuning.get(name, {})
    if set(numbers) != {"sigma", "time_constant"}:
        raise ConfigError(
            f"tuning of filter {name} has {', '.join(numbers) or 'nothing'}",
            allowed="sigma and time_constant",
            do="the filter network needs them for dmc, which labels, and for itself",
        )
    return dict(numbers)


def simulate_flight(config: ScenarioConfig) -> Flight:
    """Return the true flight of a scenario."""
    if isinstance(config, FormationConfig):
        from unmodeled.pipeline.navigation.formation_truth import formation_flight

        return formation_flight(config)
    if isinstance(config, CislunarConfig):
        from unmodeled.pipeline.navigation.cislunar_truth import cislunar_flight

        return cislunar_flight(config)
    from unmodeled.pipeline.navigation.small_body_truth import small_body_flight

    return small_body_flight(config)


def fly(
    config: ScenarioConfig,
    flight: Flight,
    tell: Tell = lambda text, share: None,
    contestants: Mapping[str, Callable[[Any], Contestant]] | None = None,
    notes: tuple[str, ...] = (),
) -> NavigationResult:
    """Fly the filters of a scenario on a flight.

    Parameters
    ----------
    config : ScenarioConfig
    flight : Flight
    tell : callable
    contestants : mapping, optional
        Makers, from first guesses (b, 6), of filters that the catalogue does not hold.
    notes : tuple of str
        For the result.
    """
    starts, z = draw(flight, config.runs, config.seed)
    noise = config.tuning.get("exact", {}).get("noise", 0.0)
    floor = riccati_floor(flight, noise)
    flown, rows = [], []
    for number, name in enumerate(config.filters):
        about = entry(name)
        tell(f"flying {name}", (number + 0.2) / (len(config.filters) + 0.2))
        own = (contestants or {}).get(name)
        contestant = (
            own(starts) if own else build(name, flight, starts, config.tuning.get(name, {}))
        )
        row: dict[str, Any] = {"filter": name, "title": about.title, "role": about.role}
        try:
            run = run_filter(
                contestant.filter, contestant.start, flight.times, z, flight.used, flight.truth
            )
        except NumericalError as error:
            rows.append(row | {"failure": str(error)})
            continue
        made, numbers = _judge(flight, contestant, run, name, about.title, about.role)
        flown.append(made)
        rows.append(row | numbers | {"failure": ""})
    scale = np.repeat([flight.scale.length, flight.scale.speed], 3)
    floor = floor * scale * flight.free
    counted = flight.settled
    return NavigationResult(
        config,
        flight,
        tuple(flown),
        pd.DataFrame(rows),
        floor,
        _rms(floor[counted, :3]),
        _rms(floor[counted, 3:]),
        collect_provenance(config.hash, config.seed),
        notes,
    )


def _judge(
    flight: Flight, contestant: Contestant, run: FilterRun, name: str, title: str, role: str
) -> tuple[Flown, dict[str, Any]]:
    scale, counted = flight.scale, flight.settled
    error = run.mean[:, :, :6] - flight.truth[:, None]
    error[..., :3] *= scale.length
    error[..., 3:] *= scale.speed
    distance = np.linalg.norm(error[..., :3], axis=2)
    speed = np.linalg.norm(error[..., 3:], axis=2)
    stated = (
        np.sqrt((run.sigma[..., :3][..., flight.free[:3]] ** 2).sum(axis=2).mean(axis=1))
        * scale.length
    )
    first = int(np.argmax(flight.times >= flight.settle))
    judged = consistency(run, states=int(flight.free.sum()), start=first)
    assert judged.nees is not None
    assert judged.nees_bounds is not None
    assert run.nees is not None
    numbers: dict[str, Any] = {
        "position_rmse_m": _rms(error[counted, :, :3]),
        "velocity_rmse_m_s": _rms(error[counted, :, 3:]),
        "mean_position_error_m": float(distance[counted].mean()),
        "mean_velocity_error_m_s": float(speed[counted].mean()),
        "mean_position_sigma_m": float(stated[counted].mean()),
    }
    for phase in flight.phases:
        inside = flight.during(phase)
        numbers[f"max_in_{phase}_m"] = float(distance[inside].max(axis=0).mean())
        numbers[f"sigma_in_{phase}_m"] = float(stated[inside].max())
    nees = run.nees.mean(axis=1)
    inside_bounds = (nees >= judged.nees_bounds[0]) & (nees <= judged.nees_bounds[1])
    numbers |= {
        "nees": float(nees[counted].mean()),
        "nees_inside": float(inside_bounds[counted].mean()),
        "nis": judged.nis_mean,
    }
    estimate = None
    if contestant.disturbance is not None:
        believed = contestant.disturbance(run)
        wrong = (believed - flight.disturbance[:, None]) * scale.acceleration
        for axis, values in zip(flight.axes, np.moveaxis(wrong[counted], -1, 0), strict=True):
            numbers[f"disturbance_{axis}_m_s2"] = float(np.sqrt((values**2).mean()))
        numbers["disturbance_rmse_m_s2"] = _rms(wrong[counted])
        estimate = believed[:, 0] * scale.acceleration
    numbers["us_per_step"] = 1e6 * run.seconds_per_step
    units = np.repeat([scale.length, scale.speed], 3)
    made = Flown(
        name,
        title,
        role,
        np.sqrt((distance**2).mean(axis=1)),
        np.sqrt((speed**2).mean(axis=1)),
        stated,
        error[:, 0],
        run.sigma[:, 0, :6] * units,
        estimate,
        nees,
        judged.nees_bounds,
        judged.verdict,
    )
    return made, numbers


def _rms(vectors: Any) -> float:
    """Root mean square of the length of vectors (..., 3)."""
    return float(np.sqrt((vectors**2).sum(axis=-1).mean()))
