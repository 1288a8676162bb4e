"""Every figure draws every kind of result, holds every value, and is the same twice."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from unmodeled.pipeline.results import LearnerResult
from unmodeled.reports import figures
from unmodeled.reports.figures.log_axes import LogRange
from unmodeled.reports.smooth import smooth_orbit
from unmodeled.reports.style import render

DRAW = [getattr(figures, name) for name in figures.__all__]
CASES = ["result", "failed", "infinite", "measured"]
_SMALLEST_FONT = 8.0


@pytest.fixture(params=CASES)
def case(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("draw", DRAW)
def test_draws(draw, case):
    figure = draw(case)
    if figure is None:
        assert draw is figures.calibration
    else:
        assert len(render(figure, "png")) > 10_000


@pytest.mark.parametrize("draw", DRAW)
def test_the_same_bytes_twice(draw, result):
    for kind in ("svg", "png"):
        assert render(draw(result), kind) == render(draw(result), kind)


@pytest.mark.parametrize("draw", DRAW)
def test_fonts_are_legible_in_print(draw, result):
    figure = draw(result)
    render(figure, "png")
    texts = [t for t in figure.findobj(lambda a: hasattr(a, "get_fontsize")) if t.get_text()]
    assert texts
    assert min(t.get_fontsize() for t in texts) >= _SMALLEST_FONT


@pytest.mark.parametrize("draw", DRAW)
def test_nothing_is_cut_at_the_edge(draw, result):
    pixels = np.asarray(Image.open(io.BytesIO(render(draw(result), "png"))).convert("L"))
    for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]):
        assert edge.min() == 255


@pytest.mark.parametrize("draw", DRAW)
def test_every_axis_names_its_unit(draw, result):
    figure = draw(result)
    words = " ".join(t.get_text() for t in figure.findobj(lambda a: hasattr(a, "get_fontsize")))
    assert any(u in words for u in ("m/s²", ", m", ", km", "dimensionless"))


@pytest.mark.parametrize("draw", [d for d in DRAW if d is not figures.trajectories])
def test_nothing_to_draw(draw, result):
    lost = tuple(
        LearnerResult(r.label, r.kind, r.baseline, failure="broke") for r in result.learners
    )
    assert draw(replace(result, learners=lost)) is None


def test_log_range_holds_everything():
    limits = LogRange.around([[1e-5, 0.0, np.inf, 0.3]])
    assert (limits.low, limits.high) == (-6, 1)
    clipped = limits.clip([0.0, 1e-5, np.inf])
    assert clipped.tolist() == [1e-6, 1e-5, 10.0]
    assert limits.above([np.inf, 0.3]) == 1
    assert limits.below([0.0, 0.3]) == 1


@pytest.mark.parametrize("values", [[0.0], [np.inf], [np.nan], []])
def test_log_range_without_numbers(values):
    limits = LogRange.around([values])
    assert limits.low < limits.high


def test_log_range_is_bounded():
    limits = LogRange.around([[1e-300, 1e300]], floor=1e-9, ceiling=1e4)
    assert (limits.low, limits.high) == (-10, 5)


def test_smooth_orbit_passes_through_the_samples(result):
    data = result.data
    orbit, units = data.orbits[0], data.units
    smooth = smooth_orbit(orbit, units)
    every = slice(None, None, 6)
    np.testing.assert_allclose(smooth.positions[every] * units.length, orbit.positions, rtol=1e-10)
    np.testing.assert_allclose(
        smooth.accelerations[every] * units.acceleration, orbit.accelerations, rtol=1e-9
    )
    # Between samples a quintic is off by less than a line width (1e-3 of the orbit).
    half = smooth_orbit(orbit[::2], units).positions[6::12]
    between = smooth.positions[6::12]
    count = min(len(half), len(between))
    assert np.abs(half[: count - 1] - smooth.positions[12::24][: count - 1]).max() < 0.01
