"""The commands of sweeps: `sweep`, `resume`, `status`, `export`."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from unmodeled.cli.report import write_page
from unmodeled.cli.tools import AsJson, DataFolder, app, data_folders, errors, progress

__all__ = ["export", "resume", "status", "sweep"]

Folder = Annotated[Path, typer.Argument(help="Folder of a sweep, e.g. runs/neamati-fig12.")]
Workers = Annotated[int, typer.Option("--workers", help="Processes, one thread each.")]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", help="Dask scheduler, e.g. tcp://node:8786.")
]
ShardOption = Annotated[
    str | None, typer.Option("--shard", help="i/n: only this part, for a job array.")
]
BatchSize = Annotated[int, typer.Option("--batch-size", help="Most runs of one batch.")]
Device = Annotated[str, typer.Option("--device", help="Where to train: cpu or cuda.")]


@app.command()
def sweep(
    config: Annotated[Path, typer.Argument(help="Sweep file, e.g. sweeps/neamati-fig12.yaml.")],
    out: Annotated[Path | None, typer.Option("--out", help="Store; default runs/NAME.")] = None,
    data: DataFolder = None,
    workers: Workers = 1,
    scheduler: Scheduler = None,
    shard: ShardOption = None,
    batch_size: BatchSize = 20,
    device: Device = "cpu",
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print count, expected time and memory only.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Run a grid of models, noise, data volumes and initial conditions; resumable at any moment."""
    folders = data_folders(data)
    if dry_run:
        _dry_run(config, out, folders, workers, as_json)
        return
    _run(config, out, folders, workers, scheduler, shard, batch_size, device, as_json)


@app.command()
def resume(
    folder: Folder,
    data: DataFolder = None,
    workers: Workers = 1,
    scheduler: Scheduler = None,
    shard: ShardOption = None,
    batch_size: BatchSize = 20,
    device: Device = "cpu",
    as_json: AsJson = False,
) -> None:
    """Go on with a sweep that was stopped; nothing finished is computed again."""
    _existing(folder)
    _run(folder, None, data_folders(data), workers, scheduler, shard, batch_size, device, as_json)


@app.command()
def status(folder: Folder, as_json: AsJson = False) -> None:
    """Say how far a sweep is, and what is left."""
    _existing(folder)
    from unmodeled.pipeline.sweep.status import status as status_of
    from unmodeled.pipeline.sweep.sweep import open_sweep

    _print_status(status_of(open_sweep(folder)), as_json)


@app.command()
def export(
    folder: Folder,
    out: Annotated[Path, typer.Option("--out", help="File: .parquet, .csv or .json.")],
) -> None:
    """Write the finished runs of a sweep as one table."""
    _existing(folder)
    from unmodeled.pipeline.sweep.status import export as write
    from unmodeled.pipeline.sweep.sweep import open_sweep

    count = write(open_sweep(folder), out)
    print(f"{out}: {count} runs")


def _existing(folder: Path) -> None:
    from unmodeled.pipeline.sweep.store import Store

    Store(folder).require()


def _run(
    config: Path,
    out: Path | None,
    folders: list[Path],
    workers: int,
    scheduler: str | None,
    shard: str | None,
    batch_size: int,
    device: str,
    as_json: bool,
) -> None:
    from unmodeled.pipeline.sweep.status import status_of
    from unmodeled.pipeline.sweep.sweep import open_sweep, sweep

    opened = None
    with _stoppable(lambda: opened.store.folder if opened else None), progress() as bar:
        bar("planning", 0.0)
        opened = open_sweep(config, out, folders)

        def tell(finished: int, total: int) -> None:
            bar(f"{finished} of {total} runs", finished / max(total, 1))

        sweep(
            opened,
            workers=workers,
            scheduler=scheduler,
            shard=shard,
            batch_size=batch_size,
            device=device,
            tell=tell,
        )
    found = status_of(opened.plan, opened.store.finished())
    if found.finished == found.planned:  # of many shards the last writes the page
        write_page(opened)
    _print_status(found, as_json)
    if not as_json:
        folder = opened.store.folder
        print(f"table: unmodeled export {folder} --out {opened.plan.config.name}.csv")


@contextmanager
def _stoppable(folder: Any) -> Iterator[None]:
    """Answer Ctrl-C (130) and the SIGTERM of a batch system (143) with one sentence."""
    code = 130

    def terminated(*_: Any) -> None:
        nonlocal code
        code = 143
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, terminated)
    try:
        yield
    except KeyboardInterrupt:
        where = folder()
        errors.print(
            f"stopped; every finished run is kept. Go on with: unmodeled resume {where}"
            if where
            else "stopped; nothing was run",
            markup=False,
            soft_wrap=True,
        )
        raise SystemExit(code) from None
    finally:
        signal.signal(signal.SIGTERM, before)


def _dry_run(
    config: Path, out: Path | None, folders: list[Path], workers: int, as_json: bool
) -> None:
    from unmodeled.pipeline.sweep.grid import make_plan
    from unmodeled.pipeline.sweep.status import status_of
    from unmodeled.pipeline.sweep.store import Store
    from unmodeled.pipeline.sweep.sweep_config import load_sweep

    resolved = load_sweep(config)
    plan = make_plan(resolved, [*folders, config.parent])
    store = Store(out or Path("runs") / resolved.name)
    finished = store.finished() if store.journals.is_dir() else {}
    found = status_of(plan, finished)
    _print_status(found, as_json)
    if not as_json:
        hours = found.remaining.seconds / max(workers, 1) / 3600
        print(f"on {workers} worker(s) here: about {_duration(hours * 3600)}; nothing was run")


def _print_status(found: Any, as_json: bool) -> None:
    if as_json:
        print(json.dumps(found.as_json(), indent=2))
        return
    print(f"{found.finished} of {found.planned} runs are finished", end="")
    print(f", {found.failed} of them failed fits" if found.failed else "")
    if found.merged:
        print(f"{found.merged} points of the grid mean a run that another point means too")
    if found.other:
        print(f"{found.other} finished runs in the store belong to another grid")
    width = max(len(str(name)) for name in found.by_learner["learner"])
    print(f"{'learner':{width}}  planned  finished  failed  s a run")
    for row in found.by_learner.to_dict(orient="records"):
        seconds = row["seconds_per_run"]
        print(
            f"{row['learner']:{width}}  {row['planned']:7d}  {row['finished']:8d}"
            f"  {row['failed']:6d}  " + ("      -" if seconds != seconds else f"{seconds:7.2f}")
        )
    if found.finished < found.planned:
        print(found.remaining.sentence())


def _duration(seconds: float) -> str:
    from unmodeled.pipeline.sweep.cost_model import duration

    return duration(seconds)
