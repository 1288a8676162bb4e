"""Forces beside the field of simulated orbits, and where the Sun stands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.elements import kepler_period
from unmodeled.datasets.initial_conditions import SCREENING_PERIODS, checked_ranges
from unmodeled.datasets.learning_data import SunDirection
from unmodeled.datasets.trajectory import Trajectory
from unmodeled.models.physics import Dynamics, Effect, Polyhedron
from unmodeled.models.physics.tracks import Tracks
from unmodeled.pipeline.cases.accepted_values import Surveyed
from unmodeled.pipeline.cases.known_effects import Known, read_known
from unmodeled.pipeline.cases.surroundings import Surroundings
from unmodeled.pipeline.config import CharacterizationConfig, DataConfig

__all__ = ["extra_effects", "measured_tracks", "sun_of", "tracks_for", "with_extra_effects"]

_SUN_INPUTS = {"sun_direction", "sun_cosine"}
#: Tracks reach this share beyond the longest orbit.
_MARGIN = 1.01


def extra_effects(
    config: CharacterizationConfig, body: Body, folders: Sequence[Path] = ()
) -> Known | None:
    """Return ``data.effects`` with their values, SI; None if there are none.

    Parameters
    ----------
    config : CharacterizationConfig
        Resolved configuration.
    body : Body
        Gives values that the entries do not.
    folders : sequence of Path
        The first is where files of effects are looked for.

    Raises
    ------
    ConfigError
        If a value is missing or has the wrong unit, an effect measures or is fitted instead of
        pushing, or the Sun is needed and there is no ``data.epoch``.
    """
    data = config.data
    if data.effects is None:
        return None
    craft = None if data.spacecraft is None else data.spacecraft.made()
    folder = folders[0] if folders else Path()
    try:
        found = read_known(data.effects, Surveyed(body, craft, data.epoch or ""), folder)
    except ConfigError as exc:
        text = exc.found.replace("known.", "data.effects.")
        hint = exc.do
        if craft is None and " needs " in text and any(n in text for n in ("srp_CrA_m", "drag_B")):
            hint = "give data.spacecraft, e.g. {mass: 1500 kg, area: 12 m2}"
        raise ConfigError(text, allowed=exc.allowed, do=hint) from exc
    if any(isinstance(effect, Polyhedron) for effect in found.effects):
        raise ConfigError(
            "data.effects holds the gravity of a shape",
            do="write it as data.field of kind polyhedron",
        )
    if found.instruments or found.estimate or not found.effects:
        raise ConfigError(
            "data.effects holds " + _wrong(found),
            allowed="forces with values",
            do="leave it out: these orbits are simulated, not measured or fitted",
        )
    if data.epoch is None and (asking := _asking(found.effects)):
        raise ConfigError(
            f"data.effects needs the place of {', '.join(asking)} and data.epoch is not given",
            do='write e.g. epoch: "2019-02-16T00:00:00 TDB" under data',
        )
    return found


def with_extra_effects(dynamics: Dynamics, found: Known | None, tracks: Tracks | None) -> Dynamics:
    """Return a true field with the forces beside it and what it knows of other bodies.

    Raises
    ------
    ConfigError
        If a force is in the field already.
    """
    if found is None and tracks is None:
        return dynamics
    effects, values = ((), {}) if found is None else (found.effects, found.values)
    return Dynamics(
        (*dynamics.effects, *effects),
        {**values, **dynamics.values},
        spinning=dynamics.system.spinning,
        tracks=tracks,
    )


def tracks_for(config: CharacterizationConfig, body: Body, found: Known | None) -> Tracks | None:
    """Return where other bodies are while simulated orbits last; None if nothing asks.

    Raises
    ------
    ConfigError
        If an input needs the Sun and ``data.epoch`` is not given, or a body cannot be placed.
    """
    asking = set(_asking(found.effects)) if found is not None else set()
    named = _sun_inputs(config)
    if named and config.data.epoch is None:
        raise ConfigError(
            f"input {named[0]} and data.epoch is not given",
            do='write e.g. epoch: "2019-02-16T00:00:00 TDB" under data',
        )
    # The Sun is there whatever the learners are: orbits are shared between them.
    if config.data.epoch is None:
        return None
    around = Surroundings(body, config.data.epoch, _axes(body))
    end = _MARGIN * _longest(config.data, body)
    return around.tracks(-0.01 * end, end, tuple(sorted(asking | {"sun"})))


def measured_tracks(
    config: CharacterizationConfig, body: Body, orbits: Sequence[Trajectory]
) -> Tracks | None:
    """Return where the Sun is during measured orbits; None if no learner asks.

    Raises
    ------
    ConfigError
        If the files give no epoch, or not the same one.
    """
    named = _sun_inputs(config)
    if not named:
        return None
    epochs = sorted({orbit.epoch for orbit in orbits})
    if len(epochs) > 1 or not epochs[0]:
        raise ConfigError(
            f"input {named[0]} and the files have " + ("two epochs" if epochs[0] else "no epoch"),
            allowed="files with one epoch, e.g. SP3 or OEM",
        )
    start = min(float(orbit.times[0]) for orbit in orbits)
    end = max(float(orbit.times[-1]) for orbit in orbits)
    return Surroundings(body, epochs[0], "icrf").tracks(start - 100.0, end + 100.0, ("sun",))


def sun_of(tracks: Tracks | None) -> SunDirection | None:
    """Return the direction to the Sun along inertial axes."""
    if tracks is None:
        return None

    def direction(times: Array) -> Array:
        towards = tracks.position("sun", times)
        unit: Array = towards / np.linalg.norm(towards, axis=1, keepdims=True)
        return unit

    return direction


def _axes(body: Body) -> Literal["icrf", "body_equator"]:
    return "icrf" if body.name == "earth" else "body_equator"


def _sun_inputs(config: CharacterizationConfig) -> list[str]:
    return sorted({n for learner in config.learners for n in learner.inputs} & _SUN_INPUTS)


def _asking(effects: Sequence[Effect]) -> list[str]:
    return sorted({name for effect in effects for name in effect.bodies})


def _wrong(found: Known) -> str:
    if found.instruments:
        return f"{found.instruments[0].name}, an effect of instruments"
    if found.estimate:
        return f"the free parameter {next(iter(found.estimate))}"
    return "no force"


def _longest(data: DataConfig, body: Body) -> float:
    """Return the longest time that an orbit is followed, s."""
    given = [o.semi_major_axis for o in (data.orbit, *(data.other_orbits or ())) if o is not None]
    axes = [*given, checked_ranges(data.ranges)["semi_major_axis"][1]]
    periods = max(SCREENING_PERIODS, *(p for p in data.periods() if p))
    size = np.array([max(axes) * body.brillouin_radius])
    return float(periods * kepler_period(size, body.gm)[0])
