"""The command `navigate`: a run folder, and exit code 2 with one sentence for bad input."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.cli.commands import call

ROOT = Path(__file__).resolve().parents[2]
SCENARIO = """\
name: small
kind: formation
truth: j2
orbit: {semi_major_axis_km: 8143.1, eccentricity: 0.14, inclination_deg: 98.2,
        periapsis_deg: 85.9, true_anomaly_deg: 1.0e-4}
chaser_true_anomaly_deg: 0.0
target: {area_m2: 0.2}
chaser: {area_m2: 1.2}
duration_s: 6000
measured: {step_s: 30.0, position_m: 0.1414}
start: {position_m: 1.0, velocity_m_s: 0.01}
settle_s: 1500
gap_orbits: [0.5, 0.6]
filters: [kf, dmc]
tuning:
  kf: {noise: 1.0e-5}
  dmc: {sigma: 1.0e-6, time_constant: 1000}
  pinn: {noise: 3.0e-6, rate: 0.3, data_weight: 1.0e-3}
"""


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "small.yaml"
    path.write_text(SCENARIO)
    return path


def test_a_run_folder(scenario, monkeypatch, capsys):
    code, out, err = call(
        monkeypatch, capsys, "navigate", scenario, "--runs", 2, "--filters", "kf,dmc,pinn"
    )
    assert code == 0
    assert "The best learned filter, pinn," in out
    assert "runs/small/report.html" in err
    folder = Path("runs/small")
    table = pd.read_csv(folder / "filters.csv")
    assert list(table["filter"]) == ["kf", "dmc", "pinn"]
    assert np.isfinite(table["position_rmse_m"]).all()
    for name in ("errors", "three-sigma", "disturbance"):
        assert (folder / "figures" / f"{name}.png").stat().st_size > 20_000
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Riccati floor" in page
    assert "http" not in page.split("<svg")[0].replace("http-equiv", "")
    assert "kind: formation" in page
    series = pd.read_csv(folder / "series.csv")
    assert set(series["filter"]) == {"kf", "dmc", "pinn"}


def test_json_is_plain_data(scenario, monkeypatch, capsys):
    code, out, _ = call(
        monkeypatch, capsys, "navigate", scenario, "--runs", 1, "--filters", "kf", "--json"
    )
    assert code == 0
    content = json.loads(out)
    assert content["filters"][0]["filter"] == "kf"
    assert content["floor_position_m"] > 0.0


BAD = {
    "no file": (["nowhere.yaml"], "no file nowhere.yaml"),
    "unknown filter": (["small.yaml", "--filters", "kf,dmcc"], 'Did you mean "dmc"'),
    "learner": (["small.yaml", "--learner", "x.safetensors"], "Leave --learner out"),
    "no noise": (["small.yaml", "--filters", "exact"], 'filter "exact" has no noise'),
    "runs": (["small.yaml", "--runs", "0"], "greater than or equal to 1"),
    "unknown key": (["typo.yaml"], 'unknown key "durations_s", did you mean "duration_s"'),
    "a characterisation": ([ROOT / "scenarios" / "bennu-demo.yaml"], "unmodeled characterize"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input(case, scenario, monkeypatch, capsys):
    text = SCENARIO.replace("duration_s", "durations_s")
    (scenario.parent / "typo.yaml").write_text(text)
    arguments, sentence = BAD[case]
    code, _, err = call(monkeypatch, capsys, "navigate", *arguments)
    assert code == 2
    assert sentence in err
    assert not Path("runs").exists()


@pytest.mark.slow
def test_the_paper_beside_ours(monkeypatch, capsys, tmp_path):
    """Table 5.1 of [Marchese2023] with two runs: every row answered, drawn and explained."""
    monkeypatch.chdir(ROOT)
    code, out, _ = call(
        *(monkeypatch, capsys, "reproduce", "marchese-table5.1", "--small", "--out", tmp_path)
    )
    assert code == 0
    assert "PINN-EKF 0.06 m" in " ".join(out.split())
    table = pd.read_csv(tmp_path / "comparison.csv")
    assert list(table["statement"]) == ["kf", "nonlinear", "gradient", "pinn"]
    assert (tmp_path / "figures" / "marchese-table5.1.png").stat().st_size > 20_000
