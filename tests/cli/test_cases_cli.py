"""The commands of story B do what the documentation says; bad input: exit 2 and one sentence."""

from __future__ import annotations

import json
import shutil
import sys

import pytest

from unmodeled import cli
from unmodeled.pipeline.cases.load_case import load_case
from unmodeled.pipeline.diagnosis.schema import AdditionJson, DiagnosisJson

pytestmark = pytest.mark.xdist_group("cases_cli")
#: Few candidates: the commands are tested here, not the search.
FEW = "candidates: [zonal_5, srp, constant_radial]\n"


def call(monkeypatch, capsys, *arguments):
    """Run the command line; return exit code, stdout, stderr in one line."""
    monkeypatch.setattr(sys, "argv", ["unmodeled", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err + shown.out
    return stop.value.code or 0, shown.out, " ".join(shown.err.split())


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Return the folder of a case with a hidden effect, made by the command."""
    folder = tmp_path_factory.mktemp("cases") / "hidden"
    words = ["simulate", "bennu", "--hide", "srp=1000", "--seed", "1", "--held-out", "--out"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["unmodeled", *words, str(folder)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
    assert stop.value.code in (0, None)
    path = folder / "case.yaml"
    path.write_text(FEW + path.read_text())
    return folder


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


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys, simulated):
    """Run a command that must be refused; return the sentence."""
    shutil.copytree(simulated, tmp_path / "hidden")
    monkeypatch.chdir(tmp_path)

    def fail(*arguments):
        made = sorted(p.name for p in tmp_path.rglob("*"))
        code, out, err = call(monkeypatch, capsys, *arguments)
        assert code == 2
        assert out == ""
        assert err.startswith("error: ")
        assert sorted(p.name for p in tmp_path.rglob("*")) == made  # nothing was written
        return err

    return fail


def changed(tmp_path, old, new, name="case.yaml"):
    """Change the copy of the case; the text must be there."""
    path = tmp_path / "hidden" / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return "hidden/case.yaml"


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
    assert load_case(tmp_path / "next/case.yaml").estimate == {"J5": None}


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


def without_line(tmp_path, start):
    path = tmp_path / "hidden/case.yaml"
    lines = path.read_text().splitlines(keepends=True)
    kept = [line for line in lines if not line.strip().startswith(start)]
    assert len(kept) == len(lines) - 1
    path.write_text("".join(kept))


CASES = {
    "wrong frame of the case": (
        ("frame: body_equator", "frame: J2000"),
        "frame is 'J2000': input should be 'icrf' or 'body_equator'",
    ),
    "wrong frame of the data": (
        ("sigma: file", "sigma: file\n  frame: ITRF"),
        "frame of positions.csv (position) is ITRF, and the body is bennu",
    ),
    "wrong time scale": ((" TDB", " GMT"), 'time scale "GMT" is unknown. Allowed: UTC, TAI, TT'),
    "sigma without unit": (
        ("sigma: file", "sigma: 0.5"),
        "sigma of positions.csv is 0.5 without a unit",
    ),
    "station not described": (
        ("sigma: file", "sigma: file\n  station: goldstone"),
        'the station "goldstone" of positions.csv is not described',
    ),
    "known effect twice": (
        ("- effect: point_mass", "- effect: point_mass\n- effect: point_mass"),
        'the force model contains "gravity C(0,0)" twice',
    ),
    "unknown effect": (
        ("effect: point_mass", "effect: pointmass"),
        'unknown effect "pointmass". Allowed: ',
    ),
    "unknown candidate": (
        ("[zonal_5, srp,", "[zonal_5, spr,"),
        'there is no candidate "spr" here',
    ),
    "no such file": (
        ("file: positions.csv", "file: none.csv"),
        "there is no measurement file none.csv",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_cases(refused, tmp_path, name):
    (old, new), words = CASES[name]
    assert words in refused("diagnose", changed(tmp_path, old, new))


def test_sigma_unstated(refused, tmp_path):
    without_line(tmp_path, "sigma: file")
    assert "sigma of positions.csv is not stated. Write the standard deviation" in refused(
        "diagnose", "hidden/case.yaml"
    )


def test_station_missing(refused, tmp_path):
    rows = "\n".join(f"{600 * k},{7e6 + k}" for k in range(1, 20))
    (tmp_path / "hidden/ranges.csv").write_text(f"t_s,range_m\n{rows}\n")
    path = changed(tmp_path, "file: positions.csv", "file: ranges.csv")
    changed(tmp_path, "kind: position", "kind: range")
    changed(tmp_path, "sigma: file", "sigma: 1 m")
    error = refused("diagnose", path)
    assert "ranges.csv" in error
    assert "station" in error


def test_nan_in_the_data(refused, tmp_path):
    path = tmp_path / "hidden/positions.csv"
    lines = path.read_text().splitlines()
    row = next(k for k, line in enumerate(lines) if line.startswith("1200"))
    cells = lines[row].split(",")
    lines[row] = ",".join([cells[0], "nan", *cells[2:]])
    path.write_text("\n".join(lines))
    assert f'positions.csv, line {row + 1}: x_m is "nan"' in refused("diagnose", "hidden/case.yaml")


@pytest.mark.parametrize(
    ("name", "words"),
    [("positions.csv", "positions.csv is empty"), ("case.yaml", "case.yaml is empty")],
)
def test_empty_files(refused, tmp_path, name, words):
    (tmp_path / "hidden" / name).write_text("")
    assert words in refused("diagnose", "hidden/case.yaml")


OPTIONS = {
    "unknown scenario": (
        ("simulate", "benu", "--out", "x"),
        'there is no scenario "benu". Allowed: bennu, ',
    ),
    "unknown hidden effect": (
        ("simulate", "bennu", "--out", "x", "--hide", "spr"),
        'there is no effect or parameter "spr" here. Did you mean "srp"?',
    ),
    "strength below zero": (
        ("simulate", "bennu", "--out", "x", "--hide", "srp=-3"),
        '--hide "srp=-3". Allowed: a strength > 0',
    ),
    "wrong unit": (
        ("simulate", "bennu", "--out", "x", "--hide", "srp_CrA_m=3 kg"),
        "srp_CrA_m is 3 kg. Allowed: an area for each mass",
    ),
    "hidden twice": (
        ("simulate", "bennu", "--out", "x", "--hide", "srp", "--hide", "srp=5"),
        "--hide names srp twice",
    ),
    "hide in a configuration": (
        ("simulate", "c.yaml", "--out", "x", "--hide", "srp"),
        "--hide, --held-out and --noise-factor are for a scenario",
    ),
    "a case is there": (("simulate", "bennu", "--out", "hidden"), "hidden holds a case already"),
    "add what is in the model": (
        ("add", "hidden/case.yaml", "third_body_sun"),
        "the model of bennu-1 has third_body_sun already",
    ),
    "add the unknown": (
        ("add", "hidden/case.yaml", "zonal5"),
        'there is no effect "zonal5" for bennu-1. Did you mean "zonal_5"?',
    ),
    "add onto the case itself": (
        ("add", "hidden/case.yaml", "srp", "--out", "hidden/case.yaml"),
        "hidden/case.yaml exists. Name another --out",
    ),
    "false alarm": (
        ("diagnose", "hidden/case.yaml", "--false-alarm", "2"),
        "false_alarm is 2.0. Allowed: a probability between 0 and 0.5",
    ),
    "data folder": (
        ("diagnose", "hidden/case.yaml", "--data", "nowhere"),
        "--data nowhere is not a folder",
    ),
    "run folder": (
        ("diagnose", "hidden/case.yaml", "--out", "hidden"),
        "hidden holds files that are not a run of unmodeled",
    ),
    "truth is no case": (("diagnose", "hidden/truth.yaml"), 'unknown key "hidden"'),
    "schema": (("schema", "diagnos"), 'no schema for "diagnos"'),
    "effects": (("effects", "leoo"), 'there is no scenario "leoo"'),
}


@pytest.mark.parametrize("name", OPTIONS)
def test_bad_options(refused, name):
    arguments, words = OPTIONS[name]
    assert words in refused(*arguments)
