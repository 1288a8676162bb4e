"""The commands `report` and `reproduce`: pages and figures from runs."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path
from typing import Annotated, Any

import typer

from unmodeled.cli.tools import app, errors, progress, stoppable
from unmodeled.core.errors import ConfigError, nearest

__all__ = ["METRICS", "report", "reproduce", "write_page"]

#: Words for what learners are compared by.
METRICS = {"robustness": "extrapolation_median", "safety": "interpolation_median"}
_WIDTH = 96


@app.command()
@stoppable
def report(
    folder: Annotated[Path, typer.Argument(help="Folder of a sweep, e.g. runs/neamati-fig12.")],
    by: Annotated[
        str, typer.Option("--by", help="robustness (other orbits) or safety (the same orbit).")
    ] = "robustness",
) -> None:
    """Write the page of a sweep from its finished runs."""
    if by not in METRICS:
        raise ConfigError(f"--by {by}", allowed=", ".join(METRICS), do=nearest(by, METRICS))
    from unmodeled.pipeline.sweep.store import Store
    from unmodeled.reports.sweep_page import write_sweep_report

    Store(folder).require()
    print(write_sweep_report(folder, METRICS[by]))


def write_page(opened: Any, metric: str = "extrapolation_median") -> None:
    """Write the page at the end of another command, and say where on stderr."""
    from unmodeled.reports.sweep_page import write_sweep_report

    path = write_sweep_report(opened, metric)
    errors.print(f"wrote {path}", markup=False, soft_wrap=True)


@app.command()
@stoppable
def reproduce(
    name: Annotated[str, typer.Argument(help="A figure, e.g. neamati-fig12; or: list.")],
    small: Annotated[bool, typer.Option("--small", help="A smaller grid, in minutes.")] = False,
    store: Annotated[
        Path | None, typer.Option("--store", help="Folder of a sweep to read; nothing is run.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder; default runs/reproduce/NAME.")
    ] = None,
    workers: Annotated[int, typer.Option("--workers", help="Processes, one thread each.")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Draw a figure of a source paper again and print the paper's statements beside ours."""
    from unmodeled.reports.reproduction.published import published_figure, published_names

    if name == "list":
        rows = [published_figure(n) for n in published_names()]
        if as_json:
            print(
                json.dumps([{"name": f.name, "source": f.source, "title": f.title} for f in rows])
            )
            return
        width = max(len(f.name) for f in rows)
        for f in rows:
            print(f"{f.name:{width}}  {f.source} {f.key}: {f.title}")
        return
    published_figure(name)  # an unknown name is refused before torch loads
    from unmodeled.reports.reproduction.reproduce import reproduce as run

    with progress() as bar:
        bar("starting", 0.0)

        def tell(finished: int, total: int) -> None:
            bar(f"{finished} of {total} runs", finished / max(total, 1))

        found = run(name, small=small, store=store, out=out, workers=workers, tell=tell)
    if as_json:
        print(json.dumps(found.as_json(), indent=2))
        return
    print(f"{found.figure.source} {found.figure.key}: {found.figure.title}")
    print(found.basis)
    for row in found.table.to_dict(orient="records"):
        print()
        _print(f"paper   {row['paper']} ({row['where']})")
        _print(f"ours    {row['ours'] or '-'}")
        _print(f"agrees  {row['agrees']}. {row['remark']}")
    print(f"\n{found.picture}\n{found.folder / 'report.html'}")


def _print(text: str) -> None:
    print(textwrap.fill(text, _WIDTH, subsequent_indent=" " * 8))
