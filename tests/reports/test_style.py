"""Colours: fixed for each learner, whatever stands beside it; no global state."""

from __future__ import annotations

import itertools

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from unmodeled.models.learned import learner_names
from unmodeled.pipeline.config import LearnerConfig
from unmodeled.reports.figures import error_summary, flight_error
from unmodeled.reports.style import SET_STYLES, figure_style, learner_styles, render, short


def config(kind: str, **more) -> LearnerConfig:
    return LearnerConfig.model_validate({"kind": kind} | more)


def all_learners() -> list[LearnerConfig]:
    return [config(name) for name in learner_names() if name != "residual"]


def test_a_colour_does_not_depend_on_the_company():
    together = learner_styles(all_learners())
    for learner in all_learners():
        assert learner_styles([learner])[learner.label] == together[learner.label]


def test_every_kind_has_its_own_colour_and_marker():
    styles = learner_styles(all_learners()).values()
    assert len({s.colour for s in styles}) == len({s.marker for s in styles}) == len(styles)


def test_raw_and_residual_share_the_hue():
    raw, residual = learner_styles(
        [config("exact_gp", baseline="none"), config("exact_gp", baseline="point_mass")]
    ).values()
    assert raw.marker == residual.marker
    assert (raw.line, residual.line) == ("--", "-")
    assert raw.hollow
    assert not residual.hollow
    assert sum(to_rgb(raw.colour)) > sum(to_rgb(residual.colour))


def test_the_same_kind_twice_is_told_apart():
    many = [config("exact_gp", epochs=k, label=f"gp {k}") for k in (10, 20, 30, 40)]
    styles = learner_styles(many).values()
    assert len({(s.colour, s.marker) for s in styles}) == 4


def test_an_unknown_kind_has_a_colour():
    later = LearnerConfig.model_construct(kind="later", baseline="none", label="later", params={})
    assert learner_styles([later])["later"].colour.startswith("#")


def simulate_deuteranopia(colour: str) -> np.ndarray:
    # Viénot, Brettel & Mollon (1999), linear RGB.
    matrix = np.array([[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]])
    return matrix @ np.array(to_rgb(colour)) ** 2.2


def test_set_colours_differ_for_colour_blind_eyes():
    for a, b in itertools.combinations(SET_STYLES.values(), 2):
        apart = np.linalg.norm(simulate_deuteranopia(a.colour) - simulate_deuteranopia(b.colour))
        assert apart > 0.1  # of a cube with edge 1: clearly told apart


def test_global_settings_stay_as_they_were():
    before = dict(mpl.rcParams)
    with figure_style():
        assert mpl.rcParams["svg.hashsalt"] == "unmodeled"
    assert dict(mpl.rcParams) == before


def test_a_label_in_another_script_does_not_warn(result):
    with figure_style():
        figure = error_summary(result)
        figure.text(0.5, 0.5, "小惑星 $x$")
    assert render(figure, "png")


@pytest.mark.parametrize("draw", [error_summary, flight_error])
def test_the_same_colours_in_every_figure(result, draw):
    text = render(draw(result), "svg").decode()
    for style in learner_styles(result.config.learners).values():
        assert style.colour.lower() in text.lower()


def test_short_labels_are_kept_and_long_ones_cut():
    assert short("exact gp") == "exact gp"
    assert len(short("word " * 30)) <= 34
    assert "\n" not in short("two\nlines")
