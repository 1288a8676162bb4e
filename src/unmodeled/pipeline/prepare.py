"""From a configuration to learning data: simulate orbits, or read them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.seeds import Streams
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.bodies import Body, load_body
from unmodeled.datasets.elements import ELEMENT_NAMES
from unmodeled.datasets.initial_conditions import (
    SCREENING_PERIODS,
    collision_free,
    require_collision_free,
)
from unmodeled.datasets.learning_data import LearningData, make_learning_data
from unmodeled.datasets.readers import read_trajectory
from unmodeled.datasets.revolutions import first_revolutions, split_revolutions
from unmodeled.datasets.simulation import SimulatedOrbits, gravity_of, simulate_orbits
from unmodeled.datasets.trajectory import Trajectory
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.config import CharacterizationConfig

__all__ = ["prepare", "simulate"]

_SAMPLES_PER_PERIOD = 25


def prepare(config: CharacterizationConfig, folders: Sequence[Path] = ()) -> LearningData:
    """Make the learning data of a configuration.

    Parameters
    ----------
    config : CharacterizationConfig
        Resolved configuration.
    folders : sequence of Path
        Where trajectory files with a relative path are looked for, in this order.

    Raises
    ------
    InputError
        On any bad input: unknown body, colliding orbit, unreadable file, too few samples.
    """
    body = load_body(config.body)
    units = NormalisedUnits.of_body(body.gm, body.brillouin_radius)
    noise = config.noise.resolve(units)
    streams = Streams(config.seed)
    share = config.data.interpolation_share
    if config.data.simulated:
        dynamics, simulated, facts = simulate(config, body)
        return make_learning_data(
            simulated.orbits,
            simulated.periods,
            units,
            noise,
            streams,
            interpolation_share=share,
            true_field=dynamics.acceleration,
            facts=facts,
        )
    orbits, periods, facts = _measured(config, body, folders)
    return make_learning_data(
        orbits, periods, units, noise, streams, interpolation_share=share, facts=facts
    )


def simulate(
    config: CharacterizationConfig, body: Body | None = None
) -> tuple[Dynamics, SimulatedOrbits, dict[str, Any]]:
    """Propagate the training orbit and the extrapolation orbits of a configuration.

    Returns
    -------
    dynamics : Dynamics
        The true field, SI.
    orbits : SimulatedOrbits
        The training orbit first.
    facts : dict
        For the report.
    """
    body = body or load_body(config.body)
    data = config.data
    dynamics = gravity_of(body)
    radius = body.brillouin_radius
    train, extrapolation = data.periods()
    if train is None or extrapolation is None:
        raise AssertionError("a simulated orbit has its periods from the volume preset")
    count = data.extrapolation_orbits + (data.orbit is None)
    screened = max(SCREENING_PERIODS, train, extrapolation)
    drawn = collision_free(
        dynamics, radius, count, Streams(config.seed), data.ranges, periods=screened
    )
    elements, states = drawn.elements, drawn.states
    if data.orbit is not None:
        own = pd.DataFrame([data.orbit.model_dump()], columns=list(ELEMENT_NAMES))
        states = np.vstack([require_collision_free(dynamics, own, radius, screened), states])
        elements = pd.concat([own, elements], ignore_index=True)
    orbits = simulate_orbits(
        dynamics,
        elements,
        states,
        radius,
        periods=[train] + [extrapolation] * data.extrapolation_orbits,
        samples_per_period=data.samples_per_period or _SAMPLES_PER_PERIOD,
        integrator=data.integrator,
        rk4_steps_per_period=data.rk4_steps_per_period,
    )
    low = np.flatnonzero(orbits.lowest_radius < radius)
    if len(low):  # the screening tolerance and RK4 leave room for a graze
        raise DataError(
            f"orbit {int(low[0])} comes down to {orbits.lowest_radius[low[0]]:.1f} m within the "
            f"simulated periods, below the Brillouin sphere ({radius:g} m)",
            do="use fewer periods, another seed or another orbit",
        )
    facts = {
        "truth": " + ".join(e.name.replace("_", " ") for e in dynamics.effects),
        "integrator": data.integrator,
        f"largest RK4 - heyoka distance ({data.rk4_steps_per_period} steps a period), m": float(
            orbits.rk4_difference.max()
        ),
        "initial conditions drawn to find the collision-free ones": drawn.tried,
        "elements": elements.to_dict(orient="records"),
    }
    return dynamics, orbits, facts


def _measured(
    config: CharacterizationConfig, body: Body, folders: Sequence[Path]
) -> tuple[list[Trajectory], list[float], dict[str, Any]]:
    data = config.data
    whole = _read(data.trajectory, data.satellite, folders)
    _refuse_impact(whole, body)
    train_periods, extrapolation_periods = data.periods()
    facts: dict[str, Any] = {"file": whole.source, "epoch": whole.epoch} | whole.notes
    if whole.acceleration_sigma > 0:
        facts["error of the accelerations, m/s2 (one sigma)"] = whole.acceleration_sigma
    if data.extrapolation_trajectory is None:
        first, second, period = split_revolutions(
            whole,
            body.gm,
            train_periods=train_periods,
            extrapolation_periods=extrapolation_periods,
            samples_per_period=data.samples_per_period,
        )
        facts["extrapolation"] = "later revolutions of the same orbit"
        return [first, second], [period, period], facts
    other = _read(data.extrapolation_trajectory, data.satellite, folders)
    _refuse_impact(other, body)
    facts["extrapolation"] = other.source
    first, period = first_revolutions(whole, body.gm, train_periods, data.samples_per_period)
    second, other_period = first_revolutions(
        other, body.gm, extrapolation_periods, data.samples_per_period
    )
    return [first, second], [period, other_period], facts


def _read(name: str, satellite: str | None, folders: Sequence[Path]) -> Trajectory:
    path = Path(name).expanduser()
    candidates = [path] if path.is_absolute() else [f / path for f in folders] + [path]
    found = next((c for c in candidates if c.exists()), None)
    if found is None:
        raise ConfigError(
            f"no trajectory file {name}",
            do="looked in "
            + ", ".join(str(c.parent) for c in candidates)
            + "; give the folder with --data, or write data.trajectory: simulated",
        )
    options = {"satellite": satellite} if satellite else {}
    return read_trajectory(found, **options)


def _refuse_impact(trajectory: Trajectory, body: Body) -> None:
    lowest = float(trajectory.radii.min())
    if lowest < body.brillouin_radius:
        raise DataError(
            f"{trajectory.source} comes down to {lowest:.6g} m from the centre of {body.title}, "
            f"below its Brillouin sphere ({body.brillouin_radius:g} m)",
            allowed="positions outside the Brillouin sphere",
            do="check the body and the unit of the positions",
        )
