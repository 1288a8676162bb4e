"""Figures and page of a sweep, on made-up numbers and on one real tiny sweep."""

import io
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

sys.path.append(str(Path(__file__).parent))

from made_up_sweep import GP, NETWORK, made_up_store

import unmodeled as um
from unmodeled.core.errors import InputError
from unmodeled.pipeline.sweep.sweep import open_sweep
from unmodeled.reports.figures.error_against_noise import error_against_noise
from unmodeled.reports.figures.head_to_head import head_to_head
from unmodeled.reports.figures.train_against_test import fits_of
from unmodeled.reports.style import learner_styles, render
from unmodeled.reports.sweep_page import overview_sentence, write_sweep_report
from unmodeled.reports.sweep_sections import sweep_sections
from unmodeled.reports.sweep_tables import outlier_table
from unmodeled.reports.sweep_view import view_of

_SMALLEST_FONT = 8.0
NASTY = "rbf <b>&\"'</b> on $p_{m}$"


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    axes = {"noise.state": [0, 0.5, 1], "data.train_periods": [5, 10]}
    rbf = {"kind": "rbf_network", "label": NASTY}
    return made_up_store(
        tmp_path_factory.mktemp("noisy") / "s", learners=(GP, NETWORK, rbf), fail=2, **axes
    )


@pytest.fixture(scope="module")
def view(noisy):
    return view_of(open_sweep(noisy))


@pytest.fixture(scope="module")
def figures(view):
    selection = um.select(view.table)
    found = sweep_sections(view, selection, "extrapolation_median")
    return {f.name: f for s in found for f in s.figures}


def test_the_table_of_outliers_counts_what_the_data_explain(view):
    assert not outlier_table(view.table, view.axes).rows
    runs = view.table.copy()
    runs["train_largest_observed"] = 1.0
    one, other = runs.index[-1], runs.index[-9]
    runs.loc[[one, other], "interpolation_median"] = [500.0, 9e5]
    runs.loc[other, "train_largest_observed"] = 4e3
    found = outlier_table(runs, view.axes)
    assert [row[-1] for row in found.rows] == ["a sample beside the centre", "not known"]
    assert f"2 of {len(runs)} runs" in found.note
    assert "In 1 of them" in found.note
    assert "without such a sample: 1." in found.note


def test_every_kind_of_figure_is_there(figures):
    assert list(figures) == [
        "critical-difference",
        "head-to-head-1",
        "head-to-head-2",
        "train-against-test",
        "noise-state-1",
        "noise-state-2",
        "data-train_periods-1",
        "data-train_periods-2",
        "data-train_periods-3",
        "calibration",
        "pareto-front",
    ]


def test_figures_are_legible_whole_and_named(figures):
    for drawn in figures.values():
        picture = render(drawn.figure, "png")
        texts = [
            t for t in drawn.figure.findobj(lambda a: hasattr(a, "get_fontsize")) if t.get_text()
        ]
        assert min(t.get_fontsize() for t in texts) >= _SMALLEST_FONT, drawn.name
        pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("L"))
        for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]):
            assert edge.min() == 255, drawn.name
        words = " ".join(t.get_text() for t in texts)
        assert any(u in words for u in ("dimensionless", "%", "mean rank")), drawn.name
        assert drawn.alt
        assert drawn.caption.endswith((".", "units.", "periods")), drawn.caption


def test_the_same_bytes_twice(view):
    for draw in (
        lambda: error_against_noise(view, "noise.state"),
        lambda: head_to_head(view, *view.labels[:2]),
    ):
        assert render(draw(), "svg") == render(draw(), "svg")


def test_a_learner_has_the_colour_that_it_has_elsewhere(view):
    assert view.styles == learner_styles(view.learners)
    figure = error_against_noise(view, "noise.state")
    colours = {line.get_color() for line in figure.axes[0].lines}
    assert {s.colour for s in view.styles.values()} <= colours


def test_medians_and_bands_are_those_of_the_table(view):
    one = view.only(view.table[view.table["data.train_periods"] == 10])
    axes = error_against_noise(one, "noise.state").axes[0]
    label = one.labels[1]
    mine = one.table[one.table["learner"] == label]
    wanted = mine.groupby("noise.state")["train_median"].median()
    line = next(x for x in axes.lines if x.get_color() == one.styles[label].colour)
    np.testing.assert_allclose(line.get_ydata(), wanted, rtol=1e-12)
    assert list(line.get_xdata()) == [0.0, 0.5, 1.0]


def test_counts_of_the_head_to_head(view):
    """The network is worse in interpolation on every problem but the two failures."""
    figure = head_to_head(view, *view.labels[:2])
    texts = [t.get_text() for t in figure.axes[0].texts]
    assert texts == ["28 of 30", "2 of 30"]


def test_fits_see_through_the_made_up_numbers(view):
    fit = fits_of(view, view.labels[1])["interpolation"]
    assert fit.slope == pytest.approx(1.0, abs=1e-9)
    assert 10**fit.intercept == pytest.approx(1.05)
    failed = fits_of(view, view.labels[0])["interpolation"]
    assert failed.left_out == 2


def test_the_page_says_what_failed_and_escapes(noisy, tmp_path):
    page = write_sweep_report(noisy, folder=tmp_path).read_text(encoding="utf-8")
    assert "90 of 90 runs are finished, 2 of them with a fit that failed" in page
    assert "Cholesky &lt;broke&gt; &amp; down" in page
    assert "rbf &lt;b&gt;&amp;" in page
    assert "<b>" not in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert (tmp_path / "figures" / "pareto-front.svg").exists()
    assert "With 5 initial conditions this describes these orbits" in page


def test_one_learner_is_not_compared(tmp_path):
    folder = made_up_store(tmp_path / "s", learners=(GP,), count=3)
    page = write_sweep_report(folder).read_text(encoding="utf-8")
    assert "The learners are not compared: 1 learner in the sweep" in page
    assert "Head to head" not in page
    assert overview_sentence(view_of(open_sweep(folder))) == (
        "3 of 3 runs are finished, no fit failed."
    )


def test_folders_that_hold_nothing(tmp_path):
    with pytest.raises(InputError, match="no folder"):
        write_sweep_report(tmp_path / "none")
    folder = made_up_store(tmp_path / "s", count=2)
    (folder / "results.parquet").unlink()
    with pytest.raises(InputError, match=r"no run of .* is finished yet"):
        write_sweep_report(folder)
    made_up_store(tmp_path / "t", count=2)
    with pytest.raises(InputError, match="extrapolation_median"):
        write_sweep_report(tmp_path / "t", "extrapolation_medina")


def test_a_real_tiny_sweep(tmp_path):
    """Truth: the oracle that knows the family of fields wins, and the page says so."""
    content = {
        "name": "tiny",
        "base": {"data": {"train_periods": 3, "extrapolation_periods": 2}},
        "axes": {
            "learner": [{"kind": "rbf_network", "centres": 10}, {"kind": "zonal_oracle"}],
            "noise.acceleration": [0, 0.01, 0.1],
        },
        "initial_conditions": {"count": 3},
    }
    um.sweep(content, tmp_path / "tiny")
    page = um.write_sweep_report(tmp_path / "tiny").read_text(encoding="utf-8")
    assert "zonal oracle has the lowest median error both on the training orbit and on" in page
    for name in ("noise-acceleration", "head-to-head", "train-against-test", "critical-difference"):
        assert f'<figure id="{name}">' in page
