"""The commands of story B do what the documentation says; bad input: exit 2 and one sentence."""

from __future__ import annotations

import json
import shutil

import pytest
from tests.cli.commands import call

from unmodeled.pipeline.cases.load_case import load_case
from unmodeled.pipeline.diagnosis.schema import AdditionJson, DiagnosisJson

pytestmark = pytest.mark.xdist_group("cases_cli")


@pytest.fixture
def run(tmp_path, monkeypatch, capsys, simulated):
    """Run a command that must succeed, in a folder that holds a copy of the case."""
    shutil.copytree(simulated, tmp_path / "hidden")
    monkeypatch.chdir(tmp_path)

    def succeed(*arguments):
        code, out, err = call(monkeypatch, capsys, *arguments)
        assert code == 0, err
        return out

    return succeed


def test_the_loop_of_story_b(run, tmp_path):
    """Diagnose without the truth, write the final case, diagnose that: nothing is missing."""
    shown = run("diagnose", "hidden/case.yaml", "--auto", "--out", "runs/a")
    assert shown.startswith("Missing: solar radiation pressure")
    assert "report: runs/a/report.html" in shown
    names = {p.name for p in (tmp_path / "runs/a").iterdir()}
    assert names >= {
        "report.html",
        "figures",
        "diagnosis.json",
        "candidates.csv",
        "residuals.parquet",
        "provenance.json",
        "case.yaml",
        "case-final.yaml",
    }
    (tmp_path / "hidden" / "truth.yaml").unlink()
    first = json.loads((tmp_path / "runs/a/diagnosis.json").read_text())
    again = json.loads(run("diagnose", "hidden/case.yaml", "--json", "--out", "runs/b"))
    assert not (tmp_path / "runs/b/case-final.yaml").exists()
    assert first | {"seconds": 0} == again | {"seconds": 0}  # to the last digit
    DiagnosisJson.model_validate(again)
    (found,) = again["found"]
    assert found["effect"] == "srp"
    assert found["class"][0] == "srp"
    assert found["delta_chi_square"] > found["threshold"]
    assert again["residual_rms_after"] < again["residual_rms_before"]
    final = json.loads(run("diagnose", "runs/a/case-final.yaml", "--json", "--out", "runs/c"))
    assert final["verdict"] == "nothing missing"
    assert final["residual_rms_before"] == pytest.approx(again["residual_rms_after"], rel=1e-6)


def test_add_writes_the_next_case_and_prints_both_errors(run, tmp_path):
    shown = run("add", "hidden/case.yaml", "srp", "--report", "runs/add")
    assert "srp_CrA_m = " in shown
    assert "next case: hidden/case-with-srp.yaml" in shown
    assert (tmp_path / "runs/add/report.html").exists()
    assert (tmp_path / "runs/add/addition.json").exists()
    case = load_case(tmp_path / "hidden/case-with-srp.yaml")
    assert "srp_CrA_m" in case.estimate
    assert "srp" not in [c.name for c in case.candidates]


def test_add_as_json_into_another_folder(run, tmp_path):
    (tmp_path / "next").mkdir()
    content = json.loads(
        run("add", "hidden/case.yaml", "zonal_5", "--json", "--out", "next/case.yaml")
    )
    assert AdditionJson.model_validate(content).next_case == "next/case.yaml"
    case = load_case(tmp_path / "next/case.yaml")
    assert case.estimate == {"J5": None}
    assert case.name == "bennu-1-with-zonal_5"  # its run folder is another


def test_compare(run, tmp_path):
    shown = run("compare", "hidden/case.yaml", "--out", "runs/compared")
    assert shown.startswith("The residuals are 1.")
    content = json.loads((tmp_path / "runs/compared/comparison.json").read_text())
    assert content["whiteness"]["coloured"] is True
    assert (tmp_path / "runs/compared/report.html").exists()


def test_lists(run):
    shown = run("scenarios")
    for name in ("bennu", "eros", "leo", "meo", "geo", "lunar", "cislunar", "heliocentric"):
        assert f"\n{name} " in shown
    rows = json.loads(run("effects", "bennu", "--json"))
    srp = next(r for r in rows if r["name"] == "srp")
    assert srp["family"] == "radiation"
    assert srp["parameters"][0]["unit"] == "m2 kg-1"
    listed = run("effects", "hidden/case.yaml").splitlines()
    assert [line.split()[0] for line in listed] == ["name", "zonal_5", "srp", "constant_radial"]
    schema = json.loads(run("schema", "diagnose"))
    assert {"verdict", "found", "whiteness", "smallest_detectable"} <= set(schema["required"])


def test_hidden_effects_by_strength_and_by_value(run, tmp_path):
    run("simulate", "bennu", "--out", "x", "--hide", "srp_CrA_m=0.02 m2/kg", "--hide", "zonal_5")
    truth = (tmp_path / "x/truth.yaml").read_text()
    assert "srp_CrA_m: 0.02 m2 kg-1" in truth
    assert "J5" in truth
    shown = json.loads(run("simulate", "bennu", "--out", "y", "--json"))
    assert shown["case"] == "y/case.yaml"
