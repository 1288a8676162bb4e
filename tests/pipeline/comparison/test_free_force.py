"""The reconstructed acceleration against one that was drawn from the very prior."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from unmodeled.core.frames import rtn_from_inertial
from unmodeled.pipeline.comparison.free_force import free_force
from unmodeled.pipeline.comparison.orbit_geometry import revolution


@pytest.fixture(scope="module", params=[1, 2])
def drawn(request, noise_lin):
    """Residuals of a Gauss-Markov acceleration with a correlation time of one revolution."""
    a = noise_lin.arcs[0].partials
    period = revolution(a.node_states, a.nodes)
    rng = np.random.default_rng(request.param)
    # Linear over an eighth of a revolution, as resolved.
    times = np.arange(a.nodes[0], a.nodes[-1] + period / 8, period / 8)
    steps, f = rng.normal(size=(len(times), 3)), np.exp(-1 / 8)
    values = [steps[0]]
    for step in steps[1:]:
        values.append(f * values[-1] + np.sqrt(1 - f**2) * step)
    push = 1e-8 * np.stack(
        [np.interp(a.nodes, times, axis) for axis in np.transpose(values)], axis=1
    )
    inertial = np.einsum("nji,nj->ni", rtn_from_inertial(a.node_states), push)
    lin = copy.copy(noise_lin)
    column = noise_lin.force_columns([inertial[:, :, None]])[:, 0]
    lin.residuals = noise_lin.project(column + rng.normal(size=len(column)))
    return free_force(lin, period), a.nodes, push, period


def test_sigmas_cover_and_data_tell(drawn):
    force, nodes, push, period = drawn
    table = force.table
    true = push[np.searchsorted(nodes, table["t_s"])]
    error = table[list("RTN")].to_numpy() - true
    sigma = table[["sigma_R", "sigma_T", "sigma_N"]].to_numpy()
    # Errors of neighbours are correlated: a third of 3 x 40 pulls count.
    assert np.sqrt(np.mean((error / sigma) ** 2)) == pytest.approx(1.0, abs=0.3)
    assert np.mean(error**2) < 0.6 * np.mean(true**2)
    assert force.prior_sigma == pytest.approx(1e-8, rel=0.7)
    assert force.tau in (
        pytest.approx(0.3 * period),
        pytest.approx(period),
        pytest.approx(3 * period),
    )
    assert force.log_bayes > 100


def test_axes_agree(drawn):
    table = drawn[0].table
    size = np.linalg.norm(table[list("RTN")], axis=1)
    np.testing.assert_allclose(np.linalg.norm(table[list("xyz")], axis=1), size, rtol=1e-12)
