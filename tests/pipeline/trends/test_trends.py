"""Bands, fits and boundaries against numbers that are known beforehand."""

import numpy as np
import pandas as pd
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.bodies import load_body
from unmodeled.models.physics import Dynamics, Zonal
from unmodeled.pipeline.trends.bands import bands, levels_of, quartiles, slices
from unmodeled.pipeline.trends.collision_boundary import collision_boundary, screen
from unmodeled.pipeline.trends.log_fit import log_fit
from unmodeled.pipeline.trends.outliers import outliers
from unmodeled.pipeline.trends.zonal_reach import hill_radius, zonal_reach


def table(**columns):
    return pd.DataFrame({"failure": "", **columns})


def test_a_band_holds_every_run_and_failures_are_infinite():
    t = table(learner="a", level=0.5, train_median=[1.0, 2.0, 3.0, 4.0, 5.0])
    t.loc[4, "failure"] = "broke"
    (row,) = bands(t, "level", "train_median").to_dict(orient="records")
    assert (row["runs"], row["failures"], row["median"], row["high"]) == (5, 1, 3.0, 4.0)
    t.loc[2:, "failure"] = "broke"
    assert bands(t, "level", "train_median")["median"][0] == np.inf


def test_quartiles_of_finite_numbers_are_numpys():
    values = np.random.default_rng(1).lognormal(size=37)
    assert quartiles(values) == tuple(np.quantile(values, [0.25, 0.5, 0.75]))


def test_words_for_volumes_are_periods():
    assert levels_of(pd.DataFrame({"v": ["low", "moderate"]}), "v").tolist() == [10.0, 100.0]


def test_slices_vary_one_axis_only():
    t = pd.DataFrame({"x": [0, 1, 0, 1, 0], "y": [0, 0, 1, 1, 2]})
    parts = slices(t, "x", ["x", "y"])
    assert [where for where, _ in parts] == [{"y": 0}, {"y": 1}]  # y = 2 has one level of x
    assert [len(part) for _, part in parts] == [2, 2]
    assert slices(t[["x"]], "x", ["x"])[0][0] == {}


def test_missing_column_names_the_nearest():
    with pytest.raises(DataError, match="train_median"):
        bands(table(learner="a", level=0.0, train_median=[1.0]), "level", "train_medina")


def test_log_fit_is_least_squares_in_the_logarithms():
    rng = np.random.default_rng(2)
    x = 10 ** rng.uniform(-5, 1, 80)
    y = x**1.2 * 10 ** (0.3 + 0.2 * rng.standard_normal(80))
    fit = log_fit(np.append(x, [np.inf, 0.0]), np.append(y, [1.0, 1.0]))
    slope, intercept = np.polyfit(np.log10(x), np.log10(y), 1)
    residual = np.log10(y) - slope * np.log10(x) - intercept
    assert (fit.slope, fit.intercept) == pytest.approx((slope, intercept), rel=1e-10)
    # The definition of R²: one minus residual over total sum of squares.
    assert fit.r_squared == pytest.approx(1 - residual.var() / np.log10(y).var(), rel=1e-10)
    assert (fit.count, fit.left_out) == (80, 2)
    assert abs(fit.slope - 1.2) < 5 * fit.slope_sigma


@pytest.mark.parametrize("x", [[1.0, 2.0], [1.0, 1.0, 1.0], [np.inf, 0.0, 1.0]])
def test_no_line_through_too_little(x):
    with pytest.raises(DataError, match="3 or more that differ"):
        log_fit(np.array(x), np.ones(len(x)))


def test_on_its_contour_a_term_has_its_share_of_the_potential():
    """Against the acceleration by heyoka: a term of degree n pulls with (n + 1) u / r radially."""
    body = load_body("bennu")
    reach = zonal_reach(body, share=0.1, count=37)
    wanted = 0.1 * body.gm / reach.hill_radius
    for n, radius in reach.radius.items():
        keep = radius > 0.05 * body.brillouin_radius  # at a zero of P_n there is no contour
        theta, r = reach.colatitude[keep], radius[keep]
        unit = np.column_stack([np.sin(theta), 0 * theta, np.cos(theta)])
        values = {"GM": body.gm, "R_ref": body.reference_radius, f"J{n}": body.zonals[n]}
        field = Dynamics([Zonal((n,))], values)
        pull = np.sum(field.acceleration(r[:, None] * unit) * unit, axis=1)
        # P_n cancels near its zeros: absolute rounding of 1e-16 (n + 1) over its value there.
        np.testing.assert_allclose(np.abs(pull) * r / (n + 1), wanted, rtol=1e-6)


def test_the_lobes_close_at_the_centre():
    reach = zonal_reach(load_body("bennu"))
    for n, radius in reach.radius.items():
        # (1e-16)^(1/(n+1)) of a radius is left where P_n is zero up to rounding.
        assert np.sum(radius < 0.02 * reach.largest(n) * 290.0) >= n


def test_hill_radius_by_kepler():
    """At the Hill radius a third of the mean motion's square balances: n² r³ = GM / 3."""
    body = load_body("bennu")
    n = body.heliocentric_orbit.mean_motion
    assert 3 * n**2 * hill_radius(body) ** 3 == pytest.approx(body.gm, rel=1e-12)


def test_bodies_that_have_no_such_radius():
    with pytest.raises(ConfigError, match="has no heliocentric_orbit"):
        zonal_reach(load_body("moon"))
    with pytest.raises(ConfigError, match="share is 0"):
        zonal_reach(load_body("bennu"), share=0.0)


def made_up(count=4000, *, inclination=0.0):
    """Initial conditions that collide above e = 0.2 a - 0.05, moved by the inclination."""
    rng = np.random.default_rng(3)
    frame = pd.DataFrame(
        {
            "semi_major_axis": rng.uniform(1.25, 3, count),
            "eccentricity": rng.uniform(0.05, 0.75, count),
            **{
                name: rng.uniform(0, 180, count)
                for name in ("inclination", "node", "periapsis", "true_anomaly")
            },
        }
    )
    line = 0.2 * frame["semi_major_axis"] - 0.05
    line += inclination * np.cos(np.deg2rad(frame["inclination"])) + rng.logistic(0, 0.01, count)
    return frame.assign(entry_periods=np.where(frame["eccentricity"] > line, 1.0, np.nan))


def test_the_boundary_is_found():
    """The truth is logistic in a and e: slope and intercept come back within their errors."""
    b = collision_boundary(made_up())
    assert b.slope == pytest.approx(0.2, abs=0.01)
    assert b.intercept == pytest.approx(-0.05, abs=0.02)
    assert b.wrong < 0.04
    assert b.p_other > 1e-3
    assert collision_boundary(made_up(inclination=0.1)).p_other < 1e-10


def test_one_kind_only():
    all_free = made_up().assign(entry_periods=np.nan)
    with pytest.raises(DataError, match="0 of 4000 initial conditions collide"):
        collision_boundary(all_free)


def test_screening_begins_the_same_and_knows_kepler():
    body = load_body("bennu")
    few, more = screen(body, 20), screen(body, 40)
    pd.testing.assert_frame_equal(few, more.iloc[:20])
    deep = more["semi_major_axis"] * (1 - more["eccentricity"]) < 0.8
    assert more["entry_periods"][deep].notna().all()
    assert deep.any()
    with pytest.raises(ConfigError, match="0 initial conditions"):
        screen(body, 0)


def test_outliers_are_far_above_their_own_cell_and_say_whether_the_data_explain_them():
    t = table(
        learner=["a"] * 6 + ["b"] * 6,
        noise=[0.0, 0.0, 0.0, 1.0, 1.0, 1.0] * 2,
        interpolation_median=[1e-5, 2e-5, 1e-3, 0.5, 0.6, 5.9, 0.1, 0.2, 0.3, 1.0, 2.0, 200.0],
        train_largest_observed=[1.0] * 11 + [500.0],
    )
    t.loc[0, "failure"] = "broke"  # infinite: the median of the cell is then 1e-3
    found = outliers(t, ["noise"])
    assert found["interpolation_median"].tolist() == [200.0]
    assert found["explained"].tolist() == [True]
    assert found["times_cell"].tolist() == [100.0]
    t.loc[0, "failure"] = ""
    found = outliers(t, ["noise"])
    assert found["interpolation_median"].tolist() == [200.0, 1e-3]
    assert found["explained"].tolist() == [True, False]
    assert not outliers(t.drop(columns="train_largest_observed"), ["noise"])["explained"].any()
