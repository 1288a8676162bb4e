"""Networks over pairs of orbits: the gradient of a potential beside the plain network.

Each seed draws a training orbit and one other orbit about Bennu (low data volume); the levels of
noise share them, as in `harmonic_pairs.py`. One row a pair, level and learner: median fractional
error between the samples and on the other orbit, the shares of components of the other orbit inside
the 68 % and the 95 % band, processor seconds of the fit. Pairs that the table has are not computed
again.

    python benchmarks/network_pairs.py --first 101 --last 200 [--print]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from bennu_pair import bennu_pair

from unmodeled.core.errors import NumericalError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import (
    HarmonicGP,
    Learner,
    NoiseLevel,
    PointMassOnly,
    PotentialMLP,
    SpectralMLP,
    fit_batch,
)
from unmodeled.pipeline.metrics import calibrate, fractional_error

#: sigma_s (independent draws), sigma_a; normalised units.
LEVELS = ((0.0, 0.0), (0.0, 0.1), (0.0, 0.5), (0.0, 1.0), (0.05, 0.0), (0.2, 0.0), (1.0, 0.0))
LEARNERS: dict[str, Callable[[], Learner]] = {
    "spectral_mlp": SpectralMLP,
    "potential_mlp": PotentialMLP,
    "potential_mlp, GM known": lambda: PotentialMLP(mass_error=0.0),
    "potential_mlp, Laplacian free": lambda: PotentialMLP(harmonic=False),
    "potential_mlp, direction": lambda: PotentialMLP(inputs="direction"),
    "potential_mlp, slopes to 1": lambda: PotentialMLP(lipschitz=1.0),
    "harmonic_gp": HarmonicGP,
    "point_mass": PointMassOnly,
}
PLAIN = "spectral_mlp"
NO_BAND = {"coverage_68": np.nan, "coverage_95": np.nan}


def main() -> None:
    """Run what is missing, print the table and keep it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=101)
    parser.add_argument("--last", type=int, default=200)
    parser.add_argument("--learners", nargs="*", default=list(LEARNERS), choices=list(LEARNERS))
    parser.add_argument("--print", action="store_true", help="what the tables have, no new pairs")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    seeds = range(arguments.first, arguments.last + 1)
    tables = []
    for name in arguments.learners:
        slug = name.replace(",", "").replace(" ", "_")
        path = arguments.out / f"network_pairs_{slug}.csv"
        if not arguments.print:
            run(name, seeds, path)
        if path.exists():
            table = pd.read_csv(path)
            tables.append(table[table["seed"].isin(seeds)])
            print(f"table: {path}", flush=True)
    if tables:
        report(pd.concat(tables))


def run(name: str, seeds: range, path: Path) -> None:
    """Compute the pairs that the table lacks; each finished one is in it at once."""
    done = set(pd.read_csv(path)["seed"]) if path.exists() else set()
    for seed in seeds:
        if seed not in done:
            with one_thread():
                rows = pd.DataFrame(pair(name, seed))
            rows.to_csv(path, mode="a", header=not path.exists(), index=False, float_format="%.4g")


def pair(name: str, seed: int) -> list[dict[str, float | str]]:
    """Return one row a level of noise."""
    data = bennu_pair(seed, LEVELS)
    start = time.process_time()
    fitted = fit_batch(
        LEARNERS[name](),
        [d.train.observed_positions for d in data],
        [d.train.observed_accelerations for d in data],
        [NoiseLevel(*level) for level in LEVELS],
    )
    taken = (time.process_time() - start) / len(LEVELS)
    return [
        {"learner": name, "seed": seed, "sigma_s": s, "sigma_a": a, "fit_s": taken} | score(f, d)
        for (s, a), f, d in zip(LEVELS, fitted, data, strict=True)
    ]


def score(fitted: Learner | NumericalError, data: LearningData) -> dict[str, float]:
    """Return errors and coverage of a fitted learner; a fit that broke down counts as infinite."""
    if isinstance(fitted, NumericalError):
        return {"interpolation": np.inf, "extrapolation": np.inf} | NO_BAND
    row = {}
    for which, part in (
        ("interpolation", data.interpolation),
        ("extrapolation", data.extrapolation),
    ):
        error = fractional_error(part.accelerations, fitted.predict(part.positions))
        row[which] = float(np.median(error))
    row |= NO_BAND
    if fitted.has_covariance:
        x, truth = data.extrapolation.positions, data.extrapolation.accelerations
        covariance = fitted.predict_covariance(x)
        found = calibrate(truth, fitted.predict(x), covariance)
        row |= {"coverage_68": found.coverage_68, "coverage_95": found.coverage_95}
    return row


def report(table: pd.DataFrame) -> None:
    """Print a row a learner and level: medians over the pairs."""
    plain = table[table["learner"] == PLAIN].groupby(["sigma_s", "sigma_a"])["extrapolation"]
    levels = plain.median()
    print("medians over the pairs of the median fractional errors")
    for name, own in table.groupby("learner", sort=False):
        for level, rows in own.groupby(["sigma_s", "sigma_a"]):
            error = rows["extrapolation"]
            low, high = error.quantile([0.25, 0.75])
            line = (
                f"{name:30s} {len(rows):3d} pairs sigma_s {level[0]:<4g} sigma_a {level[1]:<3g} "
                f"other orbit {error.median():.2e} [{low:.1e}, {high:.1e}], "
                f"between {rows['interpolation'].median():.2e}"
            )
            if level in levels.index:
                line += f", of plain {error.median() / levels[level]:.4f}"
            if rows["coverage_95"].notna().any():
                line += f"; 95 % band holds {rows['coverage_95'].mean():.1%}"
            if "coverage_68" in rows and rows["coverage_68"].notna().any():
                line += f", 68 % band {rows['coverage_68'].mean():.1%}"
            print(line + f"; fit {rows['fit_s'].median():.2f} s, at most {rows['fit_s'].max():.2f}")


if __name__ == "__main__":
    main()
