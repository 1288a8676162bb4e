"""Training on a fitted orbit against training on noisy samples: pairs of orbits about Bennu.

    python benchmarks/trajectory_consistent.py --first 101 --seeds 30

For each position noise and learner: median over the pairs of the median fractional error on the
other orbit, trained on the samples (told their noise) and on the orbit fitted to them; the pairs
in which it settles, and those without any orbit, which count with the error of the samples. Below:
median distance of the orbit from the true positions, its error in stated standard deviations (root
mean square over all pairs), and the share of accelerations of the other orbit in the learner's 95 %
band.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from unmodeled.core.errors import NumericalError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import (
    ExactGP,
    HarmonicGP,
    Learner,
    NoiseLevel,
    PointMassOnly,
    PotentialMLP,
    RBFNetwork,
    Residual,
)
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare
from unmodeled.pipeline.trajectory_consistent import train_consistently

LEARNERS = {
    "harmonic_gp": lambda: HarmonicGP(),
    "exact_gp on point mass": lambda: Residual(ExactGP(optimizer="newton")),
    "rbf_network on point mass": lambda: Residual(RBFNetwork()),
    "potential_mlp on point mass": lambda: Residual(PotentialMLP()),
}


def data(seed: int, state: float, volume: str = "low") -> LearningData:
    """Return the learning data of one pair of orbits."""
    content = {"seed": seed, "noise": {"state": state}, "learners": [{"kind": "point_mass"}]}
    return prepare(CharacterizationConfig.resolve(content | {"data": {"volume": volume}}))


def error(learner: Learner, of: LearningData) -> float:
    """Return the median fractional error on the other orbit."""
    s = of.extrapolation
    return float(np.median(fractional_error(s.accelerations, learner.predict(s.positions))))


def in_band(learner: Learner, of: LearningData) -> float:
    """Return the share of accelerations of the other orbit in the 95 % band; nan without one."""
    if not learner.has_covariance:
        return float("nan")
    s = of.extrapolation
    variance = np.diagonal(learner.predict_covariance(s.positions), axis1=1, axis2=2)
    off = np.abs(learner.predict(s.positions) - s.accelerations)
    return float(np.mean(off < 1.96 * np.sqrt(variance)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=101)
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--noise", type=float, nargs="+", default=[0.05, 0.2, 1.0])
    parser.add_argument("--learners", nargs="+", default=list(LEARNERS), choices=LEARNERS)
    parser.add_argument("--volume", default="low", choices=["low", "moderate"])
    given = parser.parse_args()
    for state in given.noise:
        sets = [data(given.first + k, state, given.volume) for k in range(given.seeds)]
        bare = []
        for of in sets:
            train = of.train
            mass = PointMassOnly().fit(train.observed_positions, train.observed_accelerations)
            bare.append(error(mass, of))
        print(f"sigma_s {state:g}: point mass {np.median(bare):.2e}", flush=True)
        for name in given.learners:
            make = LEARNERS[name]
            start, before, after, settled, found = time.perf_counter(), [], [], 0, []
            off, squares, band = [], [], []
            for of in sets:
                train, level = of.train, NoiseLevel(state, 0.0)
                plain = make().fit(train.observed_positions, train.observed_accelerations, level)
                before.append(error(plain, of))
                try:
                    fit = train_consistently(of, make())
                except NumericalError:
                    found.append(False)
                    after.append(before[-1])
                    continue
                found.append(True)
                settled += fit.settled
                after.append(error(fit.learner, of))
                away = fit.positions - train.positions
                off.append(float(np.median(np.linalg.norm(away, axis=1))))
                squares.append(float(np.mean((away / fit.position_sigmas) ** 2)))
                band.append(in_band(fit.learner, of))
            with_orbit = np.array(found)
            only = np.array(after)[with_orbit]
            print(
                f"  {name:26s} samples {np.median(before):.2e}  orbit {np.median(after):.2e} "
                f"(where one was found {np.median(only) if len(only) else np.nan:.2e}, worst "
                f"{only.max(initial=0.0):.1e}); settled {settled}, no orbit "
                f"{int((~with_orbit).sum())} of {given.seeds}; "
                f"{(time.perf_counter() - start) / given.seeds:.1f} s a pair",
                flush=True,
            )
            if off:
                held = f"; 95 % band holds {np.mean(band):.0%}" if np.isfinite(band).all() else ""
                print(
                    f"    orbit off by {np.median(off):.3g} radii, {np.sqrt(np.mean(squares)):.2f} "
                    f"of its sigma{held}",
                    flush=True,
                )


if __name__ == "__main__":
    with one_thread():
        main()
