"""One run of a sweep, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:  # engine and store need no torch, and start in a tenth of the time without it
    from unmodeled.pipeline.config import CharacterizationConfig

__all__ = ["RunConfig", "RunResult", "Value"]

#: A cell of the final table.
Value: TypeAlias = float | int | str | bool | None


@dataclass(frozen=True)
class RunConfig:
    """One learner on one training orbit, resolved and validated.

    Parameters
    ----------
    id : str
        Hash of the canonical configuration; the same run has the same id in every sweep.
    cell : str
        What it shares with the runs that differ in initial condition and seed only: such runs
        can be trained together.
    config : CharacterizationConfig
        Exactly one learner.
    initial_condition : int or None
        Index into the shared list.
    axes : dict
        Value of each axis, for the table.
    flights : bool
        Whether orbits are flown with the learned model.
    """

    id: str
    cell: str
    config: CharacterizationConfig
    initial_condition: int | None = None
    axes: dict[str, Value] = field(default_factory=dict)
    flights: bool = False


@dataclass(frozen=True)
class RunResult:
    """What one run returns: its id and a flat row of numbers and words.

    Parameters
    ----------
    id : str
        Of the `RunConfig`.
    values : dict
        Columns and values; names that start with ``cost_`` may differ from run to run, all
        others depend on the configuration only.
    """

    id: str
    values: dict[str, Value]
