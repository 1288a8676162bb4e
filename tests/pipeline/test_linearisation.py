"""Columns of a linearised case against what refits and propagations really do."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from unmodeled.pipeline.cases.catalogue import candidate_by_name
from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate
from unmodeled.pipeline.linearisation import Linearisation


@pytest.fixture(scope="module")
def bennu():
    case = simulate("bennu", 5).case
    fit = case.fit()
    return case.at(fit), Linearisation(case.at(fit), fit)


@pytest.mark.parametrize("name", ["srp", "tesseral_2_2", "constant_transverse", "pole_error"])
def test_columns_are_the_change_of_the_predictions(bennu, name):
    case, lin = bennu
    candidate = candidate_by_name(name, case.candidates)
    columns = lin.columns(candidate.effect, candidate.values, candidate.estimate)
    for k, (parameter, prior) in enumerate(zip(candidate.estimate, candidate.priors, strict=True)):
        # Small enough to be linear, large enough to be above rounding.
        step = prior * min(1.0, 1e-2 / max(np.abs(columns[:, k]).max() * prior, 1e-30))
        moved = []
        for sign in (1, -1):
            values = {**candidate.values, parameter: candidate.values[parameter] + sign * step}
            changed = case.with_effect(candidate, values, {})
            arc = changed.arcs[0]
            m = arc.measurements[0]
            grid = np.unique(np.concatenate([[arc.epoch], m.times]))
            states = changed.dynamics.propagate(arc.state, grid)
            at = states[np.searchsorted(grid, m.times)]
            moved.append((m.predicted(at) / m.sigmas).ravel())
        finite = (moved[0] - moved[1]) / (2 * step)
        size = np.abs(finite).max()
        assert_allclose(columns[:, k] / size, finite / size, atol=2e-3)


def test_projection_removes_what_states_absorb(bennu):
    case, lin = bennu
    rng = np.random.default_rng(0)
    absorbed = lin._blocks[0] @ (rng.standard_normal(6) / np.linalg.norm(lin._blocks[0], axis=0))
    assert np.linalg.norm(lin.project(absorbed)) < 1e-9 * np.linalg.norm(absorbed)
    columns = lin.candidate_columns(candidate_by_name("srp", case.candidates))[0]
    once = lin.project(columns)
    assert_allclose(lin.project(once), once, rtol=1e-9, atol=1e-9 * np.abs(once).max())
    # The residuals of a converged fit have nothing left that a state could absorb.
    assert np.linalg.norm(lin.residuals - lin.project(lin.residuals)) < 1e-2


def test_score_predicts_what_the_exact_refit_gains(bennu):
    """Chi-square falls by the linear drop when the effect is added and everything refitted."""
    made = simulate("bennu", 5, [HiddenEffect("srp", noncentrality=200.0)])
    case = made.case
    fit = case.fit()
    lin = Linearisation(case.at(fit), fit)
    candidate = candidate_by_name("srp", case.candidates)
    column = lin.project(lin.candidate_columns(candidate)[0])[:, 0]
    drop = (column @ lin.residuals) ** 2 / (column @ column)
    estimate = (column @ lin.residuals) / (column @ column)
    full = case.with_effect(candidate, {"srp_CrA_m": estimate}, {"srp_CrA_m": None}).fit()
    assert fit.cost - full.cost == pytest.approx(drop, rel=1e-3)
    assert full.values["srp_CrA_m"] == pytest.approx(estimate, rel=1e-3)
    assert full.sigmas["srp_CrA_m"] == pytest.approx(1 / np.linalg.norm(column), rel=5e-3)


def test_free_parameters_and_their_priors_are_known_columns():
    case = simulate("bennu", 6).case
    loose = replace(case, estimate={"GM": None})
    held = replace(case, estimate={"GM": 1e-12})
    freedom = []
    for one in (loose, held):
        fit = one.fit()
        lin = Linearisation(one.at(fit), fit)
        column = lin.columns(one.dynamics.effects[0], {}, ("GM",))
        left = np.linalg.norm(lin.project(column)) / np.linalg.norm(column)
        freedom.append((lin.freedom, left))
    # Without prior the column is absorbed; a tight prior leaves it as if it were fixed.
    assert freedom[0][1] < 1e-8
    assert freedom[1][1] > 1e-3
    assert freedom[1][0] == freedom[0][0] + 1
