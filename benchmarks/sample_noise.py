"""What stated noise does for each network: medians over pairs of orbits about Bennu.

    python benchmarks/sample_noise.py --first 101 --seeds 100 [--kinds rbf_network elm]

For each kind on a known point mass, without and with the noise told to it: median over the pairs
of the median fractional error between the samples and on the other orbit, and the worst pair.
The draws of position and acceleration are independent.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import Learner, NoiseLevel, Residual, learner_class
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare

NOISES = ((0.0, 0.1), (0.05, 0.0), (0.2, 0.0), (1.0, 0.0))
KINDS = ("rbf_network", "elm")


def data(seed: int, state: float, acceleration: float) -> LearningData:
    """Return the learning data of one pair of orbits."""
    content = {
        "seed": seed,
        "noise": {"state": state, "acceleration": acceleration},
        "learners": [{"kind": "point_mass"}],
    }
    return prepare(CharacterizationConfig.resolve(content))


def errors(learner: Learner, of: LearningData) -> tuple[float, float]:
    """Return the median fractional error between the samples and on the other orbit."""
    first, second = (
        float(np.median(fractional_error(s.accelerations, learner.predict(s.positions))))
        for s in (of.interpolation, of.extrapolation)
    )
    return first, second


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=101)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--kinds", nargs="+", default=KINDS)
    given = parser.parse_args()
    print("sigma_s sigma_a kind              told  between  other    worst    s a fit")
    for state, acceleration in NOISES:
        sets = [data(given.first + k, state, acceleration) for k in range(given.seeds)]
        for kind in given.kinds:
            for told in (False, True):
                start, rows = time.perf_counter(), []
                for of in sets:
                    noise = NoiseLevel(state, acceleration) if told else NoiseLevel()
                    learner = Residual(learner_class(kind)())
                    train = of.train
                    learner.fit(train.observed_positions, train.observed_accelerations, noise)
                    rows.append(errors(learner, of))
                between, other = np.median(rows, axis=0)
                seconds = (time.perf_counter() - start) / given.seeds
                print(
                    f"{state:<7g} {acceleration:<7g} {kind:17s} {told!s:5s} {between:.2e} "
                    f"{other:.2e} {np.max(rows, axis=0)[1]:.1e}  {seconds:.2f}",
                    flush=True,
                )


if __name__ == "__main__":
    with one_thread():
        main()
