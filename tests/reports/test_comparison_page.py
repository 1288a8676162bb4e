"""Words and page of a comparison."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate
from unmodeled.pipeline.comparison.compare import compare
from unmodeled.reports.comparison_page import comparison_sections, write_comparison_report
from unmodeled.reports.comparison_words import comparison_overview, comparison_words

pytestmark = pytest.mark.xdist_group("comparison_page")


@pytest.fixture(scope="module")
def gravity():
    return compare(simulate("bennu", 3, [HiddenEffect("tesseral_2_2", noncentrality=1000.0)]).case)


@pytest.fixture(scope="module")
def noise():
    return compare(simulate("bennu", 3).case)


def test_noise_in_words(noise):
    assert comparison_overview(noise) == "The residuals are what the noise alone would give."
    words = " ".join(comparison_words(noise))
    assert "The residuals ask for no acceleration" in words or "Bayes factor" in words
    assert "All 3 series of residuals are white" in words


def test_gravity_in_words(gravity):
    sentence = comparison_overview(gravity)
    assert re.match(r"The residuals are 1\.\d times the noise; ", sentence)
    assert "depending on body-fixed position, curl-free: it looks like gravity." in sentence


def test_misstated_noise_in_words(noise):
    larger = replace(noise, cost=4.0 * noise.cost)
    assert "it is the noise that is larger than stated" in comparison_overview(larger)


def test_the_undecided_names_what_it_may_be(gravity):
    shares = dict.fromkeys(gravity.explanation.probabilities, 0.0)
    shares |= {"gravity": 0.5, "radiation": 0.4, "undecided": 0.05}
    split = replace(gravity.explanation, kind="undecided", probabilities=shares)
    sentence = comparison_overview(replace(gravity, explanation=split))
    assert sentence.endswith("it may be gravity or radiation pressure.")


def test_the_page_stands_alone(gravity, tmp_path):
    page = write_comparison_report(gravity, tmp_path)
    text = page.read_text(encoding="utf-8")
    assert comparison_overview(gravity) in text
    assert "<script" not in text
    assert not re.search(r'(?:src|href)="https?:', text)
    names = {"residuals-in-time", "residual-maps", "place-map", "acceleration", "correlation"}
    assert {p.stem for p in (tmp_path / "figures").glob("*.png")} == names
    for name in names:
        assert f'id="{name}"' in text


def test_no_force_no_figure_of_it(noise):
    quiet = replace(noise, force=replace(noise.force, prior_sigma=0.0))
    force = next(s for s in comparison_sections(quiet) if s.id == "force")
    assert force.figures == ()
    assert [len(t.rows) > 0 for t in force.tables] == [True]
