"""One part of a sweep for each job of a job array."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.sweep.run_config import RunConfig

__all__ = ["Shard"]

# Enough blocks that slow and fast cells are spread over all shards, large enough to be batches.
_BLOCKS_A_SHARD = 4
_LARGEST_BLOCK = 100


@dataclass(frozen=True)
class Shard:
    """Part ``index`` of ``count``, counted from 1.

    Examples
    --------
    >>> Shard.parse("2/5")
    Shard(index=2, count=5)
    """

    index: int
    count: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read ``i/n``.

        Raises
        ------
        ConfigError
            If it is not two whole numbers, 1 <= i <= n.
        """
        match = re.fullmatch(r"(\d+)/(\d+)", text.strip())
        if match is None or not 1 <= int(match[1]) <= int(match[2]):
            raise ConfigError(
                f'--shard "{text}"',
                allowed="i/n with 1 <= i <= n, e.g. 1/8",
                do="job arrays that count from 0 need i + 1",
            )
        return cls(int(match[1]), int(match[2]))

    @property
    def name(self) -> str:
        """Name of its lock."""
        return f"{self.index}-of-{self.count}"

    def of(self, runs: Sequence[RunConfig]) -> list[RunConfig]:
        """Return its part of the runs; the parts of all shards are all runs, each once.

        It depends on the whole list only, not on what is finished.
        """
        cells: dict[str, list[RunConfig]] = {}
        for run in runs:
            cells.setdefault(run.cell, []).append(run)
        ordered = [run for cell in cells.values() for run in cell]
        size = min(max(1, len(ordered) // (_BLOCKS_A_SHARD * self.count)), _LARGEST_BLOCK)
        return [run for k, run in enumerate(ordered) if k // size % self.count == self.index - 1]
