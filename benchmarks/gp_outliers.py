"""Where the outliers of the paper's Gaussian process come from (its Fig. 10, 10^-0.5 to 10^2).

python benchmarks/gp_outliers.py --iterative --learning-rate 1 --epochs 300 --seeds {101..115}
python benchmarks/gp_outliers.py --periods 100 --seeds 101 102     # moderate volume; slow

Noise-free data.  The plain gpytorch loop in the four ways that its algebra can go: float32 (torch's
default) or float64, and the solver that the library takes above 800 samples without a word
(conjugate gradients, random traces; ``--iterative`` takes it at any size) or Cholesky.  An error
that only one of them has is one of the algebra.  Ours beside them.  With random traces the
gradient of the likelihood is noisy; at a high rate the lengthscale may collapse, and then the
process knows its samples and nothing between them.
"""

from __future__ import annotations

import argparse
import time
from contextlib import ExitStack

import gpytorch
import numpy as np
import torch
from reference_loop import reference_gp

from unmodeled.core.errors import NumericalError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import ExactGP
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare, simulate

Array = np.ndarray
OUTLIER = 10**-0.5
#: By name: numbers, and whether Cholesky is forced.
ROWS = {
    "float32": (torch.float32, False),
    "float32-cholesky": (torch.float32, True),
    "float64": (torch.float64, False),
    "float64-cholesky": (torch.float64, True),
    "ours": None,
}
ALWAYS = 10**6


def main() -> None:
    """Print medians and worst errors of each, and how many runs are outliers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--periods", type=float, default=10.0)
    parser.add_argument("--epochs", type=int, default=100)
    parser.add_argument("--learning-rate", type=float, default=0.1)
    parser.add_argument("--seeds", type=int, nargs="+", default=[101, 102, 103])
    parser.add_argument("--rows", nargs="+", choices=list(ROWS), default=list(ROWS))
    parser.add_argument(
        "--iterative", action="store_true", help="as above 800 samples, at any size"
    )
    arguments = parser.parse_args()
    outliers = dict.fromkeys(arguments.rows, 0)
    for seed in arguments.seeds:
        data = data_of(seed, arguments.periods)
        for row in arguments.rows:
            start = time.process_time()
            torch.manual_seed(seed)  # the random traces of the iterative solver
            try:
                found, note = errors(data, row, arguments)
            except (NumericalError, RuntimeError, ValueError) as error:
                outliers[row] += 1
                print(f"seed {seed}, {row}: {type(error).__name__}: {str(error)[:90]}", flush=True)
                continue
            outliers[row] += np.median(found["interpolation"]) > OUTLIER
            shown = ", ".join(
                f"{name} {np.median(e):.1e} (worst {e.max():.1e})" for name, e in found.items()
            )
            seconds = time.process_time() - start
            size = len(data.train)
            print(f"seed {seed}, {size} samples, {row}, {seconds:.0f} s: {shown}{note}", flush=True)
    for row, count in outliers.items():
        of = len(arguments.seeds)
        print(f"{row}: {count} of {of} runs with an interpolation median above 10^-0.5")


def data_of(seed: int, periods: float) -> LearningData:
    """Return noise-free data of one orbit."""
    config = CharacterizationConfig.resolve(
        {
            "seed": seed,
            "data": {"train_periods": periods},
            "learners": [{"kind": "exact_gp", "baseline": "none"}],
        }
    )
    return prepare(config, (), lambda c, b: simulate(c, b, compare_integrators=False))


def errors(
    data: LearningData, row: str, chosen: argparse.Namespace
) -> tuple[dict[str, Array], str]:
    """Train one and return its fractional errors in training and interpolation, and a note."""
    X, y = data.train.observed_positions, data.train.observed_accelerations
    tested = {s.name: s for s in data.sets if s.name != "extrapolation"}
    settings = ROWS[row]
    with one_thread(), ExitStack() as stack:
        if settings is None:
            model = ExactGP(optimizer="newton").fit(X, y)
            facts = model.facts()
            note = f"; jitter {facts['jitter']:g}, condition {facts['condition_number']:.0e}"
        else:
            dtype, cholesky = settings
            limit = ALWAYS if cholesky else 0 if chosen.iterative else 800
            stack.enter_context(gpytorch.settings.max_cholesky_size(limit))
            model = reference_gp(X, y, chosen.epochs, chosen.learning_rate, dtype)
            note = f"; loss {model.loss:.4g}"
        found = {
            name: fractional_error(s.accelerations, model.predict(s.positions))
            for name, s in tested.items()
        }
    return found, note


if __name__ == "__main__":
    main()
