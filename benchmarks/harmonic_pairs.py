"""Skill and calibration of the harmonic GP over pairs of orbits, at several levels of noise.

Each seed draws a training orbit and one other orbit about Bennu (low data volume); the levels of
noise share them. One row a pair and level: median fractional error on the other orbit of the
harmonic GP without and with a prior on GM (1e-3 of it) and on the centre of mass (1e-3 R), of the
oracle that knows the family and of the bare point mass, which knows both; the share of components
of the other orbit inside the 95 % band, processor seconds of a fit.

    python benchmarks/harmonic_pairs.py --first 101 --last 200

``--amplitudes`` averages over another range of prior deviations of degree 2 (4e-3 to 1).
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import numpy as np
import pandas as pd
from bennu_pair import bennu_pair

from unmodeled.core.threads import one_thread
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import (
    HarmonicGP,
    Learner,
    NoiseLevel,
    PointMassOnly,
    ZonalOracle,
    _harmonic_evidence,
)
from unmodeled.pipeline.metrics import calibrate, fractional_error

#: sigma_s, sigma_a, normalised units.
LEVELS = ((0.0, 0.0), (0.0, 0.1), (0.05, 0.0), (0.2, 0.0), (1.0, 0.0))


def main() -> None:
    """Run the pairs, print a row a level and keep the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=101)
    parser.add_argument("--last", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--amplitudes", type=float, nargs=2, metavar=("LEAST", "MOST"))
    arguments = parser.parse_args()
    stem = f"harmonic_pairs_{arguments.first}_{arguments.last}"
    if arguments.amplitudes:
        least, most = arguments.amplitudes
        count = 1 + round(math.log(most / least) / math.log(1.65))  # as close as in the package
        _harmonic_evidence._AMPLITUDES = np.log(np.geomspace(least, most, count))
        stem += f"_prior_{least:g}_{most:g}"
    rows = []
    with one_thread():
        for seed in range(arguments.first, arguments.last + 1):
            rows += pair(seed)
    table = pd.DataFrame(rows)
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = arguments.out / f"{stem}.csv"
    table.to_csv(path, index=False, float_format="%.4g")
    print(f"{len(table) // len(LEVELS)} pairs; medians of the median fractional errors")
    for (s, a), own in table.groupby(["sigma_s", "sigma_a"]):
        median = own.median()
        oracle, bare = median["zonal_oracle"], median["point_mass"]
        print(f"sigma_s {s:g} sigma_a {a:g}: oracle {oracle:.2e}, bare point mass {bare:.2e}")
        for name in ("harmonic_gp", "with_gm"):
            ours, taken = median[name], own[f"{name}_fit_s"]
            print(
                f"  {name}: {ours:.2e} (oracle x {ours / oracle:.2f}, bare x {ours / bare:.2f}); "
                f"95 % band holds {own[f'{name}_coverage_95'].mean():.1%}; "
                f"fit {taken.median():.2f} s, longest {taken.max():.2f} s"
            )
    print(f"table: {path}")


def pair(seed: int) -> list[dict[str, float]]:
    """Return one row a level of noise."""
    rows = []
    for (state, acceleration), data in zip(LEVELS, bennu_pair(seed, LEVELS), strict=True):
        x, y = data.train.observed_positions, data.train.observed_accelerations
        other, truth = data.extrapolation.positions, data.extrapolation.accelerations
        row = {"seed": seed, "sigma_s": state, "sigma_a": acceleration}
        known = {"gm_sigma": 1e-3 * NORMALISED_GM, "centre_sigma": 1e-3}
        learners: dict[str, Learner] = {
            "harmonic_gp": HarmonicGP(),
            "with_gm": HarmonicGP(**known),
            "zonal_oracle": ZonalOracle(),
            "point_mass": PointMassOnly(),
        }
        for name, learner in learners.items():
            start = time.process_time()
            learner.fit(x, y, NoiseLevel(state, acceleration))
            taken = time.process_time() - start
            predicted = learner.predict(other)
            row[name] = float(np.median(fractional_error(truth, predicted)))
            if learner.has_covariance:
                covariance = learner.predict_covariance(other)
                row[f"{name}_coverage_95"] = calibrate(truth, predicted, covariance).coverage_95
                row[f"{name}_fit_s"] = taken
        rows.append(row)
    return rows


if __name__ == "__main__":
    main()
