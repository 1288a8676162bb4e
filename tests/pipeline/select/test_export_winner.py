"""The exported winner is the model of the sweep."""

import numpy as np
import pytest

import unmodeled as um
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.select.export_winner import export_winner
from unmodeled.pipeline.sweep.sweep import open_sweep

CONTENT = {
    "base": {"data": {"train_periods": 3, "extrapolation_periods": 2}},
    "axes": {
        "learner": [{"kind": "rbf_network", "centres": 10}, {"kind": "zonal_oracle"}],
        "noise.acceleration": [0, 0.01],
    },
    "initial_conditions": {"count": 6},
}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep") / "store"
    um.sweep(CONTENT, folder)
    return folder


def test_the_oracle_wins_and_is_exported(store, tmp_path):
    """Truth: a fit of the true family of fields must win over a network, in every regime."""
    opened = open_sweep(store)
    selection = um.select(opened.table())
    assert [c.regime for c in selection.choices] == ["low noise", "high noise"]
    assert {c.winner for c in selection.choices} == {"zonal oracle"}
    paths = export_winner(opened, "zonal oracle", "high noise", tmp_path / "winner", 3)
    field = um.LearnedField.load(paths[0])
    result = um.characterize(um.load_config(paths[1]))
    points = np.array([[0.0, 500.0, 100.0], [400.0, 300.0, -200.0]])
    again = result.field(result.learners[0].label)
    assert np.array_equal(field.acceleration(points), again.acceleration(points))
    table = opened.table()
    row = table[
        (table["learner"] == "zonal oracle")
        & (table["noise.acceleration"] > 0)
        & (table["initial_condition"] == 3)
    ].iloc[0]
    median = result.learners[0].summaries["extrapolation"].median
    assert median == row["extrapolation_median"]


def test_nothing_that_fits(store, tmp_path):
    with pytest.raises(ConfigError, match="at initial condition 9"):
        export_winner(open_sweep(store), "zonal oracle", "low noise", tmp_path, 9)
    with pytest.raises(ConfigError, match="no finished run of exact gp"):
        export_winner(open_sweep(store), "exact gp", "low noise", tmp_path)
    assert not list(tmp_path.iterdir())


def test_command(store, tmp_path, monkeypatch, capsys):
    import json
    import sys

    from unmodeled import cli

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["unmodeled", "select", str(store), *arguments])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        return stop.value.code or 0, capsys.readouterr()

    code, shown = run("--export", str(tmp_path / "winner"), "--regime", "high noise")
    assert code == 0
    assert "24 of 24 runs, by robustness" in shown.out
    assert "Low noise: zonal oracle, median error" in shown.out
    assert "on the front of error, training time, evaluation time and size:" in shown.out
    assert (tmp_path / "winner" / "winner.safetensors").exists()
    code, shown = run("--json", "--by", "safety")
    assert json.loads(shown.out)["metric"] == "interpolation_median"
    for arguments, text in (
        (("--by", "speed"), "Allowed: robustness, safety"),
        (("--export", str(tmp_path), "--regime", "low nois"), 'Did you mean "low noise"'),
    ):
        code, shown = run(*arguments)
        assert code == 2
        assert text in " ".join(shown.err.split())
