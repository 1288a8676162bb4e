"""Figures of a diagnosis, from plain numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from unmodeled.reports.families import FAMILY_COLOURS, family_colour
from unmodeled.reports.figures.candidate_scores import candidate_scores
from unmodeled.reports.figures.residuals_in_time import residuals_in_time
from unmodeled.reports.figures.waterfall import Bar, waterfall
from unmodeled.reports.style import render


def candidates(count: int = 30) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "name": [f"c{k}" for k in range(count)],
            "title": [f"candidate {k}" for k in range(count)],
            "family": [list(FAMILY_COLOURS)[k % 8] for k in range(count)],
            "drop": np.logspace(4, -2, count),
            "threshold": 15.0,
        }
    )


def texts(axes) -> list[str]:
    return [t.get_text().strip() for t in axes.texts]


def test_the_waterfall_shows_every_number_and_the_floor():
    bars = [Bar("model as given", 131.0, 40.0), Bar("+ srp", 1.21, None), Bar("+ drag", 0.99, 1.02)]
    axes = waterfall(bars, 0.995).axes[0]
    assert texts(axes) == ["131", "40.0", "1.21", "0.990", "1.02"]
    assert axes.get_yscale() == "log"
    assert any(np.allclose(line.get_ydata(), 0.995) for line in axes.lines)
    tops = [p.get_y() + p.get_height() for p in axes.patches]
    assert tops == pytest.approx([131.0, 40.0, 1.21, 0.99, 1.02])


def test_a_small_fall_is_drawn_from_zero():
    axes = waterfall([Bar("model as given", 1.4), Bar("+ srp", 1.0)], 1.0).axes[0]
    assert axes.get_yscale() == "linear"
    assert axes.get_ylim()[0] == 0.0


def test_each_added_effect_has_its_line():
    figure = waterfall([Bar("model as given", 2.0), Bar("+ a\n+ b", 1.0)], 1.0, "noise as stated")
    assert [t.get_text() for t in figure.axes[0].get_xticklabels()][1] == "+ a\n+ b"
    assert "noise as stated" in [t.get_text() for t in figure.legends[0].get_texts()]


def test_candidates_that_were_found_are_shown_however_weak_they_looked():
    axes = candidate_scores(candidates(), {"c29"}, 1.0).axes[0]
    labels = [t.get_text() for t in axes.get_yticklabels()]
    assert labels[-1] == "candidate 29"
    assert len(labels) == 19
    assert sum("found" in t for t in texts(axes)) == 1


def test_the_needed_fall_grows_with_the_noise():
    ticks = [
        candidate_scores(candidates(3), (), noise).axes[0].lines[0].get_xdata()[0]
        for noise in (1.0, 2.0)
    ]
    assert ticks == [15.0, 60.0]


def test_no_candidates_no_figure():
    empty = pd.DataFrame(columns=["name", "parameter", "smallest_detectable", "unit"])
    assert candidate_scores(empty, (), 1.0) is None


def test_every_family_has_a_colour_of_its_own():
    assert len(set(FAMILY_COLOURS.values())) == len(FAMILY_COLOURS)
    assert family_colour("something else") not in FAMILY_COLOURS.values()


def residuals(scale: float, labels=("a", "b")) -> pd.DataFrame:
    t = np.linspace(0, 3 * 86_400, 40)
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "label": label,
                    "component": "range",
                    "t_s": t,
                    "residual": scale * np.sin(t),
                    "sigma": 0.5,
                    "used": t > 1e4,
                }
            )
            for label in labels
        ],
        ignore_index=True,
    )


def test_residuals_are_drawn_in_sigmas_with_edited_ones_as_crosses():
    figure = residuals_in_time(residuals(5.0), residuals(0.4))
    top, bottom = figure.axes
    assert top.get_ylim()[1] > 8
    assert bottom.get_ylim()[1] == pytest.approx(1.08 * 3.2)
    assert [line.get_marker() for line in top.lines].count("x") == 2
    assert bottom.get_xlabel().endswith(", d")
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["a range", "b range"]
    assert render(figure, "png")
