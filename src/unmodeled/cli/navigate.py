"""The command `navigate`: filters flown on a scenario."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from unmodeled.cli.tools import AsJson, app, errors, progress, stoppable

__all__ = ["navigate"]


@app.command()
@stoppable
def navigate(
    scenario: Annotated[
        Path, typer.Argument(help="Scenario file, e.g. scenarios/leo-formation.yaml.")
    ],
    filters: Annotated[
        str | None, typer.Option("--filters", help="Names with commas, e.g. kf,dmc,rbf.")
    ] = None,
    learner: Annotated[
        Path | None, typer.Option("--learner", help="A learned field, for small bodies.")
    ] = None,
    runs: Annotated[int | None, typer.Option("--runs", min=1, help="Monte-Carlo runs.")] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Replaces that of the file.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Run folder; default runs/NAME.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fly filters side by side: errors, gaps, consistency, cost, and the floor below them."""
    from unmodeled.pipeline.navigation.navigate import navigate as run
    from unmodeled.pipeline.navigation.save import save_navigation
    from unmodeled.pipeline.navigation.scenario_config import load_scenario
    from unmodeled.pipeline.run_folder import check_run_folder, run_folder
    from unmodeled.reports.navigation_page import write_navigation_report

    config = load_scenario(scenario)
    target = out or Path("runs") / config.name
    check_run_folder(target)
    names = [n.strip() for n in filters.split(",")] if filters is not None else None
    with progress() as report:
        result = run(config, filters=names, runs=runs, seed=seed, learner=learner, tell=report)
    with run_folder(target) as staging:
        save_navigation(result, staging)
        write_navigation_report(result, staging)
    if as_json:
        print(json.dumps(result.as_json(), indent=2))
        return
    _print(result)
    errors.print(f"report: {target / 'report.html'}", markup=False, soft_wrap=True)


def _print(result: Any) -> None:
    from unmodeled.reports.navigation_page import navigation_words

    print(navigation_words(result)[0])
    phases = list(result.flight.phases)
    heads = ["position", "velocity", *(f"max {p}" for p in phases), "NEES", "disturb.", "us/step"]
    keys = ["position_rmse_m", "velocity_rmse_m_s", *(f"max_in_{p}_m" for p in phases)]
    keys += ["nees", "disturbance_rmse_m_s2", "us_per_step"]
    width = max(len("floor"), *(len(n) for n in result.table["filter"]))
    print(f"{'RMSE, SI':{width}}" + "".join(f"  {head:>12}" for head in heads))
    for row in result.table.to_dict(orient="records"):
        cells = [row.get(key) for key in keys]
        shown = ["-" if c is None or c != c else f"{c:.3g}" for c in cells]
        print(f"{row['filter']:{width}}" + "".join(f"  {c:>12}" for c in shown))
    print(
        f"{'floor':{width}}  {result.floor_position_m:>12.3g}  {result.floor_velocity_m_s:>12.3g}"
    )
