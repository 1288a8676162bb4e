"""Time and memory of one run by learner and data volume: the numbers of `sweep.cost_model`.

    python benchmarks/sweep_costs.py [KIND ...]

Each row is a process of its own, on one thread, with the runner of a sweep and a batch of four
(one at 2,375 samples): a first batch loads and compiles everything, a second and a third one with
few and many epochs are timed. Seconds are processor time of one run, so that a busy machine gives
about the same.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

#: Learner and the number of epochs for each volume; fewer where an epoch is slow.
LEARNERS = {
    "exact_gp": ({"kind": "exact_gp", "optimizer": "adam"}, (100, 40, 10)),
    "exact_gp lbfgs": ({"kind": "exact_gp", "optimizer": "lbfgs"}, (None,) * 3),
    "exact_gp newton": ({"kind": "exact_gp", "optimizer": "newton"}, (None,) * 3),
    "spectral_mlp": ({"kind": "spectral_mlp"}, (500, 200, 100)),
    "spectral_mlp single": ({"kind": "spectral_mlp", "precision": "single"}, (500, 200, 100)),
    "mlp": ({"kind": "mlp"}, (None,) * 3),
    "rbf_network": ({"kind": "rbf_network"}, (None,) * 3),
    "harmonic_gp": ({"kind": "harmonic_gp"}, (None,) * 3),
    "harmonic_least_squares": ({"kind": "harmonic_least_squares"}, (None,) * 3),
    "nearest_neighbour": ({"kind": "nearest_neighbour"}, (None,) * 3),
    "zonal_oracle": ({"kind": "zonal_oracle"}, (None,) * 3),
    "point_mass": ({"kind": "point_mass"}, (None,) * 3),
    "fitted_point_mass": ({"kind": "fitted_point_mass"}, (None,) * 3),
    "curl_free_gp": ({"kind": "curl_free_gp"}, (None,) * 2),  # it refuses 2,375 samples
    "harmonic_kernel_gp": ({"kind": "harmonic_kernel_gp"}, (None,)),  # minutes at 950
    "sparse_gp": ({"kind": "sparse_gp"}, (None,) * 3),
    "elm": ({"kind": "elm"}, (None,) * 3),
    "potential_mlp": ({"kind": "potential_mlp"}, (None,) * 3),
}
#: Training and extrapolation periods, 25 samples each.
VOLUMES = ((10, 3), (40, 5), (100, 10))
#: Runs of a batch at each volume.
RUNS = (4, 4, 1)


def main() -> None:
    """Print one row a learner and volume."""
    names = sys.argv[1:] or list(LEARNERS)
    print(
        f"{'learner':24} {'samples':>7} {'epochs':>6} {'fixed s':>8} {'epoch s':>8} {'peak MB':>7}"
    )
    for name in names:
        learner, epochs = LEARNERS[name]
        # The processes as in Neamati's figures; a point mass taken off costs no time.
        learner = learner | ({"baseline": "none"} if name.startswith("exact_gp") else {})
        for volume, count, runs in zip(VOLUMES, epochs, RUNS, strict=False):
            job = {"learner": learner, "epochs": count, "volume": volume, "runs": runs}
            done = subprocess.run(
                [sys.executable, __file__, "--one", json.dumps(job)],
                capture_output=True,
                text=True,
                check=True,
                env=os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
            )
            row = json.loads(done.stdout)
            print(
                f"{name:24} {row['n']:7d} {count or '':>6} {row['fixed']:8.4f} "
                f"{row['epoch']:8.4f} {row['peak'] / 1e6:7.0f}",
                flush=True,
            )


def one(job: str) -> None:
    """Measure one of them and print it as JSON."""
    from unmodeled.pipeline.sweep.grid import make_plan
    from unmodeled.pipeline.sweep.runner import BatchRunner
    from unmodeled.pipeline.sweep.sweep_config import SweepConfig

    given = json.loads(job)
    train, other = given["volume"]

    def row(epochs: int | None) -> dict:
        learner = given["learner"] | ({"epochs": epochs} if epochs else {})
        content = {
            "base": {"data": {"train_periods": train, "extrapolation_periods": other}},
            "axes": {"learner": [learner]},
            "initial_conditions": {"count": given["runs"]},
        }
        results = list(BatchRunner()(make_plan(SweepConfig.resolve(content)).runs))
        cpu = sum(r.values["cost_cpu_s"] for r in results) / len(results)
        return results[-1].values | {"cost_cpu_s": cpu}

    many = given["epochs"]
    few = many and max(2, many // 5)
    first = row(few)
    if many:  # the first one also compiled and loaded
        first = row(few)
    last = row(many)
    cpu = last["cost_cpu_s"]
    epoch = (cpu - first["cost_cpu_s"]) / (many - few) if many else 0.0
    print(
        json.dumps(
            {
                "n": last["train_count"],
                "fixed": cpu - epoch * (many or 0),
                "epoch": epoch,
                "peak": last["cost_peak_bytes"],
            }
        )
    )


if __name__ == "__main__":
    one(sys.argv[2]) if sys.argv[1:2] == ["--one"] else main()
