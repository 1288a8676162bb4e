"""What a filter loses when it is tuned badly: process noise wrong over two decades.

    python benchmarks/filter_off_nominal.py                  # a few minutes
    python benchmarks/filter_off_nominal.py --filters kf --runs 2

The scenario leo-formation with Q of each filter, a variance, multiplied by 0.01 to 100 (the
table of [Pesce2020] goes from 0.1 to 10). Root mean square of the length of the position error
after settling, mm, and NEES of six states.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from unmodeled.pipeline.navigation.navigate import fly, simulate_flight  # noqa: E402
from unmodeled.pipeline.navigation.scenario_config import (  # noqa: E402
    load_scenario,
    resolve_scenario,
)

SCENARIO = Path(__file__).resolve().parents[1] / "scenarios" / "leo-formation.yaml"
FACTORS = (0.01, 0.1, 1.0, 10.0, 100.0)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--filters", default="kf,rbf,matched,periodic,effects")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--seed", type=int, default=101)
    options = parser.parse_args()
    plain = load_scenario(SCENARIO, runs=options.runs, seed=options.seed)
    flight = simulate_flight(plain)
    print(f"{options.runs} runs, seed {options.seed}; position RMSE, mm (NEES of 6)")
    print("Q times    " + "".join(f"{factor:>16g}" for factor in FACTORS))
    for name in options.filters.split(","):
        cells = []
        for factor in FACTORS:
            tuning = {name: dict(plain.tuning[name])}
            tuning[name]["noise"] *= factor**0.5
            config = resolve_scenario(plain.as_dict() | {"filters": [name], "tuning": tuning})
            row = fly(config, flight).table.iloc[0]
            if row["failure"]:
                cells.append("diverged")
                continue
            cells.append(f"{1e3 * row['position_rmse_m']:.2f} ({row['nees']:.3g})")
        print(f"{name:11s}" + "".join(f"{cell:>16s}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
