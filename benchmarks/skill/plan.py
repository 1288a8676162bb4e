"""The runs of the table: every learner, field, volume, level of noise and pair of orbits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from skill.fields import FIELDS, Field
from skill.learners import Row, learner_rows
from unmodeled.core.seeds import Streams
from unmodeled.models.learned import learner_class
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.sweep.cost_model import duration, expected_cost
from unmodeled.pipeline.sweep.grid import Plan
from unmodeled.pipeline.sweep.run_config import RunConfig
from unmodeled.pipeline.sweep.run_id import digest
from unmodeled.pipeline.sweep.sweep_config import SweepConfig

__all__ = ["FULL", "NOISE", "SMALL", "NotRun", "Settings", "make_runs"]

#: Part of every id: raise it when the same run starts to be measured in another way.
_FORMAT = 1
#: sigma_s, sigma_a, normalised units.
NOISE = (
    *((0.0, a) for a in (0.0, 0.1, 0.5, 1.0)),
    *((s, 0.0) for s in (0.05, 0.2, 1.0)),
)
#: Levels at which orbits are flown and learners are checked on training data held back.
FLOWN_NOISE = ((0.0, 0.0), (0.0, 0.1), (0.05, 0.0))
#: Periods after which flights are read.
FLIGHT_PERIODS = (1.0, 10.0)
_FIRST_SEED = 101
#: For training: 25 a period for 10 and 100 periods, without the 5 % held out.
_SAMPLES = {"low": 237, "moderate": 2375}


@dataclass(frozen=True)
class Volume:
    """How many pairs of orbits a volume of data gets.

    Parameters
    ----------
    most, least : int
        Pairs of a cheap learner, and of a slow one.
    flown : int
        Pairs whose orbits are flown.
    """

    most: int
    least: int
    flown: int


@dataclass(frozen=True)
class Settings:
    """A size of the table.

    Parameters
    ----------
    fields : tuple of str
        Names of `FIELDS`.
    volumes : dict of str to Volume
        By name of the volume.
    noise, flown_noise : tuple of (float, float)
        Levels, and those at which orbits are flown.
    allowance, patience : float
        Processor seconds of fits, by the cost model, that a learner may take on a volume with the
        most pairs, and with the least.
    """

    fields: tuple[str, ...]
    volumes: dict[str, Volume]
    noise: tuple[tuple[float, float], ...]
    flown_noise: tuple[tuple[float, float], ...]
    allowance: float
    patience: float


FULL = Settings(
    tuple(FIELDS),
    {"low": Volume(20, 5, 3), "moderate": Volume(5, 3, 1)},
    NOISE,
    FLOWN_NOISE,
    150.0,
    900.0,
)
SMALL = Settings(
    ("bennu-zonal", "two-mascons"),
    {"low": Volume(3, 1, 1)},
    ((0.0, 0.0), (0.0, 0.1)),
    ((0.0, 0.1),),
    5.0,
    5.0,
)


@dataclass(frozen=True)
class NotRun:
    """A learner that is not run on a volume, and why."""

    learner: str
    kind: str
    volume: str
    reason: str


def make_runs(settings: Settings, only: tuple[str, ...] = ()) -> tuple[Plan, list[NotRun]]:
    """Return the runs, cheapest volume first, and what is not run.

    How many pairs a learner gets depends on the built-in cost table only, so that the same
    installation always makes the same table. Pairs are those of the first seeds for everyone.

    Parameters
    ----------
    settings : Settings
        `FULL` or `SMALL`.
    only : tuple of str
        Kinds of learners; all if empty. Point mass and oracle always run.
    """
    runs: dict[str, RunConfig] = {}
    left_out: dict[tuple[str, str], NotRun] = {}
    for volume in settings.volumes:
        for name in settings.fields:
            field = FIELDS[name]
            for row in learner_rows(field):
                if only and not row.always and row.spec["kind"] not in only:
                    continue
                made = _pairs(settings, volume, field, row)
                if isinstance(made, NotRun):
                    left_out.setdefault((made.learner, volume), made)
                    continue
                for run in _cells(settings, volume, field, row, made):
                    runs.setdefault(run.id, run)
    plan = Plan(SweepConfig(name="skill"), tuple(runs.values()), {}, 0)
    return plan, list(left_out.values())


def _pairs(settings: Settings, volume: str, field: Field, row: Row) -> int | NotRun:
    """Return the number of pairs that the allowance pays for."""
    size, spec = settings.volumes[volume], row.spec
    if row.always:
        return size.most  # least squares of a few numbers, whatever its kind
    one = _run(volume, field, spec, (0.0, 0.0), _FIRST_SEED, full=False)
    cost = expected_cost(Plan(SweepConfig(name="one"), (one,), {}, 0), {})
    label = one.config.learners[0].label
    most = one.config.learners[0].params.get("max_samples")
    if most is not None and _SAMPLES[volume] > most:
        why = f"it takes at most {most:,} samples, here are {_SAMPLES[volume]:,}"
        return NotRun(label, spec["kind"], volume, why)
    if cost.unknown:
        if volume == "low":
            return size.least
        why = "the cost of a fit is not in the cost table of the package"
        return NotRun(label, spec["kind"], volume, why)
    if row.heavy:
        return size.least
    cells = len(settings.noise) * len(settings.fields)
    for count, limit in ((size.most, settings.allowance), (size.least, settings.patience)):
        if cost.seconds * cells * count <= limit:
            return count
    whole = cost.seconds * cells * size.least
    why = (
        f"{duration(cost.seconds)} a fit: {cells} cells of {size.least} pairs would take "
        f"{duration(whole)}, more than {settings.patience:g} s"
    )
    return NotRun(label, spec["kind"], volume, why)


def _cells(
    settings: Settings, volume: str, field: Field, row: Row, count: int
) -> Iterator[RunConfig]:
    flown = 0 if row.heavy else settings.volumes[volume].flown
    for noise in settings.noise:
        for k in range(count):
            full = k < flown and noise in settings.flown_noise
            yield _run(volume, field, row.spec, noise, _FIRST_SEED + k, full=full)


def _run(
    volume: str,
    field: Field,
    spec: dict[str, Any],
    noise: tuple[float, float],
    seed: int,
    *,
    full: bool,
) -> RunConfig:
    state, acceleration = noise
    learner = dict(spec)
    if "random_state" in learner_class(spec["kind"]).default_params():
        learner["random_state"] = Streams(seed).integer("learner") >> 1  # torch takes 31 bits
    data: dict[str, Any] = {
        "volume": volume,
        "extrapolation_periods": FLIGHT_PERIODS[-1],
        "ranges": field.ranges,
    }
    if field.data:
        data["field"] = field.data
    config = CharacterizationConfig.resolve(
        {
            "name": "skill",
            "seed": seed,
            "body": field.body,
            "data": data,
            "noise": {"state": state, "acceleration": acceleration},
            "learners": [learner],
            "flight": {"periods": list(FLIGHT_PERIODS), "orbits": 1},
        }
    )
    made = config.learners[0]
    params = {k: v for k, v in made.params.items() if k != "random_state"}
    # Not the id of a sweep: a configuration that gets new keys would make every run a new one.
    cell = [_FORMAT, field.name, field.data, field.ranges, volume]
    cell += [FLIGHT_PERIODS, noise, made.kind, made.baseline, params, full]
    return RunConfig(
        digest([cell, seed]),
        digest(cell),
        config,
        seed,
        {
            "learner": made.label,
            "kind": made.kind,
            "baseline": made.baseline,
            "field": field.name,
            "volume": volume,
            "sigma_s": state,
            "sigma_a": acceleration,
        },
        full,
    )
