"""Exact GP: the paper's Adam epochs against L-BFGS with closed-form gradients, same data.

python benchmarks/gp_optimizers.py            # low data volume, 237 samples
python benchmarks/gp_optimizers.py --moderate # 2,375 samples; about a quarter of an hour
"""

from __future__ import annotations

import argparse

import numpy as np

from unmodeled.core.threads import one_thread
from unmodeled.models.learned import ExactGP
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.cost import Meter
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare

SEEDS = (1, 4, 10)


def main() -> None:
    """Fit both to the same orbits; print time, memory, likelihood and errors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moderate", action="store_true")
    moderate = parser.parse_args().moderate
    seconds: dict[str, list[float]] = {"adam": [], "lbfgs": []}
    for seed in SEEDS[-1:] if moderate else SEEDS:
        config = CharacterizationConfig.resolve(
            {
                "seed": seed,
                "data": {"volume": "moderate" if moderate else "low"},
                "learners": [{"kind": "exact_gp", "baseline": "none"}],
            }
        )
        data = prepare(config)
        for optimizer, spent in seconds.items():
            learner = ExactGP(optimizer=optimizer)
            with one_thread(), Meter() as meter:
                learner.fit(data.train.observed_positions, data.train.observed_accelerations)
            spent.append(meter.seconds)
            errors = [
                float(np.median(fractional_error(s.accelerations, learner.predict(s.positions))))
                for s in data.sets
            ]
            print(
                f"seed {seed:2d}, {len(data.train)} samples, {optimizer:5s}: "
                f"{meter.seconds:7.2f} s, "
                f"{meter.peak_bytes / 1e6:6.0f} MB, negative log likelihood "
                f"{learner.nll_.sum():10.1f}, medians " + ", ".join(f"{e:.1e}" for e in errors),
                flush=True,
            )
    ratio = np.median(np.divide(seconds["adam"], seconds["lbfgs"]))
    print(f"adam over lbfgs, median time ratio: {ratio:.1f}")


if __name__ == "__main__":
    main()
