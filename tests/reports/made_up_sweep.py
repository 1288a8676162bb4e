"""Stores whose runs are made-up numbers: a real plan, real files, no training."""

import numpy as np

from unmodeled.pipeline.sweep.run_config import RunResult
from unmodeled.pipeline.sweep.sweep import sweep

BASE = {"data": {"train_periods": 3, "extrapolation_periods": 2}}
GP = {"kind": "exact_gp", "baseline": "none"}
NETWORK = {"kind": "spectral_mlp", "baseline": "none"}


def values_of(run):
    """Errors that grow with noise and fall with volume; the network is worse on every orbit."""
    axes, k = run.axes, run.initial_condition
    rng = np.random.default_rng(100 * k + (axes["kind"] == "exact_gp"))
    noise = axes.get("noise.state", 0.0) + 3 * axes.get("noise.acceleration", 0.0)
    volume = axes.get("data.train_periods", 10.0)
    size = {"exact_gp": 1e-4, "spectral_mlp": 1e-3}.get(axes["kind"], 1e-2)
    hard = np.random.default_rng(100 * k).normal(0, 0.2)  # an orbit is as hard for both
    train = (size + 0.3 * size**0.2 * noise) * 10**hard / volume * 10
    row = {"failure": "", "model_bytes": 2000}
    medians = {
        "train": train,
        "interpolation": 1.05 * train,
        "extrapolation": 0.5 * 10 ** rng.normal(0, 0.1),
    }
    for name, value in medians.items():
        row[f"{name}_median"] = float(value)
        if axes["kind"] == "exact_gp":
            row |= {f"{name}_coverage_68": 0.6 + 0.01 * k, f"{name}_coverage_95": 0.9}
    row["cost_train_s"] = 0.3 if axes["kind"] == "exact_gp" else 1.2
    row["cost_evaluate_one_s"] = 3e-5
    return row


def made_up_store(folder, name="made-up", learners=(GP, NETWORK), count=5, fail=0, **axes):
    """Write a store; the first ``fail`` runs have failed fits."""
    left = fail

    def run_batch(runs):
        nonlocal left
        for run in runs:
            if left > 0:
                left -= 1
                yield RunResult(run.id, {"failure": "Cholesky <broke> & down"})
            else:
                yield RunResult(run.id, values_of(run))

    content = {
        "name": name,
        "base": BASE,
        "axes": {"learner": list(learners), **axes},
        "initial_conditions": {"count": count},
    }
    sweep(content, folder, run_batch=run_batch)
    return folder
