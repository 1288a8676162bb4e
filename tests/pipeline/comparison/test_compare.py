"""Comparisons whose answer is known, because the truth is."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from unmodeled.core.errors import DataError
from unmodeled.pipeline.cases.catalogue import candidate_by_name
from unmodeled.pipeline.cases.simulate_case import simulate
from unmodeled.pipeline.comparison.compare import compare


def test_noise_is_noise(noise):
    assert noise.only_noise
    assert noise.explanation.kind == "nothing"
    assert noise.force.log_bayes < 0
    assert min(m.p for m in noise.maps) > 0.01


def test_radiation_depends_on_the_sun(radiation):
    assert not radiation.only_noise
    assert radiation.explanation.kind == "radiation"
    best = radiation.explanation.table.iloc[0]
    assert best["depends_on"] == "direction of the Sun"
    assert best["noise"] == pytest.approx(1.0, abs=0.05)


def test_tesserals_are_gravity_without_curl(gravity):
    assert gravity.explanation.kind == "gravity"
    assert gravity.explanation.curl_free
    assert "longitude" in [m.variable for m in gravity.maps if m.p < 0.01]


def test_residuals_turn_to_rtn_without_changing_size(radiation):
    rtn, table = radiation.rtn, radiation.residuals
    square = (table["residual"] ** 2).groupby(table["t_s"]).sum()
    np.testing.assert_allclose((rtn[list("RTN")] ** 2).sum(axis=1), square, rtol=1e-12)
    np.testing.assert_allclose(rtn[["sigma_R", "sigma_T", "sigma_N"]], 0.5, rtol=1e-12)


def test_misstated_noise_is_no_structure():
    c = compare(simulate("bennu", 3, noise_factor=2.0).case)
    assert c.structureless
    assert not c.only_noise
    assert c.sigmas_left == pytest.approx(2.0, abs=0.1)


def test_everything_goes_into_json(radiation):
    content = json.loads(json.dumps(radiation.as_json(), allow_nan=False))
    assert content["explanation"]["kind"] == "radiation"
    assert content["fit"]["residual_rms_sigmas"] == pytest.approx(radiation.sigmas_left)
    assert {m["variable"] for m in content["maps"]} >= {"radius", "place", "time"}


def test_a_parameter_that_does_nothing_is_said_to():
    case = simulate("bennu", 3).case
    tag = candidate_by_name("time_tag", case.candidates)
    # The tag is that of a data set which is not there.
    other = replace(case.arcs[0].measurements[0], label="others")
    arc = replace(case.arcs[0], measurements=(other,))
    idle = replace(case.with_effect(tag, {}, {tag.estimate[0]: None}), arcs=(arc,))
    with pytest.raises(DataError, match="do not depend on"):
        compare(idle)


@pytest.mark.slow
def test_false_alarms_over_twenty_noise_seeds():
    found = [compare(simulate("bennu", seed).case) for seed in range(20)]
    # Map p-values already count the variables: at 5 % one in twenty maps-of-a-case.
    assert sum(min(m.p for m in c.maps) < 0.05 for c in found) <= 4
    assert sum(c.only_noise for c in found) >= 18
    assert all(c.explanation.kind == "nothing" for c in found)
    # Single p-values are uniform: their mean is 0.5 +- 0.29 / sqrt(n / 3), n not independent.
    raw = [m.p for c in found for m in c.maps if m.variable == "argument_of_latitude"]
    assert np.mean(np.array(raw) < 1.0) < 0.5
