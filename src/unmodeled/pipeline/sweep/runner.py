"""The seam between a sweep and the training: anything that turns runs into results."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from unmodeled.core.errors import DataError, NumericalError, OrbitError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.learning_data import LearningData
from unmodeled.pipeline.batch_characterize import characterize_stacks
from unmodeled.pipeline.characterize import evaluate
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.cost import peak_memory
from unmodeled.pipeline.prepare import Simulated, prepare, simulate
from unmodeled.pipeline.sweep.row import row_of
from unmodeled.pipeline.sweep.run_config import RunConfig, RunResult, Value
from unmodeled.pipeline.sweep.run_id import canonical, digest
from unmodeled.pipeline.sweep.worker import RunBatch

__all__ = ["BatchRunner", "PlainRunner", "RunBatch", "learning_data", "remembered"]

# Orbits do not depend on learner or noise, so each worker makes them once for many cells; a low
# volume is 30 kB, a moderate one 0.3 MB.
_REMEMBERED = 128
_orbits: OrderedDict[str, Simulated] = OrderedDict()


@dataclass(frozen=True)
class BatchRunner:
    """Networks of a cell side by side, processes and the rest one by one: what `sweep` uses.

    The values of a run are those of `PlainRunner`, to the last bit on a processor, whatever else
    is in the batch. ``cost_total_s`` and ``cost_cpu_s`` are shares of what a stack took.

    Parameters
    ----------
    folders : tuple of Path
        Where trajectory files are looked for.
    device : str
        ``cpu``, or ``cuda`` where torch has one; there, sums are rounded in another order.
    """

    folders: tuple[Path, ...] = ()
    device: str = "cpu"

    def __call__(self, runs: Sequence[RunConfig]) -> Iterator[RunResult]:
        """Yield the results of one stack after the other."""
        stacks = characterize_stacks(
            [run.config for run in runs],
            self.folders,
            simulated=partial(remembered, folders=self.folders),
            flights=any(run.flights for run in runs),  # one setting of the whole sweep
            device=self.device,
        )
        waiting = iter(runs)
        start, cpu = time.perf_counter(), time.process_time()
        for results in stacks:
            share: dict[str, Value] = {
                "cost_total_s": (time.perf_counter() - start) / len(results),
                "cost_cpu_s": (time.process_time() - cpu) / len(results),
                "cost_peak_bytes": peak_memory(),
            }
            for result in results:
                run = next(waiting)
                yield RunResult(run.id, row_of(result, run.config) | share)
            start, cpu = time.perf_counter(), time.process_time()


@dataclass(frozen=True)
class PlainRunner:
    """One run after the other, with the code of `characterize`: the reference for faster runners.

    A runner is called with the runs of one batch (`RunConfig`, all of one cell) and returns or
    yields one `RunResult` for each, in any order. The values of a run must not depend on what
    else is in its batch. A runner is pickled: it holds settings, not state.

    Parameters
    ----------
    folders : tuple of Path
        Where trajectory files are looked for.
    """

    folders: tuple[Path, ...] = ()

    def __call__(self, runs: Sequence[RunConfig]) -> Iterator[RunResult]:
        """Yield results one by one."""
        for run in runs:
            start, cpu = time.perf_counter(), time.process_time()
            row = self._row(run)
            row["cost_total_s"] = time.perf_counter() - start
            row["cost_cpu_s"] = time.process_time() - cpu
            row["cost_peak_bytes"] = peak_memory()
            yield RunResult(run.id, row)

    def _row(self, run: RunConfig) -> dict[str, Value]:
        with one_thread():
            try:
                data = learning_data(run.config, self.folders)
                result = evaluate(run.config.learners[0], data, run.config, flights=run.flights)
            except (DataError, OrbitError, NumericalError) as error:
                return {"failure": str(error)}  # the run's own answer, the same wherever it runs
            return row_of(result, run.config)


def learning_data(config: CharacterizationConfig, folders: Sequence[Path] = ()) -> LearningData:
    """Make the data of a run; orbits that this process made before are taken from memory.

    The RK4 orbit of the paper is not propagated beside the true one, unless it is the truth.
    """
    return prepare(config, folders, partial(remembered, folders=folders))


def remembered(
    config: CharacterizationConfig, body: Body, folders: Sequence[Path] = ()
) -> Simulated:
    """Do what `simulate` does, once for all runs of this process on the same orbits."""
    content = canonical(config, folders=folders)
    drawn = config.data.other_orbits is None or config.data.training_orbits > 1
    seed = content["seed"] if drawn else None
    key = digest([content["body"], content["data"], seed])
    if key not in _orbits:
        _orbits[key] = simulate(config, body, compare_integrators=False, folders=folders)
        if len(_orbits) > _REMEMBERED:
            _orbits.popitem(last=False)
    _orbits.move_to_end(key)
    return _orbits[key]
