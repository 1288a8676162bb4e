"""Looks for the outliers of the paper's Gaussian process (its Fig. 10, 10^-0.5 to 10^2).

python benchmarks/gp_outliers.py                   # 36 periods, past 800 samples
python benchmarks/gp_outliers.py --periods 100     # the paper's moderate volume; slow

Noise-free data.  The plain gpytorch loop is trained as the library comes (above 800 samples it
changes to conjugate gradients and random traces without a word) and with exact Cholesky algebra
forced on the same loop; ours beside both.  An error above 10^-0.5 in the plain loop only would be
one of the algebra.  On the one orbit that was run through (seed 1, 855 samples) there was none:
median 5.5e-3 as the library comes, 2.0e-3 with Cholesky, 1e-5 ours.  So the cause of the paper's
outliers is not shown here; its moderate volume has not been run with the plain loop.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from contextlib import ExitStack

import gpytorch
import numpy as np
from reference_loop import reference_gp

from unmodeled.core.threads import one_thread
from unmodeled.models.learned import ExactGP
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare, simulate

Array = np.ndarray
OUTLIER = 10**-0.5


def main() -> None:
    """Print median and worst interpolation error of each, and the health of ours."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--periods", type=float, default=36.0)
    parser.add_argument("--epochs", type=int, default=100)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 4, 10])
    arguments = parser.parse_args()
    for seed in arguments.seeds:
        config = CharacterizationConfig.resolve(
            {
                "seed": seed,
                "data": {"train_periods": arguments.periods},
                "learners": [{"kind": "exact_gp", "baseline": "none"}],
            }
        )
        data = prepare(config, (), lambda c, b: simulate(c, b, compare_integrators=False))
        X, y = data.train.observed_positions, data.train.observed_accelerations
        test = data.interpolation
        ours = ExactGP(optimizer="newton")

        def plain(X: Array = X, y: Array = y) -> Callable[[Array], Array]:
            return reference_gp(X, y, arguments.epochs).predict

        def exact(
            X: Array = X, y: Array = y, points: Array = test.positions
        ) -> Callable[[Array], Array]:
            with ExitStack() as stack:
                stack.enter_context(gpytorch.settings.max_cholesky_size(10**6))
                model = reference_gp(X, y, arguments.epochs)
                model.predict(points)  # the solves are cached inside the block
                return model.predict

        def batch(X: Array = X, y: Array = y, ours: ExactGP = ours) -> Callable[[Array], Array]:
            return ours.fit(X, y).predict

        for name, train in (("ours", batch), ("plain, Cholesky", exact), ("plain", plain)):
            start = time.process_time()
            with one_thread():
                errors = fractional_error(test.accelerations, train()(test.positions))
            health = ""
            if name == "ours":
                facts = ours.facts()
                health = f", jitter {facts['jitter']:g}, condition {facts['condition_number']:.0e}"
            print(
                f"seed {seed:2d}, {len(X)} samples, {name:15s}: {time.process_time() - start:6.1f} "
                f"s, median {np.median(errors):.1e}, worst {errors.max():.1e}, "
                f"{np.sum(errors > OUTLIER)} of {len(errors)} above 10^-0.5{health}",
                flush=True,
            )


if __name__ == "__main__":
    main()
