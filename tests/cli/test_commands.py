"""The commands do what the README says."""

import json
import sys
from pathlib import Path

import pandas as pd
import pytest

from unmodeled import cli
from unmodeled.pipeline.config import load_config
from unmodeled.pipeline.navigation.scenario_config import load_scenario
from unmodeled.pipeline.yaml12 import read_yaml

SCENARIOS = Path(__file__).parents[2] / "scenarios"

CONFIG = """\
name: small
seed: 3
body: bennu
data: {trajectory: simulated, train_periods: 3, extrapolation_periods: 2}
noise: {acceleration: 0.01}
learners: [{kind: point_mass}, {kind: zonal_oracle}, {kind: rbf_network, centres: 10}]
flight: {periods: [1], orbits: 1}
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.yaml").write_text(CONFIG)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["unmodeled", *arguments])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert stop.value.code in (0, None)
        return capsys.readouterr().out

    return call


def test_characterize_writes_a_whole_run_folder(run, tmp_path):
    out = run("characterize", "c.yaml")
    assert "runs/small/report.html" in out
    folder = tmp_path / "runs" / "small"
    names = {p.name for p in folder.iterdir()}
    assert {
        "report.html",
        "figures",
        "models",
        "config.yaml",
        "provenance.json",
        "summary.csv",
        "flights.csv",
        "costs.csv",
        "samples.parquet",
    } <= names
    assert [p.name for p in folder.parent.iterdir()] == ["small"]  # no staging left
    provenance = json.loads((folder / "provenance.json").read_text())
    assert provenance["seed"] == 3


def test_same_seed_same_numbers_to_the_last_digit(run, tmp_path):
    run("characterize", "c.yaml", "--out", "a")
    run("characterize", "c.yaml", "--out", "b")
    run("characterize", "c.yaml", "--out", "other", "--seed", "4")
    for name in ("summary.csv", "flights.csv"):
        first = (tmp_path / "a" / name).read_bytes()
        assert first == (tmp_path / "b" / name).read_bytes()
        assert first != (tmp_path / "other" / name).read_bytes()


def test_the_resolved_configuration_gives_the_same_run(run, tmp_path):
    run("characterize", "c.yaml", "--out", "a")
    run("characterize", "a/config.yaml", "--out", "b")
    assert (tmp_path / "a/summary.csv").read_bytes() == (tmp_path / "b/summary.csv").read_bytes()


def test_set_changes_a_key(run, tmp_path):
    run("characterize", "c.yaml", "--out", "a", "--set", "noise.acceleration=1e-1")
    assert "acceleration: 0.1" in (tmp_path / "a/config.yaml").read_text()


def test_json_output(run):
    shown = json.loads(run("characterize", "c.yaml", "--json"))
    assert shown["name"] == "small"
    rows = {(r["learner"], r["set"]): r for r in shown["summary"]}
    assert rows["zonal oracle", "extrapolation"]["median"] < 1e-2
    assert shown["failures"] == {}
    assert 0 <= shown["flight_floor_m"] < 1e-6


def test_own_orbit_replaces_the_simulated_one_with_one_line(run, tmp_path):
    """Simulate, write CSV, read it back: the noise-free result is the same orbit's result."""
    shown = run("simulate", "c.yaml", "--out", "orbits")
    assert "orbits/train.csv" in shown
    run("characterize", "c.yaml", "--out", "simulated", "--set", "noise.acceleration=0")
    text = CONFIG.replace("trajectory: simulated", "trajectory: orbits/train.csv")
    text = text.replace(
        "extrapolation_periods: 2",
        "extrapolation_periods: 2, extrapolation_trajectory: orbits/extrapolation-1.csv",
    )
    (tmp_path / "own.yaml").write_text(text.replace("noise: {acceleration: 0.01}\n", ""))
    run("characterize", "own.yaml", "--out", "own")
    ours = pd.read_csv(tmp_path / "own/summary.csv").set_index(["learner", "set"])
    theirs = pd.read_csv(tmp_path / "simulated/summary.csv").set_index(["learner", "set"])
    for key in (("point mass", "train"), ("point mass", "extrapolation")):
        assert ours.loc[key, "median"] == pytest.approx(theirs.loc[key, "median"], rel=1e-9)
    assert list(ours["count"]) == list(theirs["count"])


def test_lists(run):
    assert "bennu" in run("bodies")
    shown = run("learners")
    assert "spectral_mlp" in shown
    assert "residual" not in shown.split()
    listed = json.loads(run("learners", "--json"))
    assert listed["exact_gp"]["inputs"] == "any"
    assert listed["harmonic_gp"] | {"hyperparameters": {}} == {
        "hyperparameters": {},
        "covariance": True,
        "inputs": "position",
        "what": listed["harmonic_gp"]["what"],
    }
    assert listed["elm"]["hyperparameters"]["nodes"] == 200
    assert run("version").startswith("unmodeled 0.")


def test_help_names_every_command(run):
    shown = run("--help")
    for command in ("characterize", "simulate", "bodies", "learners", "version"):
        assert command in shown


@pytest.mark.parametrize("name", sorted(p.name for p in SCENARIOS.glob("*.yaml")))
def test_every_scenario_is_valid(name):
    if "kind" in read_yaml(SCENARIOS / name):  # one that filters are flown on
        assert load_scenario(SCENARIOS / name).name == Path(name).stem
    else:
        assert load_config(SCENARIOS / name).learners


def test_the_scenario_for_an_own_orbit_runs_as_it_is(run, tmp_path):
    run("simulate", "c.yaml", "--out", "orbits")
    (tmp_path / "orbits" / "train.csv").rename(tmp_path / "orbits" / "my-orbit.csv")
    text = (SCENARIOS / "own-orbit.yaml").read_text()
    (tmp_path / "own.yaml").write_text(text.replace("spectral_mlp}", "spectral_mlp, epochs: 50}"))
    shown = run("characterize", "own.yaml", "--data", "orbits")
    assert "runs/own-orbit/report.html" in shown
    assert "on later revolutions" in shown
