"""The command `select`: which learner of a sweep to choose."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from unmodeled.cli.report import METRICS, write_page
from unmodeled.cli.tools import app, errors, stoppable
from unmodeled.core.errors import ConfigError

__all__ = ["select"]


@app.command()
@stoppable
def select(
    folder: Annotated[Path, typer.Argument(help="Folder of a sweep.")],
    by: Annotated[
        str, typer.Option("--by", help="robustness (other orbits) or safety (the same orbit).")
    ] = "robustness",
    export: Annotated[
        Path | None, typer.Option("--export", help="Folder for the trained winner of one regime.")
    ] = None,
    regime: Annotated[
        str | None, typer.Option("--regime", help="Whose winner; default the first.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare the learners of a sweep problem by problem; recommend one for each regime.

    The page of the sweep, report.html, is written again by the same measure.
    """
    from unmodeled.pipeline.sweep.store import Store

    if by not in METRICS:
        raise ConfigError(f"--by {by}", allowed=", ".join(METRICS))
    Store(folder).require()
    from unmodeled.pipeline.select.export_winner import export_winner
    from unmodeled.pipeline.select.select import select as choose
    from unmodeled.pipeline.sweep.sweep import open_sweep

    opened = open_sweep(folder)
    table = opened.table()
    if table.empty:
        raise ConfigError(f"no run of {folder} is finished yet")
    selection = choose(table, METRICS[by])
    write_page(opened, METRICS[by])
    if as_json:
        print(json.dumps(selection.as_json(), indent=2))
    else:
        print(f"{len(table)} of {len(opened.plan.runs)} runs, by {by}")
        for choice in selection.choices:
            print(choice.sentence)
        front = selection.pareto[selection.pareto["front"]]["learner"]
        print(f"on the front of error, training time, evaluation time and size: {', '.join(front)}")
    if export is not None:
        choice = selection[regime] if regime else selection.choices[0]
        for path in export_winner(opened, choice.winner, choice.regime, export):
            errors.print(f"wrote {path}", markup=False, soft_wrap=True)
