"""Training on a fitted orbit: the orbit is right, and learners gain by it."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.models.learned import HarmonicGP, NoiseLevel, PointMassOnly
from unmodeled.pipeline.batch_characterize import characterize_batch
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.metrics import fractional_error
from unmodeled.pipeline.orbit_data import OrbitData
from unmodeled.pipeline.orbit_guess import first_guess
from unmodeled.pipeline.orbit_smoothing import smooth_orbit
from unmodeled.pipeline.prepare import prepare
from unmodeled.pipeline.trajectory_consistent import train_consistently, trajectory_consistent_fit
from unmodeled.reports.data_words import data_sentences

GM = 4 * np.pi**2
SIGMA = 0.05


def learning_data(seed, state=SIGMA, **more):
    content = {"seed": seed, "noise": {"state": state}, "learners": [{"kind": "point_mass"}]}
    return prepare(CharacterizationConfig.resolve(content | more))


@pytest.fixture(scope="module")
def data():
    return learning_data(1)


@pytest.fixture(scope="module")
def fit(data):
    return train_consistently(data, HarmonicGP())


def kepler(samples=60, e=0.3):
    """States on an ellipse about a point mass, by a series written here; and their times."""
    t = np.arange(samples) / 8.0  # two revolutions and a half
    mean = 2 * np.pi * t / 2.0**1.5
    E = mean.copy()
    for _ in range(60):
        E -= (E - e * np.sin(E) - mean) / (1 - e * np.cos(E))
    x = np.column_stack([2 * (np.cos(E) - e), 2 * np.sqrt(1 - e * e) * np.sin(E), 0 * E])
    return t, x[:, [2, 0, 1]]


def test_first_guess_is_the_ellipse_through_clean_positions():
    t, x = kepler()
    states = first_guess(t, x, GM)
    np.testing.assert_allclose(states[:, :3], x, atol=1e-5)
    # vis-viva: the velocities are those of the mass
    v2 = (states[:, 3:] ** 2).sum(axis=1)
    np.testing.assert_allclose(v2, GM * (2 / np.linalg.norm(x, axis=1) - 0.5), rtol=1e-4)


def test_smoothed_orbit_of_a_point_mass_has_the_errors_it_states():
    t, x = kepler()
    mass = PointMassOnly(GM).fit(x, x)

    def field(at):
        return mass.predict(at), mass.jacobian(at)

    shares = []
    for seed in range(4):
        draws = np.random.default_rng(seed).normal(size=(3, *x.shape))
        seen, y = x + 0.02 * draws[0], mass.predict(x + 0.02 * draws[1])
        samples = OrbitData(t, seen, y, 0.02, 0.0, GM)
        found = smooth_orbit(samples, field, first_guess(t, seen, GM), 2, np.zeros(9))
        shares.append(np.mean(((found.states[:, :3] - x) / found.position_sigmas) ** 2))
        assert abs(found.reduced_square - 1.0) < 5 * np.sqrt(2 / x.size)
        assert np.median(found.position_sigmas) < 0.5 * 0.02
    # six unknowns an orbit: a mean of 24 squares, six times its standard deviation
    assert abs(np.mean(shares) - 1.0) < 6 * np.sqrt(2 / 24)


def test_the_orbit_is_nearer_to_the_truth_than_the_samples(data, fit):
    away = np.linalg.norm(fit.positions - data.train.positions, axis=1)
    assert np.median(away) < 0.25 * SIGMA  # the samples are 1.5 sigma away
    # stated errors are right within a factor of three
    z = (fit.positions - data.train.positions) / fit.position_sigmas
    assert np.sqrt(np.mean(z**2)) < 3.0
    assert fit.settled
    assert fit.reason == ""
    assert abs(fit.reduced_square - 1.0) < 0.2
    assert len(fit.moved) == fit.rounds
    assert fit.moved[-1] < 0.5


def test_it_learns_the_field_better_than_from_samples_and_than_a_point_mass(data, fit):
    other = data.extrapolation

    def error(learner):
        return np.median(fractional_error(other.accelerations, learner.predict(other.positions)))

    train = data.train
    plain = HarmonicGP().fit(
        train.observed_positions, train.observed_accelerations, NoiseLevel(SIGMA)
    )
    assert error(fit.learner) < 0.5 * error(plain)
    assert error(fit.learner) < error(PointMassOnly().fit(train.positions, train.accelerations))


def test_same_data_same_numbers_in_any_order(data, fit):
    train = data.train
    order = np.random.default_rng(0).permutation(len(train))
    again = trajectory_consistent_fit(
        train.times[order] / data.units.time,
        train.observed_positions[order],
        train.observed_accelerations[order],
        HarmonicGP(),
        NoiseLevel(SIGMA),
    )
    assert np.array_equal(again.positions, fit.positions[order])
    assert np.array_equal(again.learner.coefficients_, fit.learner.coefficients_)


def test_what_does_not_settle_says_why(data):
    train = data.train
    # told a third of the noise, no orbit can agree with the positions
    fit = trajectory_consistent_fit(
        train.times / data.units.time,
        train.observed_positions,
        train.observed_accelerations,
        HarmonicGP(),
        NoiseLevel(SIGMA / 3),
        rounds=1,
    )
    assert not fit.settled
    assert fit.reduced_square == pytest.approx(9.0, rel=0.2)
    assert "misses the positions: squared residuals are 8." in fit.reason


def test_a_configuration_asks_for_it_and_the_report_says_so(data, fit):
    content = {
        "seed": 1,
        "noise": {"state": SIGMA},
        "learners": [{"kind": "harmonic_gp"}],
        "flight": {"periods": [0.1], "orbits": 1},
        "training": "trajectory_consistent",
    }
    config = CharacterizationConfig.resolve(content)
    whole = characterize(config)
    assert "an orbit fitted to the noisy positions" in data_sentences(whole)[-1]
    result = whole.learners[0]
    assert result.facts["orbit settled"] == "yes"
    assert result.facts["orbit rounds"] == fit.rounds
    assert result.training_check is None
    assert np.array_equal(result.learner.coefficients_, fit.learner.coefficients_)
    # it decides the numbers, so the hash knows it; the default is as it was before
    assert config.hash != CharacterizationConfig.resolve(content | {"training": "samples"}).hash
    assert CharacterizationConfig.resolve(config.as_dict()) == config
    with pytest.raises(ConfigError, match="training is trajectory_consistent in a sweep"):
        list(characterize_batch([config]))
    quiet = CharacterizationConfig.resolve(content | {"noise": {"state": 0.0}})
    with pytest.raises(ConfigError, match="there is nothing to smooth"):
        characterize(quiet)


def test_bad_input_is_refused(data):
    t, x = kepler()
    with pytest.raises(ConfigError, match=r"position noise is 0\.0: there is nothing to smooth"):
        trajectory_consistent_fit(t, x, x, HarmonicGP(), NoiseLevel())
    with pytest.raises(DataError, match="60 times, 59 positions and 60 accelerations"):
        trajectory_consistent_fit(t, x[1:], x, HarmonicGP(), NoiseLevel(0.1))
    with pytest.raises(DataError, match="two samples have the same time"):
        trajectory_consistent_fit(0 * t, x, x, HarmonicGP(), NoiseLevel(0.1))
    with pytest.raises(ConfigError, match="degree 1, rounds 3"):
        trajectory_consistent_fit(t, x, x, HarmonicGP(), NoiseLevel(0.1), degree=1)
    with pytest.raises(DataError, match="8 positions for an orbit"):
        trajectory_consistent_fit(t[:8], x[:8], x[:8], HarmonicGP(), NoiseLevel(0.1))


def test_no_orbit_is_an_error_and_no_quiet_fallback():
    t, _ = kepler()
    noise = np.random.default_rng(1).normal(size=(60, 3)) + np.array([3.0, 0.0, 0.0])
    with pytest.raises(NumericalError, match=r"no ellipse about the mass meets 60 samples"):
        trajectory_consistent_fit(t, noise, noise, HarmonicGP(), NoiseLevel(1e-3))
