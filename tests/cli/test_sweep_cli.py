"""The commands of sweeps, and what they say when they are stopped or asked wrongly."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from unmodeled import cli
from unmodeled.pipeline.sweep.grid import make_plan
from unmodeled.pipeline.sweep.sweep_config import load_sweep

SWEEPS = Path(__file__).parents[2] / "sweeps"

CONFIG = """\
name: small
base: {data: {train_periods: 3, extrapolation_periods: 2}}
axes:
  learner: [{kind: rbf_network, centres: 10}, {kind: point_mass}]
  noise.state: [0, 0.1]
initial_conditions: {count: 2}
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(CONFIG)

    def call(*arguments, code=0):
        monkeypatch.setattr(sys, "argv", ["unmodeled", *arguments])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        shown = capsys.readouterr()
        assert (stop.value.code or 0) == code, shown.err
        assert "Traceback" not in shown.err
        return " ".join((shown.out if code == 0 else shown.err).split())

    return call


def test_dry_run_writes_nothing(run, tmp_path):
    shown = run("sweep", "s.yaml", "--dry-run", "--workers", "2")
    assert "0 of 8 runs are finished" in shown
    assert "8 runs are left: about" in shown
    assert "GB for each worker (8 by the built-in table)" in shown
    assert "on 2 worker(s) here: about" in shown
    assert [p.name for p in tmp_path.iterdir()] == ["s.yaml"]


def test_sweep_status_resume_export(run, tmp_path):
    shown = run("sweep", "s.yaml")
    assert "8 of 8 runs are finished" in shown
    assert "unmodeled export runs/small --out small.csv" in shown
    assert "8 of 8" in run("status", "runs/small")
    assert json.loads(run("status", "runs/small", "--json"))["finished"] == 8
    before = (tmp_path / "runs/small/results.parquet").read_bytes()
    assert "8 of 8" in run("resume", "runs/small")
    assert (tmp_path / "runs/small/results.parquet").read_bytes() == before
    assert run("export", "runs/small", "--out", "t.csv") == "t.csv: 8 runs"
    assert len(pd.read_csv(tmp_path / "t.csv")) == 8
    assert json.loads(run("sweep", "s.yaml", "--dry-run", "--json"))["remaining"]["runs"] == 0


def test_half_a_sweep_is_estimated_from_what_is_finished(run):
    run("sweep", "s.yaml", "--shard", "1/2")
    found = json.loads(run("status", "runs/small", "--json"))
    assert 0 < found["finished"] < 8
    assert found["remaining"]["measured_here"] > 0


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("sweep", "none.yaml"), "no file none.yaml"),
        (("sweep", "s.yaml", "--shard", "3/2"), "Allowed: i/n with 1 <= i <= n"),
        (("sweep", "s.yaml", "--workers", "0"), "0 workers"),
        (("sweep", "s.yaml", "--batch-size", "0"), "batch_size is 0"),
        (("sweep", "s.yaml", "--out", "s.yaml"), "s.yaml is a file"),
        (("sweep", "s.yaml", "--out", "."), "holds files that are not a sweep"),
        (("resume", "."), "is not the folder of a sweep"),
        (("status", "nowhere"), "is not the folder of a sweep"),
        (("export", "nowhere", "--out", "a.csv"), "is not the folder of a sweep"),
    ],
)
def test_bad_input(run, arguments, expected):
    shown = run(*arguments, code=2)
    assert shown.startswith("error: ")
    assert expected in shown


def test_unknown_axis(run, tmp_path):
    (tmp_path / "s.yaml").write_text(CONFIG.replace("noise.state", "noise.stat"))
    assert 'unknown axis "noise.stat". Did you mean "noise.state"?' in run(
        "sweep", "s.yaml", code=2
    )
    (tmp_path / "s.yaml").write_text(CONFIG.replace("[0, 0.1]", "[]"))
    assert "has no values: the grid is empty" in run("sweep", "s.yaml", code=2)


def test_full_disk(run, monkeypatch):
    from unmodeled.pipeline.sweep.journal import Journal

    real, count = Journal._write, 0

    def full(self, data):
        nonlocal count
        count += 1
        if count > 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        real(self, data)

    with monkeypatch.context() as patched:
        patched.setattr(Journal, "_write", full)
        shown = run("sweep", "s.yaml", code=2)
    assert "no space left while writing" in shown
    assert "every finished run is kept" in shown
    assert "3 of 8 runs are finished" in run("status", "runs/small")


@pytest.mark.parametrize(("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_and_sigterm(tmp_path, sent, code):
    text = CONFIG.replace("count: 2", "count: 60")
    (tmp_path / "s.yaml").write_text(text)
    process = subprocess.Popen(
        [sys.executable, "-m", "unmodeled.cli", "sweep", "s.yaml"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"COLUMNS": "200"},
        # A shell starts its background jobs with Ctrl-C ignored, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    journals = tmp_path / "runs" / "small" / "journal"
    until = time.monotonic() + 120
    while not (journals.is_dir() and any(journals.iterdir())) and time.monotonic() < until:
        time.sleep(0.02)
    process.send_signal(sent)
    _, shown = process.communicate(timeout=60)
    assert process.returncode == code
    assert "stopped; every finished run is kept." in shown
    assert "Go on with: unmodeled resume runs/small" in shown
    assert "Traceback" not in shown


@pytest.mark.parametrize("name", ["neamati-fig12", "neamati-fig13"])
def test_small_variants_are_parts_of_the_full_grids(name):
    full, small = (make_plan(load_sweep(SWEEPS / f"{name}{s}.yaml")) for s in ("", "-small"))
    assert (len(full.runs), len(small.runs)) == (2200, 36)
    assert {r.id for r in small.runs} < {r.id for r in full.runs}


def test_every_sweep_of_the_project_is_valid():
    names = sorted(p.name for p in SWEEPS.glob("*.yaml"))
    assert len(names) >= 8
    for name in names:
        config = load_sweep(SWEEPS / name)
        small = config.model_copy(
            update={"initial_conditions": config.initial_conditions.model_copy(update={"count": 1})}
        )
        plan = make_plan(small)
        assert config.name == name.removesuffix(".yaml")
        assert {r.config.learners[0].kind for r in plan.runs} >= {"exact_gp", "spectral_mlp"}
