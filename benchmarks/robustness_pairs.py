"""Skill over many pairs of orbits: medians of training, interpolation and extrapolation error.

Each seed draws a training orbit and one other orbit about Bennu (low data volume, no noise unless
asked for). Prints one row a learner: median over the pairs of the median fractional errors, with
quartiles, beside the figures of the project's prototype where it has them; the seconds of a fit;
and for learners with a covariance the mean share of components of other orbits inside the
95 % band.

    python benchmarks/robustness_pairs.py --pairs 30
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import pandas as pd

from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig

LEARNERS = [
    {"kind": "exact_gp", "baseline": "none"},
    {"kind": "exact_gp", "baseline": "point_mass"},
    {"kind": "spectral_mlp", "baseline": "none"},
    {"kind": "spectral_mlp", "baseline": "point_mass"},
    {"kind": "rbf_network", "baseline": "none"},
    {"kind": "rbf_network", "baseline": "point_mass"},
    {"kind": "nearest_neighbour", "baseline": "none"},
    {"kind": "point_mass"},
    {"kind": "fitted_point_mass"},
    {"kind": "harmonic_least_squares"},
    {"kind": "potential_mlp"},
    {"kind": "harmonic_gp"},
    {"kind": "zonal_oracle"},
]


def main() -> None:
    """Run the pairs and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--state-noise", type=float, default=0.0)
    parser.add_argument("--acceleration-noise", type=float, default=0.0)
    parser.add_argument("--without", nargs="*", default=[], help="kinds to leave out")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    arguments = parser.parse_args()
    learners = [spec for spec in LEARNERS if spec["kind"] not in arguments.without]
    rows = []
    start = time.perf_counter()
    for seed in range(1, arguments.pairs + 1):
        config = CharacterizationConfig.resolve(
            {
                "name": "pair",
                "seed": seed,
                "body": "bennu",
                "data": {"volume": "low", "extrapolation_orbits": 1},
                "noise": {
                    "state": arguments.state_noise,
                    "acceleration": arguments.acceleration_noise,
                },
                "learners": learners,
                "flight": {"periods": [1], "orbits": 1},
            }
        )
        result = characterize(config)
        table = result.summary().assign(seed=seed)
        table = table.merge(result.costs()[["learner", "train_s"]], on="learner")
        calibration = result.calibration()[["learner", "set", "coverage_95"]]
        rows.append(table.merge(calibration, on=["learner", "set"], how="left"))
        print(f"pair {seed} of {arguments.pairs}, {time.perf_counter() - start:.0f} s", flush=True)
    tidy = pd.concat(rows, ignore_index=True)
    arguments.out.mkdir(parents=True, exist_ok=True)
    name = (
        f"robustness_pairs_s{arguments.state_noise:g}_a{arguments.acceleration_noise:g}"
        f"_n{arguments.pairs}.csv"
    )
    tidy.to_csv(arguments.out / name, index=False)
    print(f"\nmedian over {arguments.pairs} pairs of the median fractional error [quartiles]")
    order = list(dict.fromkeys(tidy["learner"]))
    for learner in order:
        own = tidy[tidy["learner"] == learner]
        cells = []
        for which in ("train", "interpolation", "extrapolation"):
            values = own.loc[own["set"] == which, "median"]
            low, mid, high = values.quantile([0.25, 0.5, 0.75])
            cells.append(f"{mid:.1e} [{low:.1e}, {high:.1e}]")
        outside = own.loc[own["set"] == "extrapolation", "coverage_95"].mean()
        band = "" if pd.isna(outside) else f"  95 % band holds {outside:.1%}"
        print(f"{learner:32s} " + "  ".join(cells) + f"  {own['train_s'].median():.2f} s{band}")
    print(f"table: {arguments.out / name}")


if __name__ == "__main__":
    main()
