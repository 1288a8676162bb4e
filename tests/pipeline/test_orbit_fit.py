"""Batch least squares against exact data, scipy, dense algebra and its own statistics."""

import numpy as np
import pytest
import scipy.optimize
import scipy.stats

from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics, PointMass, Zonal
from unmodeled.pipeline.arrow import Arrow
from unmodeled.pipeline.orbit_fit import Arc, fit_orbits

VALUES = {"GM": 4.89, "R_ref": 290.0, "J2": 1.93e-2, "J3": -1.22e-3}
TRUE = np.array([620.0, 0.0, 150.0, 0.01, 0.07, 0.045])
TIMES = np.linspace(0.0, 80_000.0, 60)
GUESS = TRUE + np.array([5.0, -4.0, 3.0, 2e-4, -3e-4, 1e-4])


@pytest.fixture(scope="module")
def bennu():
    return Dynamics([PointMass(), Zonal((2, 3))], VALUES)


def positions(dynamics, sigma, seed=None, state=TRUE, times=TIMES):
    values = dynamics.propagate(state, times)[:, :3]
    if seed is not None:
        values = values + sigma * np.random.default_rng(seed).normal(size=values.shape)
    return Measurements("position", times, values, sigma, "tracking")


def test_perfect_data_are_fitted_to_1e_9(bennu):
    start = bennu.with_values({"GM": 4.89 * 1.001, "J2": 1.5e-2})
    fit = fit_orbits(start, [Arc(0.0, GUESS, (positions(bennu, 1.0),))], {"GM": None, "J2": None})
    assert np.abs(fit.states[0] / np.where(TRUE == 0, 100.0, TRUE) - (TRUE != 0)).max() < 1e-9
    assert fit.values["GM"] == pytest.approx(4.89, rel=1e-9)
    assert fit.values["J2"] == pytest.approx(1.93e-2, rel=1e-9)
    assert fit.dynamics.values["J2"] == fit.values["J2"]
    assert fit.freedom == 180 - 8
    assert fit.rms()["rms"].item() < 1e-6


def test_noisy_data_against_scipy(bennu):
    """The same minimum and covariance as a general solver on finite differences."""
    m = positions(bennu, 2.0, seed=1)
    fit = fit_orbits(bennu, [Arc(0.0, GUESS, (m,))], {"J2": None})
    scale = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3, 1e-2])

    def residuals(p):
        p = p * scale
        model = bennu.with_values({"J2": p[6]})
        return ((m.values - model.propagate(p[:6], TIMES)[:, :3]) / 2.0).ravel()

    first = np.append(GUESS, 1.93e-2) / scale
    found = scipy.optimize.least_squares(residuals, first, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    sigma = np.sqrt(np.diag(fit.covariance))
    ours = np.append(fit.states[0], fit.values["J2"])
    # Forward differences leave an error of 1e-8 in the partials: 1e-4 of a sigma in the minimum.
    assert np.abs((ours - found.x * scale) / sigma).max() < 1e-3
    assert fit.cost == pytest.approx(2 * found.cost, rel=1e-9)
    theirs = np.linalg.inv(found.jac.T @ found.jac) * scale[:, None] * scale
    np.testing.assert_allclose(np.sqrt(np.diag(theirs)), sigma, rtol=1e-3)


def monte_carlo(bennu, count):
    misses = []
    for seed in range(count):
        fit = fit_orbits(bennu, [Arc(0.0, TRUE, (positions(bennu, 2.0, seed),))], {"J2": None})
        error = np.append(fit.states[0] - TRUE, fit.values["J2"] - 1.93e-2)
        misses.append(error @ np.linalg.solve(fit.covariance, error))
    total = float(np.sum(misses))
    # Sum of chi-square variables with 7 degrees of freedom each, 99.9 % two-sided.
    low, high = scipy.stats.chi2.ppf([5e-4, 1 - 5e-4], 7 * count)
    return low < total < high


def test_covariance_holds_over_30_fits(bennu):
    assert monte_carlo(bennu, 30)


@pytest.mark.slow
def test_covariance_holds_over_200_fits(bennu):
    assert monte_carlo(bennu, 200)


def test_a_wrong_sigma_shows_in_the_covariance_test(bennu, monkeypatch):
    """The Monte-Carlo test can fail: with noise of twice the stated sigma it does."""
    real = positions

    def louder(dynamics, sigma, seed):
        m = real(dynamics, 2 * sigma, seed)
        return Measurements("position", m.times, m.values, sigma)

    monkeypatch.setitem(globals(), "positions", louder)
    assert not monte_carlo(bennu, 30)


def test_arcs_add_their_information(bennu):
    """Without noise all fits end at the truth, so that partials are taken at the same point."""
    other = np.array([0.0, 500.0, 300.0, -0.06, 0.02, 0.05])
    arcs = [
        Arc(0.0, GUESS, (positions(bennu, 2.0),), "first"),
        Arc(0.0, other * 1.001, (positions(bennu, 3.0, state=other),), "second"),
    ]
    joint = fit_orbits(bennu, arcs, {"J2": None, "GM": None})
    single = [fit_orbits(bennu, [arc], {"J2": None, "GM": None}) for arc in arcs]
    combined = np.linalg.inv(sum(np.linalg.inv(f.covariance[6:, 6:]) for f in single))
    # Inverting twice loses the square of the condition of the scaled matrices, about 1e4.
    np.testing.assert_allclose(joint.covariance[12:, 12:], combined, rtol=1e-6)
    assert joint.values["J2"] == pytest.approx(1.93e-2, rel=1e-9)
    np.testing.assert_allclose(joint.states[1], other, atol=1e-7)
    assert joint.labels[0] == "first: x"
    assert joint.labels[-1] == "GM"


def test_arrow_is_the_dense_solution():
    rng = np.random.default_rng(0)
    design = [rng.normal(size=(30, 9)) for _ in range(4)]
    right = [rng.normal(size=30) for _ in range(4)]
    arrow = Arrow(
        np.stack([A[:, :6].T @ A[:, :6] for A in design]),
        np.stack([A[:, :6].T @ A[:, 6:] for A in design]),
        sum(A[:, 6:].T @ A[:, 6:] for A in design),
        np.stack([A[:, :6].T @ r for A, r in zip(design, right, strict=True)]),
        sum(A[:, 6:].T @ r for A, r in zip(design, right, strict=True)),
    )
    full = np.zeros((120, 27))
    for k, A in enumerate(design):
        full[30 * k : 30 * k + 30, 6 * k : 6 * k + 6] = A[:, :6]
        full[30 * k : 30 * k + 30, 24:] = A[:, 6:]
    np.testing.assert_allclose(arrow.dense(), full.T @ full, atol=1e-12)
    states, values = arrow.solve()
    expected = np.linalg.lstsq(full, np.concatenate(right), rcond=None)[0]
    np.testing.assert_allclose(np.append(states.ravel(), values), expected, atol=1e-12)


def test_a_prior_adds_its_information(bennu):
    arc = Arc(0.0, GUESS, (positions(bennu, 2.0, 1),))
    free = fit_orbits(bennu, [arc], {"J3": None})
    prior = fit_orbits(bennu, [arc], {"J3": 1e-6})
    assert prior.sigmas["J3"] == pytest.approx((free.sigmas["J3"] ** -2 + 1e12) ** -0.5, rel=1e-3)
    assert abs(prior.values["J3"] + 1.22e-3) < 1e-6
    assert prior.freedom == free.freedom + 1


def test_position_and_velocity_have_their_own_rms(bennu):
    states = bennu.propagate(TRUE, TIMES)
    rng = np.random.default_rng(3)
    noisy = states + rng.normal(size=states.shape) * np.repeat([2.0, 1e-4], 3)
    m = Measurements("position_velocity", TIMES, noisy, [2.0, 1e-4])
    fit = fit_orbits(bennu, [Arc(0.0, GUESS, (m,))])
    rms = fit.rms().set_index("type")
    assert rms.loc["position, m", "rms"] == pytest.approx(2.0, rel=0.2)
    assert rms.loc["velocity, m/s", "rms"] == pytest.approx(1e-4, rel=0.2)
    assert fit.cost == pytest.approx(fit.freedom, rel=6 * np.sqrt(2 / fit.freedom))


def test_outliers_are_left_out_and_marked(bennu):
    m = positions(bennu, 2.0, 1)
    values = m.values.copy()
    values[10, 1] += 500.0
    values[40, 2] -= 300.0
    spoiled = Measurements("position", TIMES, values, 2.0)
    plain = fit_orbits(bennu, [Arc(0.0, GUESS, (spoiled,))])
    edited = fit_orbits(bennu, [Arc(0.0, GUESS, (spoiled,))], edit_sigmas=4.5)
    out = edited.residuals[~edited.residuals["used"]]
    assert list(zip(out["t_s"], out["component"], strict=True)) == [
        (TIMES[10], "y"),
        (TIMES[40], "z"),
    ]
    sigma = np.sqrt(np.diag(edited.covariance))
    assert np.abs((edited.states[0] - TRUE) / sigma).max() < 4
    assert np.abs((plain.states[0] - TRUE) / sigma).max() > 4


def test_an_empty_column_is_said_to_be_empty(bennu):
    model = Dynamics([PointMass(), Zonal((2, 3))], VALUES | {"GM": 4.89}, spinning=True)
    arc = Arc(0.0, GUESS, (positions(bennu, 1.0),))
    with pytest.raises(DataError, match="do not depend on spin_rate: its column is empty"):
        fit_orbits(model, [arc], {"spin_rate": None})


def test_two_names_for_the_same_thing_are_singular(bennu):
    """R_ref and the zonals act together: without a prior nothing tells them apart."""
    only = Dynamics([PointMass(), Zonal((2,))], {k: VALUES[k] for k in ("GM", "R_ref", "J2")})
    arc = Arc(0.0, GUESS, (positions(only, 1.0, 1),))
    with pytest.raises(NumericalError, match="J2 and R_ref cannot be told apart"):
        fit_orbits(only, [arc], {"R_ref": None, "J2": None})


def test_bad_input(bennu):
    m = positions(bennu, 1.0)
    with pytest.raises(ConfigError, match='unknown parameter "J22"'):
        fit_orbits(bennu, [Arc(0.0, GUESS, (m,))], {"J22": None})
    with pytest.raises(ConfigError, match=r"prior of J2 is 0\.0"):
        fit_orbits(bennu, [Arc(0.0, GUESS, (m,))], {"J2": 0.0})
    with pytest.raises(DataError, match="an orbit fit without arcs"):
        fit_orbits(bennu, [])
    with pytest.raises(DataError, match="arc has no measurements"):
        Arc(0.0, GUESS, ())
    with pytest.raises(DataError, match="precedes the initial state at 10 s"):
        Arc(10.0, GUESS, (m,))
    few = Measurements("position", TIMES[:1], m.values[:1], 1.0)
    with pytest.raises(DataError, match="3 measured components for 6 unknowns"):
        fit_orbits(bennu, [Arc(0.0, GUESS, (few,))])
    with pytest.raises(DataError, match=r"sigma is 0\.0. Allowed: standard deviations > 0"):
        Measurements("position", TIMES, m.values, 0.0)
    with pytest.raises(DataError, match='kind is "range"'):
        Measurements("range", TIMES, m.values, 1.0)
    with pytest.raises(DataError, match=r"sigma has shape \(3,\)"):
        Measurements("position", TIMES, m.values, [1.0, 1.0, 1.0])
