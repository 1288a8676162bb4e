import numpy as np
import pytest

from unmodeled.core.errors import NumericalError
from unmodeled.models.learned import PointMassOnly
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig

CONTENT = {
    "seed": 5,
    "data": {"train_periods": 4, "extrapolation_periods": 2, "extrapolation_orbits": 2},
    "learners": [
        {"kind": "point_mass"},
        {"kind": "zonal_oracle"},
        {"kind": "exact_gp", "baseline": "none", "epochs": 60},
        {"kind": "rbf_network", "baseline": "point_mass", "centres": 25},
    ],
    "flight": {"periods": [1, 2], "orbits": 1},
}


def resolve(**changes):
    return CharacterizationConfig.resolve(CONTENT | changes)


@pytest.fixture(scope="module")
def result():
    return characterize(resolve())


def test_sets_have_the_right_sizes(result):
    counts = result.summary().query("learner == 'point mass'").set_index("set")["count"]
    assert counts.to_dict() == {"train": 95, "interpolation": 5, "extrapolation": 100}


def test_the_oracle_recovers_the_field(result):
    """Without noise the family is known: the error is that of rounding in the fit."""
    assert result["zonal oracle"].summaries["extrapolation"].worst < 1e-12


def test_the_papers_finding_in_small(result):
    """Raw GP: interpolation is as good as training, extrapolation more than a decade worse."""
    s = result["exact gp"].summaries
    assert s["interpolation"].median < 10 * s["train"].median
    assert s["extrapolation"].median > 10 * s["interpolation"].median


def test_extrapolation_of_the_raw_gp_is_worse_than_a_bare_point_mass(result):
    raw = result["exact gp"].summaries["extrapolation"].median
    assert raw > result["point mass"].summaries["extrapolation"].median


def test_the_true_field_flies_to_rounding(result):
    assert result.flight_floor < 1e-6  # m


def test_flights_are_tabulated_in_metres(result):
    table = result.flights().query("learner == 'zonal oracle'")
    assert list(table["set"]) == ["train", "extrapolation"]
    assert (table["position_error_m_1_periods"] < 1e-6).all()
    growing = result.flights().query("learner == 'point mass'")
    assert (growing["position_error_m_2_periods"] >= growing["position_error_m_1_periods"]).all()


def test_calibration_only_where_there_is_a_covariance(result):
    assert set(result.calibration()["learner"]) == {"exact gp"}


def test_a_learner_does_not_depend_on_its_neighbours(result):
    alone = characterize(resolve(learners=CONTENT["learners"][2:3]))
    for name, errors in alone["exact gp"].errors.items():
        assert np.array_equal(errors, result["exact gp"].errors[name])


def test_a_failed_fit_is_a_row_not_a_gap(monkeypatch):
    def broken(self, X, y, noise, progress):
        raise NumericalError("the matrix is singular")

    monkeypatch.setattr(PointMassOnly, "_fit", broken)
    result = characterize(resolve(learners=[{"kind": "point_mass"}, {"kind": "zonal_oracle"}]))
    assert result["point mass"].failure == "the matrix is singular."
    assert result["zonal oracle"].failure == ""
    assert len(result.costs()) == 2


def test_progress_goes_from_0_to_1():
    shares = []
    characterize(
        resolve(learners=CONTENT["learners"][:2]), report=lambda text, share: shares.append(share)
    )
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    assert shares == sorted(shares)


def test_noise_reaches_the_learners_and_not_the_truth():
    quiet = characterize(resolve(learners=[{"kind": "zonal_oracle"}]))
    noisy = characterize(resolve(learners=[{"kind": "zonal_oracle"}], noise={"acceleration": 0.1}))
    assert np.array_equal(
        quiet.data.extrapolation.accelerations, noisy.data.extrapolation.accelerations
    )
    assert (
        noisy["zonal oracle"].summaries["train"].median
        > 1e6 * quiet["zonal oracle"].summaries["train"].median
    )


def test_saved_fields_fly_as_the_fitted_ones(result, tmp_path):
    result.save(tmp_path)
    from unmodeled.pipeline.learned_field import LearnedField

    back = LearnedField.load(tmp_path / "models" / "exact-gp.safetensors")
    x = result.data.train.positions * result.data.units.length
    assert np.array_equal(back.acceleration(x), result.field("exact gp").acceleration(x))
