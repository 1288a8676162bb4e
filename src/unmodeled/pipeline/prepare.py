"""From a configuration to learning data: simulate orbits, or read them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
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
from unmodeled.datasets.truth_field import (
    hidden_masses,
    mascon_field,
    polyhedron_field,
    shape_field,
    shape_tesseral_field,
    tesseral_field,
)
from unmodeled.models.learned import NoiseLevel
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.estimated_spin import SpinEstimate, estimate_spin
from unmodeled.pipeline.extra_effects import (
    extra_effects,
    measured_tracks,
    sun_of,
    tracks_for,
    with_extra_effects,
)

__all__ = ["SAMPLES_PER_PERIOD", "Simulated", "find_trajectory", "prepare", "simulate"]

#: Of [Neamati2022] section IV.B.
SAMPLES_PER_PERIOD = 25
#: The true field (SI), the orbits, and facts for the report.
Simulated: TypeAlias = tuple[Dynamics, SimulatedOrbits, dict[str, Any]]


def prepare(
    config: CharacterizationConfig,
    folders: Sequence[Path] = (),
    simulated: Callable[..., Simulated] | None = None,
) -> LearningData:
    """Make the learning data of a configuration.

    Parameters
    ----------
    config : CharacterizationConfig
        Resolved configuration.
    folders : sequence of Path
        Where trajectory files with a relative path are looked for, in this order.
    simulated : callable, optional
        In place of `simulate`, e.g. one that remembers orbits: many runs share them. It is
        given configuration and body, and knows the folders itself.

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
        dynamics, orbits, facts = (simulated or partial(simulate, folders=folders))(config, body)
        turning = config.data.field
        beside = config.data.effects is not None
        # Remembered orbits may be those of learners without the Sun: it is asked for here too.
        make = partial(
            make_learning_data,
            orbits.orbits,
            orbits.periods,
            units,
            noise,
            streams,
            interpolation_share=share,
            true_field=None if beside else dynamics.acceleration,
            true_force=dynamics.acceleration if beside else None,
            sun=sun_of(dynamics.tracks or tracks_for(config, body, None)),
            training_orbits=config.data.training_orbits,
            spin_rate=0.0 if turning is None else body.spin_rate,
        )
        frame = "inertial" if turning is None else turning.frame
        if config.data.spin == "known":
            return make(facts=facts, frame=frame)
        found = _estimated(make(frame="inertial"), config, body)
        facts = facts | {
            "axes of the samples": f"body-fixed, with the estimated spin: {found}",
            "estimated - true spin rate, sigma": (found.rate - body.spin_rate) / found.sigma,
        }
        return make(facts=facts, frame=frame, axes_rate=found.rate)
    measured, periods, facts = _measured(config, body, folders)
    return make_learning_data(
        measured,
        periods,
        units,
        noise,
        streams,
        interpolation_share=share,
        facts=facts,
        sun=sun_of(measured_tracks(config, body, measured)),
    )


def _estimated(data: LearningData, config: CharacterizationConfig, body: Body) -> SpinEstimate:
    """Return the spin rate that the observed training samples, inertial, show."""
    s, units = data.train, data.units
    order = np.argsort(s.times)
    positions = s.observed_positions[order] * units.length
    seen = Trajectory(
        s.times[order],
        positions,
        np.zeros_like(positions),  # the estimate uses none
        s.observed_accelerations[order] * units.acceleration,
        source="the training samples",
    )
    rate = body.spin_rate
    low, high = sorted((0.9 * rate, 1.1 * rate))
    noise = data.noise
    found = estimate_spin(
        seen,
        rate_bracket=config.data.spin_bracket or (low, high),
        gm=body.gm,
        radius=body.brillouin_radius,
        noise=NoiseLevel(noise.state * units.length, noise.acceleration * units.acceleration),
    )
    if not found.observable:
        raise DataError(
            f"data.spin is estimate and {found}", do="change the data, or write data.spin: known"
        )
    return found


def simulate(
    config: CharacterizationConfig,
    body: Body | None = None,
    *,
    compare_integrators: bool = True,
    folders: Sequence[Path] = (),
) -> Simulated:
    """Propagate the training orbit and the extrapolation orbits of a configuration.

    ``compare_integrators`` false leaves out the RK4 orbit where heyoka makes the truth: nine
    tenths of the time, and no number but the difference changes. A field that turns, or has effects
    beside it, is never compared: the RK4 here knows no time and no velocity. ``folders`` are where
    ``data.field.file`` is looked for.

    Returns
    -------
    dynamics : Dynamics
        The true field, SI.
    orbits : SimulatedOrbits
        The training orbit first, further ones last.
    facts : dict
        For the report.
    """
    body = body or load_body(config.body)
    data = config.data
    found = extra_effects(config, body, folders)
    tracks = tracks_for(config, body, found)
    dynamics = with_extra_effects(_truth(config, body, folders), found, tracks)
    compare_integrators = compare_integrators and data.field is None and found is None
    radius = body.brillouin_radius
    train, extrapolation = data.periods()
    if train is None or extrapolation is None:
        raise AssertionError("a simulated orbit has its periods from the volume preset")
    screened = max(SCREENING_PERIODS, train, extrapolation)
    trained = data.training_orbits
    elements, states, tried = _initial_conditions(config, dynamics, radius, screened)
    orbits = simulate_orbits(
        dynamics,
        elements,
        states,
        radius,
        periods=[train] + [extrapolation] * (len(states) - trained) + [train] * (trained - 1),
        samples_per_period=data.samples_per_period or SAMPLES_PER_PERIOD,
        integrator=data.integrator,
        rk4_steps_per_period=data.rk4_steps_per_period,
        compare=compare_integrators,
    )
    low = np.flatnonzero(orbits.lowest_radius < radius)
    if len(low):  # the screening tolerance and RK4 leave room for a graze
        raise DataError(
            f"orbit {int(low[0])} comes down to {orbits.lowest_radius[low[0]]:.1f} m within the "
            f"simulated periods, below the Brillouin sphere ({radius:g} m)",
            do="use fewer periods, another seed or another orbit",
        )
    facts: dict[str, Any] = {
        "truth": " + ".join(e.name.replace("_", " ") for e in dynamics.effects),
        "integrator": data.integrator,
    }
    if data.field is not None:
        facts["axes of the samples"] = (
            f"{data.field.frame.replace('_', '-')}; the field turns with {body.spin_rate:.6g} rad/s"
        )
    if compare_integrators:
        name = f"largest RK4 - heyoka distance ({data.rk4_steps_per_period} steps a period), m"
        facts[name] = float(orbits.rk4_difference.max())
    if tried:
        facts["initial conditions drawn to find the collision-free ones"] = tried
    facts["elements"] = elements.to_dict(orient="records")
    return dynamics, orbits, facts


def _truth(config: CharacterizationConfig, body: Body, folders: Sequence[Path]) -> Dynamics:
    field = config.data.field
    if field is None:
        return gravity_of(body)
    if field.kind == "hidden_masses":
        return hidden_masses(body)
    if field.kind == "mascons":
        if field.masses is None:
            return mascon_field(body)
        return mascon_field(body, [(m.share, m.place) for m in field.masses])
    if field.shape is not None:
        make = shape_field if field.kind == "polyhedron" else shape_tesseral_field
        return make(body, field.shape, field.degree or (12 if field.kind == "polyhedron" else 8))
    assert field.file is not None  # the configuration checks it
    path = find_trajectory(field.file, folders, "data.field.file")
    if field.kind == "tesseral":
        return tesseral_field(body, path, field.degree)
    return polyhedron_field(body, path, field.scale, field.degree or 12)


def _initial_conditions(
    config: CharacterizationConfig, dynamics: Dynamics, radius: float, periods: float
) -> tuple[pd.DataFrame, Array, int]:
    """Elements and states of all orbits, given ones screened, and how many were drawn."""
    data = config.data
    own = [orbit for orbit in (data.orbit, *(data.other_orbits or ())) if orbit is not None]
    given = pd.DataFrame([orbit.model_dump() for orbit in own], columns=list(ELEMENT_NAMES))
    drawn = None
    count = data.training_orbits - 1
    if data.other_orbits is None:
        count += data.extrapolation_orbits + (data.orbit is None)
    if count:
        streams = Streams(config.seed)
        drawn = collision_free(dynamics, radius, count, streams, data.ranges, periods=periods)
    if not own:
        assert drawn is not None  # the training orbit at least
        return drawn.elements, drawn.states, drawn.tried
    states = require_collision_free(dynamics, given, radius, periods)
    if drawn is None:
        return given, states, 0
    elements = pd.concat([given, drawn.elements], ignore_index=True)
    return elements, np.vstack([states, drawn.states]), drawn.tried


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
    options = {"satellite": satellite} if satellite else {}
    return read_trajectory(find_trajectory(name, folders), **options)


def find_trajectory(name: str, folders: Sequence[Path], key: str = "") -> Path:
    """Return the file of that name in the first of ``folders`` that has it, or as it is.

    Raises
    ------
    ConfigError
        Naming where it was looked for.
    """
    path = Path(name).expanduser()
    candidates = [path] if path.is_absolute() else [f / path for f in folders] + [path]
    found = next((c for c in candidates if c.exists()), None)
    if found is None:
        raise ConfigError(
            f"no file {name} ({key})" if key else f"no trajectory file {name}",
            do="looked in "
            + ", ".join(str(c.parent) for c in candidates)
            + "; give the folder with --data"
            + ("" if key else ", or write data.trajectory: simulated"),
        )
    return found


def _refuse_impact(trajectory: Trajectory, body: Body) -> None:
    lowest = float(trajectory.radii.min())
    if lowest < body.brillouin_radius:
        raise DataError(
            f"{trajectory.source} comes down to {lowest:.6g} m from the centre of {body.title}, "
            f"below its Brillouin sphere ({body.brillouin_radius:g} m)",
            allowed="positions outside the Brillouin sphere",
            do="check the body and the unit of the positions",
        )
