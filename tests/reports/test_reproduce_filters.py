"""Tables of the papers that fly filters: every statement answered; small variants run through."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodeled as um
from unmodeled.core.errors import InputError
from unmodeled.reports.figures.learning_curve import learning_curve_figure
from unmodeled.reports.figures.off_nominal import off_nominal_figure
from unmodeled.reports.reproduction.off_nominal_table import FLOWN, answer_table4
from unmodeled.reports.reproduction.published import published_figure, published_names

ROOT = Path(__file__).parents[2]
NAMES = tuple(n for n in published_names() if not n.startswith("neamati"))


def test_numbers_of_the_papers_are_those_of_their_tables():
    """Typed again here, so that a slip in the data files shows."""
    table4 = published_figure("pesce-table4").statements
    printed = [(s.values["position"], s.values["velocity"]) for s in table4.values() if s.values]
    assert printed == [(0.0149, 5.98e-5), (0.0064, 4.79e-5), (0.0090, 9.34e-5), (0.0110, 9.55e-5)]
    table36 = published_figure("marchese-table3.6").statements
    printed = [(s.values["mean"], s.values["max"]) for s in table36.values() if s.values]
    assert printed == [
        (1.20e-3, 4.01e-3),
        (4.89e-4, 1.25e-3),
        (2.27e-4, 9.16e-4),
        (8.53e-4, 2.27e-3),
    ]
    table37 = published_figure("marchese-table3.7").statements
    assert dict(table37["lyapunov"].values) == {"mean": 1.03e-3, "max": 2.18e-3}
    assert dict(table37["gradient"].values) == {"mean": 8.19e-4, "max": 1.81e-3}
    assert published_figure("fereoli-fig10").statements["plateau"].values["percent"] == 3.4


@pytest.mark.parametrize("name", NAMES)
def test_scenario_and_source_are_there(name):
    figure = published_figure(name)
    assert figure.source in ("Pesce2020", "Marchese2023", "Fereoli2024")
    assert all(s.where.startswith(("Table", "Fig.", "section")) for s in figure.statements.values())
    if figure.scenario:
        assert (ROOT / "scenarios" / f"{figure.scenario}.yaml").is_file()
    assert f"`{name}`" in (ROOT / "docs" / "reproduce.md").read_text(encoding="utf-8")
    with pytest.raises(InputError, match="needs no sweep"):
        um.reproduce(name, store=ROOT)


def made_up(position, velocity):
    factor = np.array([0.1, 1.0, 10.0])
    parts = [
        pd.DataFrame(
            {
                "filter": name,
                "run": range(3),
                "factor": factor,
                "position_rmse_m": position,
                "velocity_rmse_m_s": velocity,
            }
        )
        for name in FLOWN.values()
    ]
    return pd.concat(parts, ignore_index=True)


def test_table4_is_the_root_mean_square_over_runs():
    found = answer_table4(
        made_up([3e-3, 4e-3, 5e-3], 2e-5), published_figure("pesce-table4").statements
    )
    assert list(found) == list(published_figure("pesce-table4").statements)
    # sqrt((9 + 16 + 25) / 3) = 4.08
    assert found["adaptive"].ours == "4.08 mm, 2.00e-05 m/s; worst run 5.00 mm"
    assert found["adaptive"].agrees is True
    assert found["linear"].agrees is False


def test_table4_says_who_diverged():
    table = made_up([3e-3, np.nan, 5e-3], [2e-5, np.nan, 2e-5])
    found = answer_table4(table, published_figure("pesce-table4").statements)
    assert found["observer"].ours.endswith("; 1 of 3 runs diverged")
    assert found["observer"].agrees is False


def test_figures_have_plain_ticks():
    figure = off_nominal_figure(made_up([3e-3, 4e-3, 5e-3], 2e-5))
    figure.canvas.draw()
    shown = [t.get_text() for t in figure.axes[1].get_xticklabels()]
    assert shown == ["0.1", "0.3", "1", "3", "10"]
    curve = learning_curve_figure({"one": np.array([[1.0, 200.0], [3000.0, 4.0]])}, 3.4)
    (low, high), (bottom, top) = curve.axes[0].get_xlim(), curve.axes[0].get_ylim()
    assert low <= 1.0 < 3000.0 <= high
    assert bottom <= 3.4 < 200.0 <= top


def test_table33_from_end_to_end(tmp_path):
    found = um.reproduce("marchese-table3.3", small=True, out=tmp_path)
    assert list(found.table["statement"]) == list(published_figure("marchese-table3.3").statements)
    assert set(found.table["agrees"]) == {"not compared"}
    assert found.picture.stat().st_size > 20_000


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(NAMES) - {"marchese-table3.3", "marchese-table5.1"}))
def test_small_variants(name, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    found = um.reproduce(name, small=True, out=tmp_path)
    assert list(found.table["statement"]) == list(published_figure(name).statements)
    assert (found.table["ours"].str.len() > 5).all()
    assert found.picture.stat().st_size > 20_000
    assert "nan" not in " ".join(found.table["ours"])
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"Reproduction, {found.figure.source} {found.figure.key}" in page
