"""Bad cases, tables and options of story B: exit code 2, one sentence, nothing written."""

from __future__ import annotations

import errno

import pytest
from tests.cli.commands import call

pytestmark = pytest.mark.xdist_group("cases_cli")


def changed(tmp_path, old, new, name="case.yaml"):
    """Change the copy of the case; the text must be there."""
    path = tmp_path / "hidden" / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return "hidden/case.yaml"


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
    "no time scale": ((" TDB", ""), "has no time scale. Allowed: a date with UTC, TAI, TT, TDB"),
    "no such date": (("2019-02-16", "2019-13-16"), "is not a date. Write it like"),
    "sigma zero": (
        ("sigma: file", "sigma: 0 m"),
        "sigma of positions.csv is 0 m. Allowed: a number > 0.",
    ),
    "sigma NaN": (
        ("sigma: file", "sigma: nan m"),
        "sigma of positions.csv is 'nan m'. Allowed: a length, e.g. 0.5 m.",
    ),
    "sigma in seconds": (
        ("sigma: file", "sigma: 1 s"),
        "sigma of positions.csv is 1 s. Allowed: a length, e.g. 0.5 m.",
    ),
    "unknown key": (("seed:", "sead:"), 'unknown key "sead", did you mean "seed"?'),
    "unknown key of measurements": (
        ("label:", "lable:"),
        'unknown key "measurements.0.lable", did you mean "label"?',
    ),
    "unknown key of an effect": (
        ("effect: zonal", "effect: zonal\n  degrece: 3"),
        'known.1 (zonal): unknown key "degrece". Did you mean "degrees"?',
    ),
    "unknown key of an arc": (
        ("start: 0.0 s", "begin: 0.0 s"),
        'missing key "arcs.0.start"; unknown key "arcs.0.begin"',
    ),
    "mass in metres": (
        ("1500 kg", "1500 m"),
        "spacecraft.mass is 1500 m. Allowed: a mass, e.g. 1500 kg.",
    ),
    "unknown body": (("body: bennu", "body: benu"), 'Did you mean "bennu"?'),
    "J2 twice": (
        ("- effect: third_body", "- effect: zonal\n  degrees: [2]\n- effect: third_body"),
        'the force model contains "gravity C(2,0)" twice',
    ),
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


def cells_of(row, k, value):
    cells = row.split(",")
    cells[k] = value
    return ",".join(cells)


TABLES = {
    "unsorted": (lambda r: [r[0], r[2], r[1], *r[3:]], "time goes back at sample 2"),
    "duplicate time": (lambda r: [r[0], *r], "time repeats at sample 1: 600.000000 s is followed"),
    "cut in a row": (lambda r: [*r[:5], r[5][:30]], "has 3 of 8 values. The file may be cut short"),
    "no rows": (lambda r: [], "positions.csv has no position"),
    "sigma NaN": (lambda r: [cells_of(r[0], 4, "nan"), *r[1:]], 'sigma_x_m is "nan"'),
    "sigma zero": (lambda r: [cells_of(r[0], 4, "0"), *r[1:]], "Allowed: standard deviations > 0"),
}


@pytest.mark.parametrize("name", TABLES)
def test_bad_tables(refused, tmp_path, name):
    change, words = TABLES[name]
    path = tmp_path / "hidden/positions.csv"
    lines = path.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line[0].isdigit())
    path.write_text("\n".join([*lines[:first], *change(lines[first:])]) + "\n")
    assert words in refused("diagnose", "hidden/case.yaml")


def test_a_run_does_not_replace_its_own_case(refused, tmp_path):
    """What `--auto` wrote lies in a run folder: a run there would remove what it reads."""
    (tmp_path / "hidden/provenance.json").write_text("{}")
    assert "hidden/case.yaml lies in hidden, whose content this run would replace" in refused(
        "diagnose", "hidden/case.yaml", "--out", "hidden"
    )


def full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_simulate_on_a_full_disk_leaves_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("unmodeled.pipeline.cases.simulated_files.write_measurements", full)
    code, out, err = call(monkeypatch, capsys, "simulate", "bennu", "--out", "x")
    assert (code, out) == (2, "")
    assert "no space left while writing x. Free space or choose another --out." in err
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_in_simulate_leaves_nothing(tmp_path, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("unmodeled.pipeline.cases.simulated_files.write_case", interrupted)
    code, _, err = call(monkeypatch, capsys, "simulate", "bennu", "--out", "x")
    assert code == 130
    assert "stopped; no result was written" in err
    assert list(tmp_path.iterdir()) == []


def test_simulate_replaces_no_file(refused, tmp_path):
    (tmp_path / "hidden/case.yaml").unlink()
    error = refused("simulate", "bennu", "--out", "hidden")
    assert "hidden holds positions.csv, truth.yaml already. Name another folder." in error


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
    "unlike any effect": (
        ("simulate", "bennu", "--out", "x", "--hide", "qqq"),
        '"qqq" here. Ask `unmodeled effects SCENARIO` for all.',
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
