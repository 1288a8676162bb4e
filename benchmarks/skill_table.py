"""The standing table of skill: every learner, four fields, two volumes, seven levels of noise.

    python benchmarks/skill_table.py --small          # a minute or two
    python benchmarks/skill_table.py [--workers 2]    # the whole table

Interrupted, it goes on where it was: finished runs are kept in ``runs/skill``, also when new
learners have joined. Learners are all that are registered. ``benchmarks/results/skill*.csv``
(cells), ``skill*.parquet`` (runs), ``skill*.html`` and ``skill*.png`` are written at the end;
docs/skill.md says how to read them. ``--only KIND ...`` runs these learners beside the point mass
and the oracle, and draws all that are finished.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd
from skill.page import write_page
from skill.plan import FULL, SMALL, NotRun, make_runs
from skill.runner import SkillRunner
from skill.summary import check_use, over_point_mass, summarize_cells

from unmodeled.pipeline.sweep.grid import Plan
from unmodeled.pipeline.sweep.store import Store
from unmodeled.pipeline.sweep.sweep import Opened, sweep

ROOT = Path(__file__).parents[1]
#: Pairs of the first passes.
_PASSES = (3, 5)


def main() -> None:
    """Run what is not finished, then write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true", help="two fields, low volume, three pairs")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--only", nargs="+", default=[], metavar="KIND")
    parser.add_argument("--draw", action="store_true", help="run nothing, draw what is finished")
    parser.add_argument("--pairs", type=int, default=0, help="draw only the first pairs")
    parser.add_argument("--runs", type=Path, default=ROOT / "runs")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results")
    arguments = parser.parse_args()
    settings, name = (SMALL, "skill-small") if arguments.small else (FULL, "skill")
    store = Store(arguments.runs / name)
    store.create()
    plan, not_run = make_runs(settings)
    if not arguments.draw:
        chosen = plan
        if arguments.only:
            chosen, _ = make_runs(settings, tuple(arguments.only))
        before = len(store.finished())
        start = time.time()
        for part in passes(chosen):
            sweep(
                Opened(store, part, ()),
                workers=arguments.workers,
                run_batch=SkillRunner(),
                tell=_progress(start),
            )
        done = len(store.finished()) - before
        print(f"\n{done} runs in {(time.time() - start) / 60:.1f} min wall")
    runs = Opened(store, plan, ()).table()
    if arguments.pairs:
        name = f"{name}-first{arguments.pairs}"
        first = min(run.config.seed for run in plan.runs)
        runs = runs[runs["initial_condition"] < first + arguments.pairs]
    cells = summarize_cells(runs)
    arguments.out.mkdir(parents=True, exist_ok=True)
    runs.to_parquet(arguments.out / f"{name}.parquet", index=False, compression="zstd")
    table = pd.concat([cells, not_run_rows(not_run)], ignore_index=True)
    table.to_csv(arguments.out / f"{name}.csv", index=False, float_format="%.4g")
    page = arguments.out / f"{name}.html"
    write_page(runs, cells, not_run, settings, page, len(plan.runs))
    print(
        f"{len(runs)} of {len(plan.runs)} runs, {len(cells)} cells, "
        f"{runs['cost_cpu_s'].sum() / 60:.1f} min of processor time; {page}"
    )
    for item in not_run:
        print(f"not run: {item.learner}, {item.volume} volume: {item.reason}")
    print(check_use(runs, cells).sentence())
    print("\nerror on another orbit over the bare point mass's; cells that are worse than twice")
    print(over_point_mass(cells).to_string(float_format="{:.2g}".format))
    for (volume, field), own in cells.groupby(["volume", "field"], sort=False):
        print(f"\n{field}, {volume} volume: median fractional error on other orbits")
        levels = own.pivot_table("extrapolation_median", "learner", ["sigma_s", "sigma_a"])
        print(levels.to_string(float_format="{:.2g}".format))


def passes(plan: Plan) -> list[Plan]:
    """Return the runs of the first pairs, then of more: a table that is stopped is a whole one.

    In the first pass only the first pair is flown: flights cost more than all fits together.
    """
    first = min(run.config.seed for run in plan.runs)
    counts = [k for k in _PASSES if first + k <= max(run.config.seed for run in plan.runs)]
    parts = [
        replace(plan, runs=tuple(r for r in plan.runs if r.config.seed < first + k)) for k in counts
    ]
    if parts:
        quick = tuple(r for r in parts[0].runs if not r.flights or r.config.seed == first)
        parts.insert(0, replace(plan, runs=quick))
    return [*parts, plan]


def not_run_rows(not_run: Sequence[NotRun]) -> pd.DataFrame:
    """Return a row for each learner that is not run on a volume; its verdict says why."""
    return pd.DataFrame(
        [
            {"volume": n.volume, "learner": n.learner, "kind": n.kind, "pairs": 0}
            | {"verdict": f"not run: {n.reason}"}
            for n in not_run
        ]
    )


def _progress(start: float):
    last = [0.0]

    def tell(done: int, total: int) -> None:
        now = time.time()
        if now - last[0] > 5 or done == total:
            last[0] = now
            print(f"\r{done} of {total} runs, {now - start:.0f} s", end="", flush=True)

    return tell


if __name__ == "__main__":
    main()
