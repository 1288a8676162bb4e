"""Run a sweep, or the rest of one; the same call starts and resumes it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from unmodeled.core.errors import ConfigError, InputError
from unmodeled.core.provenance import collect_provenance
from unmodeled.pipeline.sweep.engine import run_batches
from unmodeled.pipeline.sweep.executors import Engine, dask_engine, inline_engine, process_engine
from unmodeled.pipeline.sweep.grid import ListRequest, Plan, make_plan
from unmodeled.pipeline.sweep.orbit_list import OrbitList, read_orbits
from unmodeled.pipeline.sweep.run_config import RunConfig
from unmodeled.pipeline.sweep.run_id import digest
from unmodeled.pipeline.sweep.runner import BatchRunner, RunBatch
from unmodeled.pipeline.sweep.shard import Shard
from unmodeled.pipeline.sweep.store import Store
from unmodeled.pipeline.sweep.sweep_config import SweepConfig, load_sweep
from unmodeled.pipeline.sweep.table import finished_table
from unmodeled.pipeline.yaml12 import read_yaml, yaml_text

__all__ = ["Opened", "open_sweep", "stored_list", "sweep"]

#: Told how many runs of how many are finished.
Tell = Callable[[int, int], None]


@dataclass(frozen=True)
class Opened:
    """A store with the plan that it is for.

    Parameters
    ----------
    store : Store
        The folder.
    plan : Plan
        All runs.
    folders : tuple of Path
        Where data files are looked for.
    """

    store: Store
    plan: Plan
    folders: tuple[Path, ...]

    def table(self) -> pd.DataFrame:
        """Return the finished runs, see `finished_table`."""
        return finished_table(self.plan, self.store.finished())


def sweep(
    config: Opened | SweepConfig | dict[str, Any] | Path | str,
    out: Path | str | None = None,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    shard: Shard | str | None = None,
    folders: Sequence[Path] = (),
    run_batch: RunBatch | None = None,
    batch_size: int = 20,
    device: str = "cpu",
    tell: Tell | None = None,
) -> pd.DataFrame:
    """Run all runs of a sweep that are not finished yet.

    Parameters
    ----------
    config : SweepConfig, dict, path or Opened
        The sweep; a path may also be the folder of a sweep that is to go on.
    out : path, optional
        The store; ``runs/NAME`` by default. Runs that it holds already are not run again, also
        when the grid has changed: they are known by what they are, not by their place.
    workers : int
        1: in this process; more: so many processes, one thread each.
    scheduler : str, optional
        Address of a Dask scheduler, in place of processes.
    shard : Shard or str, optional
        Only this part (``"i/n"``), beside other processes that run the other parts.
    folders : sequence of Path
        Where data files are looked for.
    run_batch : callable, optional
        The runner; `BatchRunner` by default.
    batch_size : int
        Most runs of one batch, the unit of work. It changes no result.
    device : str
        Where `BatchRunner` trains: ``cpu``, or ``cuda`` where torch finds a graphics card.
    tell : callable, optional
        Told how many runs of how many are finished.

    Returns
    -------
    DataFrame
        All finished runs, one row each: `finished_table`.

    Raises
    ------
    InputError
        Bad grid, busy or full store, no scheduler.
    SweepError
        If some batches failed for unexpected reasons; the rest is kept.
    """
    if batch_size < 1:
        raise ConfigError(f"batch_size is {batch_size}", allowed="1 or more")
    part = Shard.parse(shard) if isinstance(shard, str) else shard
    engine = _engine(workers, scheduler)
    opened = config if isinstance(config, Opened) else open_sweep(config, out, folders)
    runs = part.of(opened.plan.runs) if part else list(opened.plan.runs)
    store = opened.store
    with store.lock(part.name if part else ""):
        if part is None:
            store.compact()
            store.forget_started()
        finished = store.finished()
        pending = [run for run in runs if run.id not in finished]
        runner = run_batch or BatchRunner(opened.folders, device)
        report = _reporter(tell, len(runs), len(runs) - len(pending))
        run_batches(store, _batches(pending, batch_size), runner, engine, report)
        _check_all_there(store, runs)
        if part is None:
            store.compact()
    if part is not None:
        with suppress(InputError), store.lock():  # the last shard compacts
            store.compact()
    return opened.table()


def open_sweep(
    config: SweepConfig | dict[str, Any] | Path | str,
    out: Path | str | None = None,
    folders: Sequence[Path] = (),
) -> Opened:
    """Make or open the store of a sweep, and plan it.

    Parameters
    ----------
    config, out, folders
        As for `sweep`.

    Raises
    ------
    InputError
        As `sweep`.
    """
    if isinstance(config, Path | str) and Path(config).is_dir():
        out = Path(config)
        existing = Store(out)
        existing.require()
        content = read_yaml(existing.sweep)
        folders = [*folders, *(Path(f) for f in content.pop("folders", []))]
        config = SweepConfig.resolve(content, str(existing.sweep))
    elif isinstance(config, Path | str):
        folders = [*folders, Path(config).parent]
        config = load_sweep(config)
    elif isinstance(config, dict):
        config = SweepConfig.resolve(config)
    store = Store(out if out is not None else Path("runs") / config.name)
    new = not store.folder.exists()
    store.create()
    try:
        plan = make_plan(config, folders, stored_list(store))
    except BaseException:
        if new:
            store.remove_empty()
        raise
    absolute = tuple(dict.fromkeys(Path(f).resolve() for f in folders))
    _write_identity(store, plan, absolute)
    return Opened(store, plan, absolute)


def stored_list(store: Store) -> Callable[[ListRequest], OrbitList]:
    """Return a function that gives the list of initial conditions that a store holds.

    A list that is asked to be longer than it is is drawn again and must begin with what is
    stored; one that is not there is drawn and stored.
    """

    def get(request: ListRequest) -> OrbitList:
        path = store.folder / f"initial-conditions-{request.key}.csv"
        held = read_orbits(path) if path.exists() else None
        count = request.given.count
        if held is not None and (count is None or count <= len(held)):
            return held if count is None else held.first(count)
        made = request.make()
        if held is not None and made.first(len(held)).hash != held.hash:
            raise InputError(
                f"{path} is not the beginning of the longer list that this installation draws",
                do="start a new store with another --out",
            )
        made.write(path)
        return made

    return get


def _write_identity(store: Store, plan: Plan, folders: Sequence[Path]) -> None:
    content = plan.config.as_dict()
    record = collect_provenance(digest(content), int(plan.config.base.get("seed", 1))).as_dict()
    record["initial_conditions"] = {key: orbits.hash for key, orbits in plan.lists.items()}
    store.replace("provenance.json", json.dumps(record, indent=2) + "\n")
    content["folders"] = [str(f) for f in folders]
    store.replace(store.sweep.name, yaml_text(content))


def _engine(workers: int, scheduler: str | None) -> Engine:
    if scheduler is not None:
        return dask_engine(scheduler)
    return inline_engine() if workers == 1 else process_engine(workers)


def _batches(runs: Sequence[RunConfig], size: int) -> list[tuple[RunConfig, ...]]:
    """Return runs in batches of one cell each, ``size`` runs at most."""
    cells: dict[str, list[RunConfig]] = {}
    for run in runs:
        cells.setdefault(run.cell, []).append(run)
    return [tuple(c[k : k + size]) for c in cells.values() for k in range(0, len(c), size)]


def _reporter(tell: Tell | None, total: int, already: int) -> Callable[[int], None]:
    count = already

    def report(finished: int) -> None:
        nonlocal count
        count += finished
        if tell is not None and finished:
            tell(min(count, total), total)

    if tell is not None:
        tell(already, total)
    return report


def _check_all_there(store: Store, runs: Sequence[RunConfig]) -> None:
    """Compare with what the disk shows here: a worker elsewhere wrote it."""
    finished = store.finished()
    missing = sum(run.id not in finished for run in runs)
    if missing:
        raise InputError(
            f"{missing} runs that workers finished are not seen in {store.folder}",
            do="check that all workers see the same disk, then go on with: unmodeled resume FOLDER",
        )
