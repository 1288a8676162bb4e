"""The least a learner must do: near a bare point mass on data that it has not seen."""

import numpy as np
import pytest

from unmodeled.core.errors import DataError, NumericalError
from unmodeled.models.learned import (
    HarmonicLeastSquares,
    NearestNeighbour,
    NoiseLevel,
    PointMassOnly,
    RBFNetwork,
)
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.training_check import training_check
from unmodeled.pipeline.use_check import UseCheck

GM = 4 * np.pi**2


@pytest.mark.parametrize(
    ("median", "point_mass", "advice"),
    [
        (0.0099, 0.005, "passes"),
        (0.0101, 0.005, "do not use"),
        (np.inf, 0.005, "do not use"),
        (np.nan, 0.005, "do not use"),
        (1e-13, 0.0, "passes"),  # rounding against rounding
        (1e-9, 0.0, "do not use"),  # the truth is the point mass itself
    ],
)
def test_the_limit_is_twice_the_point_mass(median, point_mass, advice):
    assert UseCheck(median, point_mass).advice == advice


def ellipse(count=100, tilt=0.0):
    """A Kepler ellipse, semi-major axis 2, eccentricity 0.4, with a mass 1 % too large in y."""
    f = np.linspace(0, 2 * np.pi, count, endpoint=False)
    r = 2 * (1 - 0.4**2) / (1 + 0.4 * np.cos(f))
    X = np.stack([r * np.cos(f), r * np.sin(f) * np.cos(tilt), r * np.sin(f) * np.sin(tilt)], 1)
    y = -GM * X / r[:, None] ** 3
    return X, y * [1.0, 1.01, 1.0]


def test_stretches_about_apoapsis_and_periapsis_are_held_back():
    X, y = ellipse()
    seen = []

    class Watching(PointMassOnly):
        name = ""  # not registered

        def _fit(self, X, y, noise, progress):
            seen.append(X)
            super()._fit(X, y, noise, progress)

    check = training_check(Watching, X, y)
    assert [len(x) for x in seen] == [80, 80]
    radii = [np.linalg.norm(x, axis=1) for x in seen]
    # apoapsis is at 2.8, periapsis at 1.2: each is away from one of the fits only
    assert radii[0].max() < 2.8 - 0.1 < radii[1].max()
    assert radii[0].min() < 1.2 + 0.01 < radii[1].min()
    assert (check.samples, check.held_out) == (40, "the far and the near stretch")
    assert check.ratio == 1.0


def test_each_orbit_is_left_out_once():
    parts = [ellipse(30, tilt) for tilt in (0.0, 0.7, 1.4)]
    X, y = (np.concatenate(p) for p in zip(*parts, strict=True))
    orbits = np.repeat([4, 7, 9], 30)
    seen = []

    class Watching(NearestNeighbour):
        name = ""  # not registered

        def _fit(self, X, y, noise, progress):
            seen.append(len(X))
            super()._fit(X, y, noise, progress)

    check = training_check(Watching, X, y, orbits=orbits)
    assert seen == [60, 60, 60]
    assert (check.samples, check.held_out) == (90, "each of 3 orbits")
    assert check.advice == "do not use"  # the other orbits are far


def test_many_orbits_leave_five_out():
    parts = [ellipse(10, tilt) for tilt in np.linspace(0, 1, 12)]
    X, y = (np.concatenate(p) for p in zip(*parts, strict=True))
    check = training_check(PointMassOnly, X, y, orbits=np.repeat(np.arange(12), 10))
    assert (check.samples, check.held_out) == (50, "each of 5 orbits of 12")


def test_a_field_passes_and_the_nearest_sample_does_not():
    X, y = ellipse()
    y = HarmonicLeastSquares(degree=2).fit(X, y).predict(X)  # a field indeed
    assert training_check(lambda: HarmonicLeastSquares(degree=2), X, y).advice == "passes"
    assert training_check(NearestNeighbour, X, y).advice == "do not use"


def test_noise_of_single_samples_goes_with_them():
    X, y = ellipse(40)
    noise = NoiseLevel(samples=np.linspace(0.1, 1, 120).reshape(40, 3))
    assert training_check(RBFNetwork, X, y, noise).samples == 16


def test_a_fit_that_breaks_down_counts_as_infinite():
    class Breaks(PointMassOnly):
        name = ""  # not registered

        def _fit(self, X, y, noise, progress):
            raise NumericalError("no")

    check = training_check(Breaks, *ellipse(20))
    assert check.median == np.inf
    assert check.unfit
    assert "no" in check.failure


def test_too_few_samples():
    X, y = ellipse(1)
    with pytest.raises(DataError, match="longer trajectory"):
        training_check(PointMassOnly, X, y)


@pytest.fixture(scope="module")
def result():
    return characterize(
        CharacterizationConfig.resolve(
            {
                "seed": 5,
                "data": {"train_periods": 3, "extrapolation_periods": 1},
                "learners": [
                    {"kind": "point_mass"},
                    {"kind": "zonal_oracle"},
                    {"kind": "nearest_neighbour", "baseline": "none"},
                ],
                "flight": {"periods": [1], "orbits": 1},
            }
        )
    )


def test_the_summary_says_it(result):
    said = result.summary().groupby("learner")["use"].agg(set).to_dict()
    assert said == {
        "point mass": {"passes"},
        "zonal oracle": {"passes"},
        "nearest neighbour": {"do not use"},
    }
    row = result.summary().query("learner == 'nearest neighbour' and set == 'extrapolation'")
    reference = result["point mass"].summaries["extrapolation"].median
    assert row["over_point_mass"].item() == row["median"].item() / reference


def test_both_checks_are_tabulated_and_saved(result, tmp_path):
    table = result.use_checks()
    assert list(table["check"]) == ["extrapolation", "training"] * 3
    assert set(table["held_out"]) == {"other orbits", "the far and the near stretch"}
    result.save(tmp_path)
    assert "do not use" in (tmp_path / "use-checks.csv").read_text()
    assert result.as_json()["use_checks"][0]["use"] == "passes"


def test_the_check_can_be_left_out(result):
    content = result.config.as_dict() | {"training_check": False}
    again = characterize(CharacterizationConfig.resolve(content))
    assert {r.training_check for r in again.learners} == {None}
    for before, after in zip(result.learners, again.learners, strict=True):
        assert before.summaries == after.summaries
