"""The paper's statements beside ours: every one answered, by numbers that are known."""

import json
import sys
from pathlib import Path

import pandas as pd
import pytest

sys.path.append(str(Path(__file__).parent))

from made_up_sweep import GP, made_up_store

import unmodeled as um
from unmodeled import cli
from unmodeled.core.errors import InputError
from unmodeled.reports.reproduction.published import published_figure, published_names

NAMES = ("fig1", "fig4", "fig10", "fig11", "fig12", "fig13")
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def stores(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stores")
    levels = [0, 0.2, 0.4, 1]
    made_up_store(folder / "neamati-fig11", "neamati-fig11", count=8)
    made_up_store(folder / "neamati-fig12", "neamati-fig12", **{"noise.state": levels})
    made_up_store(folder / "neamati-fig13", "neamati-fig13", **{"noise.acceleration": levels})
    return folder


def run(name, stores, out):
    figure = published_figure(f"neamati-{name}")
    store = stores / figure.sweep if figure.sweep else None
    return um.reproduce(f"neamati-{name}", small=name == "fig4", store=store, out=out)


def test_numbers_of_the_paper_are_those_of_its_text():
    """Typed again here from section IV.B, so that a slip in the data file shows."""
    fig11 = published_figure("neamati-fig11").statements
    assert dict(fig11["gp_interpolation"].values) == {
        "slope": 0.9995,
        "intercept": 0.0056,
        "r_squared": 0.9992,
    }
    assert dict(fig11["network_interpolation"].values) == {
        "slope": 0.9865,
        "intercept": -0.0169,
        "r_squared": 0.9954,
    }
    assert fig11["gp_extrapolation"].values["r_squared"] == 0.3351
    assert fig11["network_extrapolation"].values["r_squared"] == 0.0076


def test_every_statement_says_where_it_is_printed():
    neamati = tuple(n for n in published_names() if n.startswith("neamati"))
    assert neamati == tuple(f"neamati-{n}" for n in NAMES)
    for name in neamati:
        figure = published_figure(name)
        assert figure.source == "Neamati2022"
        assert all(s.where.startswith(("Fig.", "section")) for s in figure.statements.values())
        if figure.sweep:
            for suffix in ("", "-small"):
                assert (ROOT / "sweeps" / f"{figure.sweep}{suffix}.yaml").is_file()


@pytest.mark.parametrize("name", NAMES)
def test_every_statement_is_answered(name, stores, tmp_path):
    found = run(name, stores, tmp_path)
    assert list(found.table["statement"]) == list(published_figure(f"neamati-{name}").statements)
    assert set(found.table["agrees"]) <= {"yes", "no", "not compared"}
    assert found.picture.stat().st_size > 20_000
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"Reproduction, Neamati2022 {found.figure.key}" in page
    assert pd.read_csv(tmp_path / "comparison.csv").shape == found.table.shape


def answers(name, stores, tmp_path):
    return run(name, stores, tmp_path).table.set_index("statement")


def test_fig11_finds_the_slope_that_was_put_in(stores, tmp_path):
    row = answers("fig11", stores, tmp_path).loc["gp_interpolation"]
    assert "slope 1.0000" in row["ours"]
    assert "R² = 1.0000 (8 runs)" in row["ours"]
    assert row["agrees"] == "yes"


def test_fig10_sees_that_the_models_differ(stores, tmp_path):
    found = answers("fig10", stores, tmp_path)
    assert found.loc["comparable", "agrees"] == "no"
    assert found.loc["outliers", "ours"].startswith("0 of 8 runs of exact gp")
    assert found.loc["slower", "agrees"] == "no"


def test_fig12_and_fig13(stores, tmp_path):
    twelve = answers("fig12", stores, tmp_path)
    assert twelve.loc["rise", "agrees"] == "no"  # made linear, not exponential
    assert "exact gp 1.000 and" in twelve.loc["rise", "remark"]
    assert twelve.loc["poor", "agrees"] == "yes"
    thirteen = answers("fig13", stores, tmp_path)
    assert thirteen.loc["rise", "agrees"] == "yes"
    assert thirteen.loc["flat", "agrees"] == "no"  # both are flat
    # 3 x 0.2 is less than 1: made so that the paper's statement is false.
    assert thirteen.loc["less_safe", "agrees"] == "no"


def test_fig13_alone_says_what_it_lacks(stores, tmp_path):
    alone = tmp_path / "neamati-fig13"
    made_up_store(alone, count=3, **{"noise.acceleration": [0, 0.2, 1]})
    found = um.reproduce("neamati-fig13", store=alone, out=tmp_path / "o").table
    found = found.set_index("statement")
    assert found.loc["less_safe", "agrees"] == "not compared"
    assert "neamati-fig12" in found.loc["less_safe", "remark"]
    assert "Too few noise levels" in found.loc["rise", "remark"]


def test_what_cannot_be_reproduced(stores, tmp_path, monkeypatch):
    with pytest.raises(
        InputError, match=r"Allowed: .*neamati-fig1, .* Did you mean \"neamati-fig12\""
    ):
        um.reproduce("neamati-fig122")
    with pytest.raises(InputError, match="needs no runs"):
        um.reproduce("neamati-fig1", store=stores, out=tmp_path)
    with pytest.raises(InputError, match="not the folder of a sweep"):
        um.reproduce("neamati-fig12", store=tmp_path, out=tmp_path)
    with pytest.raises(InputError, match="fewer than two levels of noise"):
        um.reproduce("neamati-fig12", store=stores / "neamati-fig11", out=tmp_path)
    made_up_store(tmp_path / "gp", learners=(GP,), count=2)
    with pytest.raises(InputError, match="no finished run of a learner of kind spectral_mlp"):
        um.reproduce("neamati-fig11", store=tmp_path / "gp", out=tmp_path)


def test_commands(stores, tmp_path, monkeypatch, capsys):
    def call(*arguments, code=0):
        monkeypatch.setattr(sys, "argv", ["unmodeled", *arguments])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        shown = capsys.readouterr()
        assert (stop.value.code or 0) == code, shown.err
        return shown.out if code == 0 else " ".join(shown.err.split())

    shown = " ".join(call("reproduce", "list").split())
    assert "neamati-fig11 Neamati2022 Fig. 11: Training error" in shown
    store = str(stores / "neamati-fig11")
    shown = call("reproduce", "neamati-fig11", "--store", store, "--out", str(tmp_path))
    assert "paper   The linear fit coefficient is 0.9995" in shown
    assert "ours    exact gp: slope 1.0000" in shown
    found = json.loads(
        call("reproduce", "neamati-fig11", "--store", store, "--out", str(tmp_path), "--json")
    )
    assert len(found["statements"]) == 4
    assert call("report", store).strip().endswith("report.html")
    assert "Allowed: robustness, safety" in call("report", store, "--by", "speed", code=2)
    assert "no figure" in call("reproduce", "neamati-fig2", code=2)
