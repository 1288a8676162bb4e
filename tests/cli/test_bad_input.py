"""Bad input: exit code 2 and one clear sentence, never a traceback."""

import os
import subprocess
import sys

import numpy as np
import pytest

from unmodeled import cli

CONFIG = """\
name: test
seed: 3
body: bennu
data: {trajectory: simulated, train_periods: 2, extrapolation_periods: 1}
learners: [{kind: point_mass}]
flight: {periods: [1], orbits: 1}
"""

HEADER = "t_s,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s"


def circular_rows(n=40, radius=600.0, gm=4.89):
    rate = np.sqrt(gm / radius**3)
    t = np.linspace(0.0, 3 * 2 * np.pi / rate, n)
    c, s = np.cos(rate * t), np.sin(rate * t)
    zero = np.zeros(n)
    columns = (t, radius * c, radius * s, zero, -radius * rate * s, radius * rate * c, zero)
    return [list(row) for row in np.stack(columns, axis=1)]


def write_csv(path, rows, header=HEADER):
    lines = [header, *(",".join(repr(float(v)) for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run the command line in an empty folder; return the exit code and what went to stderr."""
    monkeypatch.chdir(tmp_path)

    def call(text, *arguments):
        (tmp_path / "c.yaml").write_text(text)
        monkeypatch.setattr(sys, "argv", ["unmodeled", "characterize", "c.yaml", *arguments])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        shown = capsys.readouterr()
        assert "Traceback" not in shown.err + shown.out
        assert not (tmp_path / "runs").exists()
        return stop.value.code, " ".join(shown.err.split())

    return call


CONFIG_CASES = {
    "unknown key": (
        CONFIG.replace("seed: 3", "sed: 3"),
        'unknown key "sed", did you mean "seed"?',
    ),
    "unknown key in a section": (
        CONFIG + "noise: {sate: 0.1}\n",
        'unknown key "noise.sate", did you mean "state"?',
    ),
    "unknown hyperparameter": (
        CONFIG.replace("kind: point_mass", "kind: exact_gp, epoch: 5"),
        'learner exact_gp: unknown key "epoch", did you mean "epochs"?',
    ),
    "unknown learner": (
        CONFIG.replace("kind: point_mass", "kind: exakt_gp"),
        'c.yaml: unknown learner "exakt_gp". Did you mean "exact_gp"?',
    ),
    "unknown input": (
        CONFIG.replace("kind: point_mass", "kind: elm, inputs: [position, velocty]"),
        'c.yaml: learner "elm": unknown input "velocty". Did you mean "velocity"?',
    ),
    "inputs of a field": (
        CONFIG.replace("kind: point_mass", "kind: point_mass, inputs: [position, velocity]"),
        'learner "point_mass" with inputs position, velocity. Allowed: position:',
    ),
    "the Sun without an epoch": (
        CONFIG.replace("kind: point_mass", "kind: elm, inputs: [position, sun_cosine]"),
        "input sun_cosine and data.epoch is not given. Write e.g. epoch:",
    ),
    "unknown body": (CONFIG.replace("bennu", "benu"), 'did you mean "bennu"?'),
    "e >= 1": (
        CONFIG.replace(
            "extrapolation_periods: 1",
            "extrapolation_periods: 1, orbit: {semi_major_axis: 2, eccentricity: 1.2,"
            " inclination: 0}",
        ),
        "data.orbit.eccentricity is 1.2: input should be less than 1",
    ),
    "colliding orbit": (
        CONFIG.replace(
            "extrapolation_periods: 1",
            "extrapolation_periods: 1, orbit: {semi_major_axis: 1.3, eccentricity: 0.6,"
            " inclination: 30}",
        ),
        "hits the body: it enters the Brillouin sphere of 290 m after",
    ),
    "sigma < 0": (
        CONFIG + "noise: {acceleration: -0.1}\n",
        "noise.acceleration is -0.1: input should be greater than or equal to 0",
    ),
    "sigma NaN": (CONFIG + "noise: {state: .nan}\n", "noise.state is nan"),
    "no learners": (CONFIG.replace("[{kind: point_mass}]", "[]"), "learners is []"),
    "not YAML": ("name: [", "c.yaml, line"),
    "empty file": ("", "c.yaml is empty"),
    "key given twice": (CONFIG + "seed: 4\n", "found duplicate key"),
    "missing trajectory": (
        CONFIG.replace("trajectory: simulated", "trajectory: nowhere.csv"),
        "no trajectory file nowhere.csv",
    ),
    "unknown suffix": (
        CONFIG.replace("trajectory: simulated", "trajectory: c.yaml"),
        "c.yaml",
    ),
}


@pytest.mark.parametrize("case", CONFIG_CASES)
def test_bad_configuration(run, case):
    text, expected = CONFIG_CASES[case]
    code, error = run(text)
    assert code == 2
    assert error.startswith("error: ")
    assert expected.lower() in error.lower()


def nan_rows():
    rows = circular_rows()
    rows[7][2] = float("nan")
    return rows


def unsorted_rows():
    rows = circular_rows()
    rows[5], rows[6] = rows[6], rows[5]
    return rows


def duplicate_rows():
    rows = circular_rows()
    rows[6][0] = rows[5][0]
    return rows


CSV_CASES = {
    "NaN": (nan_rows(), HEADER, "line 9: y_m is missing or not finite"),
    "unsorted": (unsorted_rows(), HEADER, "goes back"),
    "duplicate time": (duplicate_rows(), HEADER, "repeats"),
    "three points": (circular_rows()[:3], HEADER, "3 samples"),
    "missing column": ([r[:6] for r in circular_rows()], HEADER.rsplit(",", 1)[0], "vz"),
    "unit missing": (circular_rows(), HEADER.replace("x_m,", "x,", 1), "x"),
    "inside the body": (circular_rows(radius=100.0), HEADER, "below its Brillouin sphere"),
    "not bound": (
        [[*r[:4], *(9 * v for v in r[4:])] for r in circular_rows()],
        HEADER,
        "own.csv is not bound",
    ),
}


# The smoother warns of rows that make no orbit before the orbit itself is refused.
@pytest.mark.filterwarnings("ignore::unmodeled.core.errors.UnmodeledWarning")
@pytest.mark.parametrize("case", CSV_CASES)
def test_bad_trajectory_file(run, tmp_path, case):
    rows, header, expected = CSV_CASES[case]
    write_csv(tmp_path / "own.csv", rows, header)
    text = CONFIG.replace("trajectory: simulated", "trajectory: own.csv")
    code, error = run(text)
    assert code == 2
    assert "own.csv" in error
    assert expected.lower() in error.lower()


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--set", "noise.state"), '--set "noise.state". Allowed: KEY=VALUE'),
        (("--set", "noise.stat=1"), 'unknown key "noise.stat", did you mean "state"?'),
        (("--set", "name.x=1"), "name is not a section"),
        (("--seed", "-1"), "seed is -1: input should be greater than or equal to 0"),
        (("--data", "nowhere"), "--data nowhere is not a folder"),
        (("--out", "c.yaml"), "c.yaml is a file"),
        (("--out", "."), "holds files that are not a run of unmodeled"),
    ],
)
def test_bad_options(run, arguments, expected):
    code, error = run(CONFIG, *arguments)
    assert code == 2
    assert expected in error


def test_a_real_process_exits_with_2(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "unmodeled.cli", "characterize", "missing.yaml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"COLUMNS": "200"},
    )
    assert done.returncode == 2
    assert done.stderr == ("error: no file missing.yaml. Give the path of a configuration file.\n")


def test_interrupt_leaves_nothing_behind(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.yaml").write_text(CONFIG)
    monkeypatch.setattr(sys, "argv", ["unmodeled", "characterize", "c.yaml"])

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("unmodeled.pipeline.characterize.prepare", interrupted)
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 130
    assert "stopped; no result was written" in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["c.yaml"]
