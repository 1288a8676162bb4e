"""Training on a fitted orbit against training on noisy samples: pairs of orbits about Bennu.

    python benchmarks/trajectory_consistent.py --first 101 --seeds 30

For each position noise and learner: median over the pairs of the median fractional error on the
other orbit, trained on the samples (told their noise) and on the orbit fitted to them; the pairs
in which it settles, and those without any orbit, which count with the error of the samples.
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
}


def data(seed: int, state: float) -> LearningData:
    """Return the learning data of one pair of orbits."""
    content = {"seed": seed, "noise": {"state": state}, "learners": [{"kind": "point_mass"}]}
    return prepare(CharacterizationConfig.resolve(content))


def error(learner: Learner, of: LearningData) -> float:
    """Return the median fractional error on the other orbit."""
    s = of.extrapolation
    return float(np.median(fractional_error(s.accelerations, learner.predict(s.positions))))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=101)
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--noise", type=float, nargs="+", default=[0.05, 0.2, 1.0])
    parser.add_argument("--learners", nargs="+", default=list(LEARNERS), choices=LEARNERS)
    given = parser.parse_args()
    for state in given.noise:
        sets = [data(given.first + k, state) for k in range(given.seeds)]
        bare = []
        for of in sets:
            train = of.train
            mass = PointMassOnly().fit(train.observed_positions, train.observed_accelerations)
            bare.append(error(mass, of))
        print(f"sigma_s {state:g}: point mass {np.median(bare):.2e}", flush=True)
        for name in given.learners:
            make = LEARNERS[name]
            start, before, after, settled, found = time.perf_counter(), [], [], 0, []
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


if __name__ == "__main__":
    with one_thread():
        main()
