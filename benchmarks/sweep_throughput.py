"""Batched training against the plain loop: same data, one thread each, both skills.

python benchmarks/sweep_throughput.py             # a sample of Figs. 12 and 13 of [Neamati2022]
python benchmarks/sweep_throughput.py --count 20  # more initial conditions a cell
python benchmarks/sweep_throughput.py --tune      # the plain loop's rates, on other orbits

Rows of the plain loop are at the rate that one would start with and at the best of a few, chosen
by median loss with ``--tune`` on the seeds below 100; everything else here runs on seeds above,
which no setting was chosen on.  The second row of the batched network (fewer epochs at a higher
rate) was chosen on seeds 1 to 4 so that its loss is that of the plain loop.

Times are of the processor, so that a busy machine does not decide; the loss is the negative log
likelihood of the scaled samples for the Gaussian process and the mean squared error of the scaled
samples for the network, lower is better.
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
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.prepare import prepare, simulate

#: Noise of the sampled cells, out of 0, 0.1, ..., 1 on each of the two axes.
CELLS = ({}, {"state": 0.5}, {"acceleration": 0.2}, {"acceleration": 1.0})
NETWORK = {"kind": "spectral_mlp", "baseline": "none", "precision": "single"}
#: Ours, by name of the row.
BATCHES: dict[str, dict[str, dict[str, Any]]] = {
    "exact_gp": {
        "batch, newton": {"kind": "exact_gp", "baseline": "none", "optimizer": "newton"},
    },
    "spectral_mlp": {
        "batch, same epochs and rate": NETWORK | {"epochs": 1000, "learning_rate": 1e-3},
        "batch, 640 epochs at 4e-3": NETWORK | {"epochs": 640, "learning_rate": 4e-3},
    },
}
#: The plain loop: how to train, the usual rate, the tuned one, and the rates that were tried.
REFERENCES: dict[str, tuple[Callable[..., ReferenceModel], float, float, tuple[float, ...]]] = {
    "exact_gp": (reference_gp, 0.1, 0.2, (0.05, 0.1, 0.2, 0.4)),
    "spectral_mlp": (reference_network, 1e-3, 4e-3, (5e-4, 1e-3, 2e-3, 4e-3, 8e-3)),
}
SETS = ("train", "interpolation", "extrapolation")
FIRST_SEED = 101

_orbits: dict[int, Any] = {}


def main() -> None:
    """Train all on the same data sets; print times, ratios and skills."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=5, help="initial conditions a cell")
    parser.add_argument("--models", nargs="+", choices=list(BATCHES), default=list(BATCHES))
    parser.add_argument("--tune", action="store_true", help="rates of the plain loop only")
    arguments = parser.parse_args()
    for name in arguments.models:
        if arguments.tune:
            tune(name, arguments.count)
        else:
            compare(name, arguments.count)


def compare(name: str, count: int) -> None:
    """Print one line a row, medians over all cells, and the ratios of the times."""
    train, usual, tuned, _ = REFERENCES[name]
    rates = {f"plain loop, rate {rate:g}": rate for rate in (usual, tuned)}
    spent = dict.fromkeys([*rates, *BATCHES[name]], 0.0)
    found: dict[str, list[list[float]]] = {row: [] for row in spent}
    warm(name)
    for data in cells(range(FIRST_SEED, FIRST_SEED + count), BATCHES[name]):
        for row, learner in BATCHES[name].items():
            seconds, fitted = batch(learner, data)
            spent[row] += seconds
            found[row] += fitted
        for row, rate in rates.items():
            for one in data:
                seconds, skills = plain(train, rate, one)
                spent[row] += seconds
                found[row].append(skills)
    runs = count * len(CELLS)
    print(f"{name}, {runs} runs, seeds from {FIRST_SEED}: s a run; median loss; median errors in")
    print("training, interpolation, extrapolation; worst interpolation error")
    for row, seconds in spent.items():
        table = np.array(found[row])
        medians = ", ".join(f"{v:.3g}" for v in np.median(table, axis=0))
        print(f"  {row:28s} {seconds / runs:7.3f} s  {medians}; {table[:, 2].max():.2g}")
    for ours in BATCHES[name]:
        for theirs in rates:
            lower = np.array(found[ours])[:, 0] <= np.array(found[theirs])[:, 0]
            ratio = spent[theirs] / spent[ours]
            print(f"  {ours} against {theirs}: {ratio:.1f} times faster, lower loss in", end="")
            print(f" {lower.mean():.0%} of the runs")


def tune(name: str, count: int) -> None:
    """Print the plain loop's median loss at each rate, by cell and over all."""
    train, _, _, rates = REFERENCES[name]
    losses = {rate: [] for rate in rates}
    for data in cells(range(1, 1 + count), BATCHES[name]):
        for rate in rates:
            losses[rate].append(np.median([plain(train, rate, one)[1][0] for one in data]))
    print(f"{name}, median loss by cell, and rank summed over cells (lower is better)")
    table = np.array(list(losses.values()))
    ranks = table.argsort(axis=0).argsort(axis=0).sum(axis=1)
    for rate, row, rank in zip(rates, table, ranks, strict=True):
        print(f"  rate {rate:g}: " + ", ".join(f"{v:.4g}" for v in row) + f"; {rank}")


def cells(seeds: range, rows: dict[str, dict[str, Any]]) -> Any:
    """Yield the data of one cell after the other."""
    learner = next(iter(rows.values()))

    def orbits(config: CharacterizationConfig, body: Any) -> Any:
        if config.seed not in _orbits:
            _orbits[config.seed] = simulate(config, body, compare_integrators=False)
        return _orbits[config.seed]

    for cell in CELLS:
        contents = [{"seed": s, "noise": cell, "learners": [learner]} for s in seeds]
        yield [prepare(CharacterizationConfig.resolve(c), (), orbits) for c in contents]


def batch(learner: dict[str, Any], data: list[LearningData]) -> tuple[float, list[list[float]]]:
    """Train one cell; return processor seconds and loss and errors of each run."""
    spec = CharacterizationConfig.resolve({"learners": [learner]}).learners[0]
    start = time.process_time()
    fitted = fit_batch(
        spec.build(),
        [one.train.observed_positions for one in data],
        [one.train.observed_accelerations for one in data],
        [NoiseLevel(one.noise.state, one.noise.acceleration) for one in data],
    )
    seconds = time.process_time() - start
    found = []
    for model, one in zip(fitted, data, strict=True):
        if isinstance(model, NumericalError):
            raise SystemExit(f"{spec.kind}: {model}")
        facts = model.facts()
        loss = facts.get("loss") or sum(facts[f"negative_log_likelihood_{a}"] for a in "xyz")
        found.append([float(loss), *(_median(one, s, model.predict) for s in SETS)])
    return seconds, found


def plain(
    train: Callable[..., ReferenceModel], rate: float, one: LearningData
) -> tuple[float, list[float]]:
    """Train one run; the same work as `batch`: up to the first prediction."""
    with one_thread():
        start = time.process_time()
        model = train(
            one.train.observed_positions, one.train.observed_accelerations, learning_rate=rate
        )
        seconds = time.process_time() - start
        return seconds, [model.loss, *(_median(one, s, model.predict) for s in SETS)]


def warm(name: str) -> None:
    """Use torch's kernels once before they are timed."""
    train, usual, _, _ = REFERENCES[name]
    data = next(cells(range(1, 2), BATCHES[name]))
    for learner in BATCHES[name].values():
        batch(learner | {"epochs": 20}, data)
    train(
        data[0].train.observed_positions,
        data[0].train.observed_accelerations,
        20,
        learning_rate=usual,
    )


def _median(data: LearningData, name: str, predict: Callable[[Any], Any]) -> float:
    chosen = getattr(data, name)
    return float(np.median(fractional_error(chosen.accelerations, predict(chosen.positions))))


if __name__ == "__main__":
    main()
