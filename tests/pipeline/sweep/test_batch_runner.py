"""The default runner: the rows of `PlainRunner` whatever the batch, and what failures cost."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

import unmodeled as um
from unmodeled.core.errors import ConfigError
from unmodeled.models.learned import SpectralMLP
from unmodeled.models.learned._spectral_training import SpectralStack
from unmodeled.pipeline import characterize
from unmodeled.pipeline.sweep.grid import make_plan
from unmodeled.pipeline.sweep.run_config import RunConfig
from unmodeled.pipeline.sweep.runner import BatchRunner, PlainRunner
from unmodeled.pipeline.sweep.store import Store
from unmodeled.pipeline.sweep.sweep_config import SweepConfig
from unmodeled.pipeline.sweep.table import results_only
from unmodeled.pipeline.yaml12 import write_yaml

NETWORK = {"kind": "spectral_mlp", "layers": 3, "width": 40, "epochs": 30, "precision": "single"}
CONTENT = {
    "name": "batches",
    "base": {"data": {"train_periods": 3, "extrapolation_periods": 2}},
    "axes": {
        "learner": [
            {"kind": "exact_gp", "baseline": "none", "optimizer": "newton"},
            NETWORK,
            {"kind": "rbf_network", "centres": 10},
        ],
        "noise.state": [0, 0.1],
    },
    "initial_conditions": {"count": 8},
}


def cells(content):
    found = {}
    for run in make_plan(SweepConfig.resolve(content)).runs:
        found.setdefault(run.cell, []).append(run)
    return list(found.values())


def rows(results):
    """Bytes of what depends on the configuration only, by run."""
    return {
        r.id: json.dumps(
            {k: v for k, v in r.values.items() if not k.startswith("cost_")}, sort_keys=True
        )
        for r in results
    }


@pytest.fixture(scope="module")
def plain():
    return rows(PlainRunner()(make_plan(SweepConfig.resolve(CONTENT)).runs))


@pytest.mark.parametrize("size", [1, 7, 100])
def test_rows_do_not_depend_on_the_batch(plain, size):
    found = {}
    for cell in cells(CONTENT):
        turned = cell[::-1] if size == 7 else cell
        for k in range(0, len(turned), size):
            found |= rows(BatchRunner()(turned[k : k + size]))
    assert found == plain


def test_networks_are_trained_side_by_side(monkeypatch):
    sizes = []
    fit = SpectralMLP._fit_stack.__func__
    monkeypatch.setattr(
        SpectralMLP,
        "_fit_stack",
        classmethod(lambda c, members, *a: sizes.append(len(members)) or fit(c, members, *a)),
    )
    content = CONTENT | {"axes": {"learner": [NETWORK]}}
    results = list(BatchRunner()(cells(content)[0]))
    assert sizes == [8]
    costs = {r.values["cost_total_s"] for r in results}
    assert len(costs) == 1  # shares of one stack
    assert results[0].values["cost_total_s"] > results[0].values["cost_train_s"] > 0


def with_config(run, **data):
    content = run.config.as_dict()
    content["data"] |= data
    return RunConfig(f"{run.id}-{data}", run.cell, type(run.config).resolve(content))


def test_a_run_that_fails_costs_no_other(monkeypatch):
    """Data that cannot be made or learned, a fit that breaks down: three rows with words."""
    runs = cells(CONTENT | {"axes": {"learner": [NETWORK]}})[0][:5]
    alone = rows(BatchRunner()(runs))
    low = {"semi_major_axis": 1.1, "eccentricity": 0.5, "inclination": 30.0}
    hits = with_config(runs[0], orbit=low)
    few = with_config(runs[1], train_periods=1, samples_per_period=8)
    monkeypatch.setattr(SpectralMLP, "min_samples", 10)
    best = SpectralStack._best

    def one_diverges(stack, candidates, x, t, white):
        # By its data: the third run's, wherever it stands in a stack.
        return None if x.sum() == third else best(stack, candidates, x, t, white)

    seen = []
    monkeypatch.setattr(SpectralStack, "_best", lambda s, c, x, t, w: seen.append(x.sum()))
    list(BatchRunner()(runs[2:3]))
    (third,) = seen
    monkeypatch.setattr(SpectralStack, "_best", one_diverges)
    batch = [hits, few, *runs]
    found = {r.id: r.values for r in BatchRunner()(batch)}
    assert "hits the body" in found[hits.id]["failure"]
    assert "training samples. Allowed: at least 10" in found[few.id]["failure"]
    assert "is not finite. Lower learning_rate" in found[runs[2].id]["failure"]
    healthy = [runs[0], runs[1], runs[3], runs[4]]
    again = rows(r for r in BatchRunner()(batch) if r.id in {run.id for run in healthy})
    assert again == {run.id: alone[run.id] for run in healthy}


def test_a_test_that_breaks_down_costs_no_other(monkeypatch):
    from unmodeled.core.errors import DataError

    runs = cells(CONTENT)[0][:2]
    calls = []

    def refuses(*given):
        calls.append(given)
        if len(calls) == 1:
            raise DataError("predicted variance -1", allowed="variances > 0")
        return real(*given)

    real = characterize.calibrate
    monkeypatch.setattr(characterize, "calibrate", refuses)
    first, second = BatchRunner()(runs)
    assert first.values["failure"] == "predicted variance -1. Allowed: variances > 0."
    assert second.values["failure"] == ""


def test_device_without_a_card():
    with pytest.raises(ConfigError, match='device is "abacus"'):
        list(BatchRunner(device="abacus")(cells(CONTENT)[0][:1]))


SLOW = {
    "name": "killed",
    "base": CONTENT["base"],
    "axes": {"learner": [NETWORK | {"width": 80, "epochs": 400}], "noise.state": [0, 0.1]},
    "initial_conditions": {"count": 20},
}


def test_killed_inside_a_batch_only_unfinished_runs_are_lost(tmp_path):
    """Costs tell a row that was computed again from one that was kept."""
    write_yaml(SLOW, tmp_path / "s.yaml")
    folder = tmp_path / "store"
    command = [sys.executable, "-m", "unmodeled.cli", "sweep", str(tmp_path / "s.yaml")]
    command += ["--out", str(folder), "--batch-size", "20"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 120
    while time.monotonic() < until and process.poll() is None:
        if folder.exists() and (found := Store(folder).finished()) and len(found) % 20:
            break
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait(60) == -signal.SIGKILL
    kept = Store(folder).finished()
    assert 0 < len(kept) < 40
    table = um.sweep(folder)
    after = Store(folder).finished()
    assert len(after) == 40
    assert {i: after[i] for i in kept} == kept
    whole = um.sweep(SLOW, tmp_path / "whole", batch_size=3)
    assert results_only(table).equals(results_only(whole))
