"""Batched training against the plain loop: same data, one thread each, both skills.

python benchmarks/sweep_throughput.py             # a sample of Figs. 12 and 13 of [Neamati2022]
python benchmarks/sweep_throughput.py --count 20  # more initial conditions a cell
python benchmarks/sweep_throughput.py --skip-reference  # ours only

A ratio above 1 is in favour of the batch.  Times are of the processor, so that a busy machine
does not decide; the loss is the negative log likelihood of the scaled samples for the Gaussian
process and the mean squared error of the scaled samples for the network, lower is better.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from reference_loop import ReferenceModel, reference_gp, reference_network

from unmodeled.core.errors import NumericalError
from unmodeled.core.threads import one_thread
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import NoiseLevel, fit_batch
from unmodeled.pipeline.batch_characterize import train_and_score
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare, simulate

#: Noise of the sampled cells, out of 0, 0.1, ..., 1 on each of the two axes.
CELLS = ({}, {"state": 0.5}, {"acceleration": 0.2}, {"acceleration": 1.0})
#: 2 models, 2 kinds of noise, 11 levels, 100 initial conditions.
GRID = 4400
LEARNERS: dict[str, dict[str, Any]] = {
    "exact_gp": {"kind": "exact_gp", "baseline": "none", "optimizer": "newton"},
    "spectral_mlp": {
        "kind": "spectral_mlp",
        "baseline": "none",
        "epochs": 640,
        "learning_rate": 4e-3,
        "precision": "single",
    },
}
REFERENCES: dict[str, Callable[..., ReferenceModel]] = {
    "exact_gp": reference_gp,
    "spectral_mlp": reference_network,
}
SETS = ("train", "interpolation", "extrapolation")


def main() -> None:
    """Train both on the same data sets; print times, ratio and skills, and the whole grid."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=6, help="initial conditions a cell")
    parser.add_argument("--models", nargs="+", choices=list(LEARNERS), default=list(LEARNERS))
    parser.add_argument("--skip-reference", action="store_true")
    arguments = parser.parse_args()
    memory: dict[int, Any] = {}

    def orbits(config: CharacterizationConfig, body: Any) -> Any:
        if config.seed not in memory:
            memory[config.seed] = simulate(config, body, compare_integrators=False)
        return memory[config.seed]

    preparation, total = 0.0, 0.0
    warm = True
    for name in arguments.models:
        learner = LEARNERS[name]
        ours, theirs = [], []
        spent = {"ours": 0.0, "training": 0.0, "reference": 0.0}
        for cell in CELLS:
            configs = [
                CharacterizationConfig.resolve({"seed": s, "noise": cell, "learners": [learner]})
                for s in range(1, arguments.count + 1)
            ]
            start = time.process_time()
            data = [prepare(config, (), orbits) for config in configs]
            preparation += time.process_time() - start
            if warm:  # first use of torch's kernels
                list(train_and_score([(configs[0], data[0])]))
                warm = False
            start = time.process_time()
            fitted = fit_batch(
                configs[0].learners[0].build(),
                [one.train.observed_positions for one in data],
                [one.train.observed_accelerations for one in data],
                [NoiseLevel(one.noise.state, one.noise.acceleration) for one in data],
            )
            spent["training"] += time.process_time() - start
            start = time.process_time()
            results = list(train_and_score(list(zip(configs, data, strict=True))))
            spent["ours"] += time.process_time() - start
            for model, result, one in zip(fitted, results, data, strict=True):
                if isinstance(model, NumericalError) or result.failure:
                    raise SystemExit(f"{name}: {result.failure}")
                facts = model.facts()
                loss = float(facts["loss"]) if "loss" in facts else _negative_log_likelihood(facts)
                ours.append([loss, *(_median(one, s, model.predict) for s in SETS)])
            if not arguments.skip_reference:
                with one_thread():
                    for one in data:
                        # The same work for both: training up to the first prediction.
                        start = time.process_time()
                        model = REFERENCES[name](
                            one.train.observed_positions, one.train.observed_accelerations
                        )
                        spent["reference"] += time.process_time() - start
                        theirs.append([model.loss, *(_median(one, s, model.predict) for s in SETS)])
        runs = len(ours)
        print(f"{name}, {runs} runs; per run, and medians of loss and fractional errors")
        _line("plain loop", spent["reference"] / runs, theirs)
        _line("batch", spent["training"] / runs, ours)
        print(
            f"  batch, with scoring (test sets, calibration, timing) {spent['ours'] / runs:.3f} s"
        )
        if theirs:
            print(f"  ratio of training: {spent['reference'] / spent['training']:.1f}")
            better = np.mean(np.array(ours)[:, 0] <= np.array(theirs)[:, 0])
            print(f"  share of runs in which the batch has the lower loss: {better:.0%}")
        total += spent["ours"] / runs * GRID / 2
    seeds = len(memory)
    print(f"preparation: {preparation / seeds:.3f} s an initial condition, all cells")
    total += preparation / seeds * 100
    if len(arguments.models) == len(LEARNERS):
        print(f"the whole grid of {GRID} runs on two free processors: {total / 2 / 60:.1f} min")


def _negative_log_likelihood(facts: dict[str, float | str]) -> float:
    return sum(float(facts[f"negative_log_likelihood_{axis}"]) for axis in "xyz")


def _median(data: LearningData, name: str, predict: Callable[[Any], Any]) -> float:
    chosen = getattr(data, name)
    return float(np.median(fractional_error(chosen.accelerations, predict(chosen.positions))))


def _line(label: str, seconds: float, rows: list[list[float]]) -> None:
    if rows:
        table = np.array(rows)
        medians = ", ".join(f"{v:.3g}" for v in np.median(table, axis=0))
        worst = f"worst interpolation {table[:, 2].max():.2g}"
        print(f"  {label:22s} {seconds:7.3f} s  {medians};  {worst}")


if __name__ == "__main__":
    main()
