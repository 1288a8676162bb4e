"""From a sweep file to the list of its runs: every one resolved, validated and named."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from unmodeled.core.errors import ConfigError
from unmodeled.core.seeds import Streams
from unmodeled.datasets.initial_conditions import SCREENING_PERIODS
from unmodeled.models.learned import learner_class
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.sweep.axes import combinations, put
from unmodeled.pipeline.sweep.orbit_list import OrbitList, draw_orbits, read_orbits
from unmodeled.pipeline.sweep.run_config import RunConfig, Value
from unmodeled.pipeline.sweep.run_id import canonical, cell_id, digest, run_id
from unmodeled.pipeline.sweep.sweep_config import InitialConditions, SweepConfig

__all__ = ["ListRequest", "Plan", "make_plan"]


@dataclass(frozen=True)
class ListRequest:
    """Which list of initial conditions a part of the grid needs.

    Parameters
    ----------
    body : str
        Body card.
    ranges : dict
        Ranges of the elements that differ from the paper's.
    periods : float
        Kepler periods without collision: the longest in the whole grid, 50 at least.
    given : InitialConditions
        Count, seed and number of extrapolation orbits, or a file.
    """

    body: str
    ranges: dict[str, Any]
    periods: float
    given: InitialConditions

    @property
    def key(self) -> str:
        """Name of the list in a store; the count is not part of it, so that a list can grow."""
        kept = self.given.model_dump(exclude={"count"})
        return f"{Path(self.body).stem}-{digest([self.body, self.ranges, self.periods, kept])[:8]}"

    def make(self) -> OrbitList:
        """Read or draw the list."""
        if self.given.file is not None:
            return read_orbits(Path(self.given.file))
        assert self.given.count is not None  # SweepConfig.resolve: count or file
        return draw_orbits(
            self.body,
            self.given.count,
            seed=self.given.seed,
            others=self.given.others,
            ranges=self.ranges,
            periods=self.periods,
        )


@dataclass(frozen=True)
class Plan:
    """All runs of a sweep.

    Parameters
    ----------
    config : SweepConfig
        What it was made from.
    runs : tuple of RunConfig
        In the order of the grid, initial conditions fastest; no id twice.
    lists : dict of str to OrbitList
        The lists of initial conditions by their key.
    merged : int
        Points of the grids that mean the same run as another point.
    """

    config: SweepConfig
    runs: tuple[RunConfig, ...]
    lists: dict[str, OrbitList]
    merged: int

    def table(self) -> pd.DataFrame:
        """Return one row a run: id, initial condition, learner and the axes."""
        return pd.DataFrame(
            [{"id": r.id, "initial_condition": r.initial_condition, **r.axes} for r in self.runs]
        )


def make_plan(
    config: SweepConfig,
    folders: Sequence[Path] = (),
    stored: Callable[[ListRequest], OrbitList] = ListRequest.make,
) -> Plan:
    """Resolve every run of a sweep.

    Parameters
    ----------
    config : SweepConfig
        The sweep.
    folders : sequence of Path
        Where trajectory files are looked for.
    stored : callable
        Gives a list of initial conditions; a store gives those that it holds.

    Raises
    ------
    InputError
        If any run of the grid is not valid; the message names the values of the axes.
    """
    points = list(_points(config))
    resolved = [_resolve(content, point) for content, point in points]
    columns = list(dict.fromkeys(k for _, point in points for k in point if k != "learner"))
    longest = [SCREENING_PERIODS, *(p for c in resolved for p in c.data.periods() if p)]
    lists: dict[str, OrbitList] = {}
    runs: dict[str, RunConfig] = {}
    total = 0
    for (content, point), base in zip(points, resolved, strict=True):
        orbits = None
        if config.initial_conditions is not None:
            orbits = _list_for(base, config.initial_conditions, max(longest), lists, stored)
        learner = base.learners[0]
        axes: dict[str, Value] = {"learner": learner.label, "kind": learner.kind}
        axes |= {key: _shown(base, key) for key in columns}
        for index in range(len(orbits)) if orbits is not None else [None]:
            one = _run_config(content, base, orbits, index, point)
            identity = canonical(one, flights=config.flights, folders=folders)
            run = RunConfig(run_id(identity), cell_id(identity), one, index, axes, config.flights)
            runs.setdefault(run.id, run)
            total += 1
    return Plan(config, tuple(runs.values()), lists, total - len(runs))


def _points(config: SweepConfig) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Yield the content of a configuration and the values of the axes, for each point."""
    for grid in config.axes:
        base = copy.deepcopy(config.base)
        learners = base.pop("learners", None)
        axes = dict(grid)
        if "learner" not in axes:
            if not isinstance(learners, list) or not learners:
                raise ConfigError(
                    "the sweep names no learner", do="add the axis learner, or base.learners"
                )
            axes = {"learner": tuple(learners)} | axes
        for point in combinations(axes):
            content = copy.deepcopy(base)
            learner = copy.deepcopy(point["learner"])
            for key, value in point.items():
                if key.startswith("learner.") and isinstance(learner, dict):
                    learner[key.removeprefix("learner.")] = value
                elif key != "learner":
                    _put(content, key, value)
            yield content | {"learners": [learner]}, point


def _put(content: dict[str, Any], key: str, value: Any) -> None:
    try:
        put(content, key, value)
    except (AttributeError, TypeError) as error:
        raise ConfigError(f"base: {key.rpartition('.')[0]} is not a section") from error


def _resolve(content: dict[str, Any], point: dict[str, Any]) -> CharacterizationConfig:
    where = ", ".join(f"{k} {v}" for k, v in point.items() if k != "learner")
    return CharacterizationConfig.resolve(content, f"sweep at {where}" if where else "sweep")


def _list_for(
    base: CharacterizationConfig,
    given: InitialConditions,
    periods: float,
    lists: dict[str, OrbitList],
    stored: Callable[[ListRequest], OrbitList],
) -> OrbitList:
    data = base.data
    if not data.simulated:
        raise ConfigError(
            f"initial_conditions with data.trajectory {data.trajectory}",
            do="leave initial_conditions out: a measured trajectory brings its own orbit",
        )
    if data.orbit is not None:
        raise ConfigError(
            "initial_conditions and data.orbit", do="leave one of them out: both give the orbit"
        )
    request = ListRequest(base.body, dict(data.ranges), periods, given)
    if request.key not in lists:
        lists[request.key] = stored(request)
    found = lists[request.key]
    if data.extrapolation_orbits > found.others:
        raise ConfigError(
            f"data.extrapolation_orbits is {data.extrapolation_orbits} and each initial condition "
            f"has {found.others}",
            do=f"set initial_conditions.others to {data.extrapolation_orbits}",
        )
    return found


def _run_config(
    content: dict[str, Any],
    base: CharacterizationConfig,
    orbits: OrbitList | None,
    index: int | None,
    point: dict[str, Any],
) -> CharacterizationConfig:
    """Return the configuration of one run: its orbits and its own seeds put in.

    The seed depends on the seed of the base and on the training orbit, not on the place in the
    grid: all learners and noise levels see the same draws on an orbit, which is what makes their
    comparison a paired one.
    """
    data: dict[str, Any] = {}
    seed = base.seed
    if orbits is not None and index is not None:
        elements = orbits.orbits[index]
        others = elements[1 : 1 + base.data.extrapolation_orbits]
        data = {"orbit": elements[0], "other_orbits": others, "extrapolation_orbits": 1}
        seed = Streams(base.seed).integer(f"run.{digest(elements[0])}")
    learner = dict(content["learners"][0])
    given = learner.get("params", learner)
    if "random_state" in learner_class(learner["kind"]).default_params():
        random_state = Streams(seed).integer("learner") >> 1  # torch takes 31 bits everywhere
        learner |= {"random_state": random_state} if "random_state" not in given else {}
    changed = content | {"learners": [learner], "seed": seed}
    if data:
        changed["data"] = dict(content.get("data") or {}) | data
    return _resolve(changed, point)


def _shown(config: CharacterizationConfig, key: str) -> Value:
    """Return the resolved value of an axis as a cell of a table."""
    if key.startswith("learner."):
        learner = config.learners[0]
        name = key.removeprefix("learner.")
        value: Any = learner.params.get(name, getattr(learner, name, None))
    else:
        value = config.as_dict()
        for part in key.split("."):
            value = value.get(part) if isinstance(value, dict) else None
    return value if isinstance(value, float | int | str | bool | None) else json.dumps(value)
