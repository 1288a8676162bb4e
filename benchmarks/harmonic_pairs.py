"""Skill and calibration of the harmonic GP over pairs of orbits, at several levels of noise.

Each seed draws a training orbit and one other orbit about Bennu (low data volume); the levels of
noise share them. One row a pair and level: median fractional error on the other orbit of the
harmonic GP, of the oracle that knows the family and of the bare point mass, the share of
components of the other orbit inside the 95 % band, processor seconds of a fit.

    python benchmarks/harmonic_pairs.py --first 101 --last 200
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd

from unmodeled.core.threads import one_thread
from unmodeled.models.learned import HarmonicGP, Learner, NoiseLevel, PointMassOnly, ZonalOracle
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import calibrate, fractional_error
from unmodeled.pipeline.prepare import Simulated, prepare, simulate

#: sigma_s, sigma_a, normalised units.
LEVELS = ((0.0, 0.0), (0.0, 0.1), (0.05, 0.0), (0.2, 0.0), (1.0, 0.0))


def main() -> None:
    """Run the pairs, print a row a level and keep the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=101)
    parser.add_argument("--last", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    arguments = parser.parse_args()
    rows = []
    with one_thread():
        for seed in range(arguments.first, arguments.last + 1):
            rows += pair(seed)
    table = pd.DataFrame(rows)
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = arguments.out / f"harmonic_pairs_{arguments.first}_{arguments.last}.csv"
    table.to_csv(path, index=False, float_format="%.4g")
    print(f"{len(table) // len(LEVELS)} pairs; medians of the median fractional errors")
    for (s, a), own in table.groupby(["sigma_s", "sigma_a"]):
        median = own.median()
        ours, oracle = median["harmonic_gp"], median["zonal_oracle"]
        print(
            f"sigma_s {s:g} sigma_a {a:g}: harmonic GP {ours:.2e}, oracle {oracle:.2e} "
            f"(ratio {ours / oracle:.2f}), point mass {median['point_mass']:.2e}; "
            f"95 % band holds {own['coverage_95'].mean():.1%}; "
            f"fit {median['fit_s']:.2f} s, longest {own['fit_s'].max():.2f} s"
        )
    print(f"table: {path}")


def pair(seed: int) -> list[dict[str, float]]:
    """Return one row a level of noise."""
    kept: list[Simulated] = []

    def once(config: CharacterizationConfig, body: object = None) -> Simulated:
        if not kept:
            kept.append(simulate(config, compare_integrators=False))
        return kept[0]

    rows = []
    for state, acceleration in LEVELS:
        config = CharacterizationConfig.resolve(
            {
                "name": "pair",
                "seed": seed,
                "body": "bennu",
                "data": {"volume": "low", "extrapolation_orbits": 1},
                "noise": {"state": state, "acceleration": acceleration},
                "learners": [{"kind": "harmonic_gp"}],
            }
        )
        data = prepare(config, simulated=once)
        x, y = data.train.observed_positions, data.train.observed_accelerations
        other, truth = data.extrapolation.positions, data.extrapolation.accelerations
        row = {"seed": seed, "sigma_s": state, "sigma_a": acceleration}
        learners: tuple[Learner, ...] = (HarmonicGP(), ZonalOracle(), PointMassOnly())
        for learner in learners:
            start = time.process_time()
            learner.fit(x, y, NoiseLevel(state, acceleration))
            taken = time.process_time() - start
            predicted = learner.predict(other)
            row[learner.name] = float(np.median(fractional_error(truth, predicted)))
            if learner.has_covariance:
                covariance = learner.predict_covariance(other)
                row["coverage_95"] = calibrate(truth, predicted, covariance).coverage_95
                row["fit_s"] = taken
        rows.append(row)
    return rows


if __name__ == "__main__":
    main()
