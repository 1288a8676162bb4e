"""The whole grids of [Neamati2022] Figs. 12 and 13: 4,400 runs, timed, with a small table to keep.

python benchmarks/sweep_grid.py                 # both, two processes; goes on where it was stopped
python benchmarks/sweep_grid.py --only neamati-fig12 --workers 4

Wall time is that of this call and counts the runs that it finished; what else the machine did shows
in the load average, and in the processor time of the runs beside it.  Each table is written to
``benchmarks/results/NAME.parquet``.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import pandas as pd

from unmodeled.pipeline.sweep.sweep import open_sweep, sweep

ROOT = Path(__file__).parents[1]
GRIDS = ("neamati-fig12", "neamati-fig13")
#: Of each run: enough for the figures and for `unmodeled select`.
COLUMNS = (
    *("initial_condition", "learner", "kind", "noise.state", "noise.acceleration"),
    *("train_median", "interpolation_median", "extrapolation_median", "extrapolation_worst"),
    *("train_largest_observed", "failure"),
    *("interpolation_coverage_95", "extrapolation_coverage_95"),
    *("cost_train_s", "cost_total_s", "cost_cpu_s", "cost_peak_bytes"),
)


def main() -> None:
    """Run, time, keep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", default=list(GRIDS))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=ROOT / "runs")
    arguments = parser.parse_args()
    for name in arguments.only:
        start = time.time()
        opened = open_sweep(ROOT / "sweeps" / f"{name}.yaml", arguments.out / name)
        before = len(opened.table())
        table = sweep(opened, workers=arguments.workers)
        minutes = (time.time() - start) / 60
        failed = int((table["failure"] != "").sum())
        print(
            f"{name}: {len(table) - before} of {len(table)} runs in {minutes:.1f} min wall with "
            f"{arguments.workers} workers, {failed} failed; all runs "
            f"{table['cost_cpu_s'].sum() / 60:.1f} min of processor time; "
            f"{table['cost_peak_bytes'].max() / 1e9:.2f} GB a worker; load "
            f"{', '.join(f'{v:.1f}' for v in os.getloadavg())}",
            flush=True,
        )
        keep(table, ROOT / "benchmarks" / "results" / f"{name}.parquet")
        summary(table)


def keep(table: pd.DataFrame, path: Path) -> None:
    """Write the columns that figures need; errors to seven digits."""
    small = table[[name for name in COLUMNS if name in table]].copy()
    for name in small:
        if small[name].dtype == "float64" and not name.startswith("noise"):
            small[name] = small[name].astype("float32")
    small.to_parquet(path, index=False, compression="zstd")
    print(f"{path.name}: {len(small)} rows, {path.stat().st_size / 1e3:.0f} kB")


def summary(table: pd.DataFrame) -> None:
    """Print medians by noise and learner, and the largest error of all."""
    axes = [a for a in ("noise.state", "noise.acceleration") if a in table]
    sets = ["train_median", "interpolation_median", "extrapolation_median"]
    print(table.groupby([*axes, "kind"])[sets].median().to_string(float_format="{:.2e}".format))
    print("largest medians:", table.groupby("kind")[sets].max().to_dict("index"), flush=True)


if __name__ == "__main__":
    main()
