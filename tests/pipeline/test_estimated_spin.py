"""Spin rates from the motion: found within their sigma, and not claimed where nothing turns."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import unmodeled as um
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.frames import body_fixed_from_inertial, rotation_about_x, turned
from unmodeled.core.seeds import Streams
from unmodeled.core.units import NORMALISED_GM, NormalisedUnits
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.learning_data import make_learning_data
from unmodeled.datasets.noise import Noise
from unmodeled.datasets.trajectory import Trajectory
from unmodeled.models.learned import HarmonicGP, NoiseLevel
from unmodeled.pipeline.characterize import evaluate
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.prepare import prepare
from unmodeled.pipeline.sweep.run_id import canonical, run_id
from unmodeled.reports.data_words import data_sentences

UNITS = NormalisedUnits.of_body(4.89, 290.0)
RATE = 4.1e-4
# Degrees above 6 are below the noise: what the learner cannot hold would bias the rate.
TWO = ((1.0, (0.0, 0.0, 0.0)), (0.15, (0.3, 0.0, 0.0)), (-0.15, (-0.3, 0.0, 0.0)))
ZONAL = ((0.8, (0.0, 0.0, 0.0)), (0.2, (0.0, 0.0, 0.4)))
NOISE = 0.05


def field(x, masses):
    total = np.zeros_like(x)
    for share, place in masses:
        d = x - np.array(place)
        total -= share * NORMALISED_GM * d / np.linalg.norm(d, axis=1)[:, None] ** 3
    return total


def orbit(masses, seed=1, noise=NOISE, tilt=0.0, inclination=0.9):
    """An ellipse with an advancing node: places where the field is seen, no solution of it."""
    u = np.linspace(0.0, 12 * np.pi, 150)
    r = 1.7 / (1.0 + 0.25 * np.cos(u))
    node = 0.1 * u
    x = np.stack(
        [
            r * (np.cos(node) * np.cos(u) - np.sin(node) * np.sin(u) * np.cos(inclination)),
            r * (np.sin(node) * np.cos(u) + np.cos(node) * np.sin(u) * np.cos(inclination)),
            r * np.sin(u) * np.sin(inclination),
        ],
        axis=1,
    )
    times = u / (2 * np.pi) * UNITS.time * 2.2
    turns = body_fixed_from_inertial(times, RATE)
    a = turned(turns.mT, field(turned(turns, x), masses))
    a = a + noise * np.random.default_rng(seed).normal(size=a.shape)
    back = rotation_about_x(tilt)
    x, a = x @ back, a @ back
    zeros = np.zeros_like(x)
    return Trajectory(times, x * UNITS.length, zeros + 1.0, a * UNITS.acceleration, source="made")


def estimate(trajectory, bracket=(0.99 * RATE, 1.01 * RATE), noise=NOISE, **others):
    level = NoiseLevel(acceleration=noise * UNITS.acceleration)
    degree6 = HarmonicGP(degree=6, least_degree=6)
    settings = {"rate_bracket": bracket, "gm": 4.89, "radius": 290.0, "noise": level}
    return um.estimate_spin(trajectory, degree6, **settings | others)


def test_the_rate_comes_back_within_its_sigma_and_the_field_is_as_good():
    path = orbit(TWO)
    found = estimate(path)
    assert found.observable
    # three sigma; sigma itself against the spread of other draws of the noise is checked below
    assert abs(found.rate - RATE) < 3.0 * found.sigma
    assert found.sigma < 1e-3 * RATE
    assert "+-" in str(found)
    errors = []
    for rate in (RATE, found.rate):
        turns = body_fixed_from_inertial(path.times, rate)
        x, y = (turned(turns, v) for v in (path.positions, path.accelerations))
        learner = HarmonicGP(degree=6).fit(x / UNITS.length, y / UNITS.acceleration)
        other = orbit(TWO, noise=0.0, inclination=1.6)
        turns = body_fixed_from_inertial(other.times, rate)
        at, a = (turned(turns, v) for v in (other.positions, other.accelerations))
        off = learner.predict(at / UNITS.length) - a / UNITS.acceleration
        errors.append(np.median(np.linalg.norm(off, axis=1)))
    assert errors[1] < 2.0 * errors[0]


@pytest.mark.slow
def test_sigma_is_the_spread_over_draws_of_the_noise():
    found = [estimate(orbit(TWO, seed)) for seed in range(1, 9)]
    scores = [(f.rate - RATE) / f.sigma for f in found]
    # Sum of squares of eight: chi-squared, 99.9 % between these.
    assert 0.7 < np.sum(np.square(scores)) < 27.0


def test_a_field_about_the_axis_has_no_rate():
    for noise in (0.0, NOISE):
        found = estimate(orbit(ZONAL, noise=noise), noise=noise)
        assert not found.observable
        assert np.isnan(found.rate)
        assert "not observable: " in str(found)
    assert "zonal about the pole" in found.reason


def test_the_pole_is_that_given():
    plain = estimate(orbit(TWO), (0.99 * RATE, 1.01 * RATE))
    tilt = 0.4
    pole = rotation_about_x(tilt).T @ np.array([0.0, 0.0, 1.0])
    tilted = estimate(orbit(TWO, tilt=tilt), (0.99 * RATE, 1.01 * RATE), pole=pole)
    assert tilted.rate == pytest.approx(plain.rate, abs=0.1 * plain.sigma)


def test_a_rate_outside_the_bracket_is_not_made_up():
    found = estimate(orbit(TWO), (1.002 * RATE, 1.02 * RATE))
    assert not found.observable
    assert "the end of the bracket; widen it" in found.reason


def test_bad_input_is_refused():
    path = orbit(TWO)
    with pytest.raises(ConfigError, match=r"\(lowest, highest\)"):
        estimate(path, (RATE, RATE))
    with pytest.raises(ConfigError, match="Narrow it to"):
        estimate(path, (0.0, 1.0))
    with pytest.raises(ConfigError, match="a direction"):
        estimate(path, pole=(0.0, 0.0, 0.0))
    bare = Trajectory(path.times, path.positions, path.velocities)
    with pytest.raises(DataError, match="accelerations missing"):
        estimate(bare)


MASSES = [{"share": 0.1, "place": [0.4, 0, 0]}, {"share": -0.1, "place": [-0.4, 0, 0]}]


def config(masses=MASSES, **data):
    orbits = {
        "orbit": {"semi_major_axis": 1.8, "eccentricity": 0.2, "inclination": 60.0},
        "other_orbits": [{"semi_major_axis": 1.9, "eccentricity": 0.1, "inclination": 110.0}],
        "train_periods": 6,
        "extrapolation_periods": 2,
        "field": {"kind": "mascons", "masses": masses},
    }
    return CharacterizationConfig.resolve(
        {
            "body": "eros",
            "data": orbits | data,
            "noise": {"acceleration": 0.05},
            "learners": [{"kind": "harmonic_gp", "degree": 6}],
            "flight": {"periods": [1], "orbits": 1},
        }
    )


def test_a_configuration_learns_in_axes_that_turn_with_the_estimate():
    errors, made = {}, {}
    for spin in ("known", "estimate"):
        chosen = config(spin=spin)
        made[spin] = prepare(chosen)
        found = evaluate(chosen.learners[0], made[spin], chosen, flights=False)
        errors[spin] = found.summaries["extrapolation"].median
    data, true = made["estimate"], load_body("eros").spin_rate
    print(errors, data.facts["axes of the samples"])
    assert errors["estimate"] < 2.0 * errors["known"]
    assert data.learned_spin_rate != data.spin_rate == true
    assert data.learned_spin_rate == pytest.approx(true, rel=1e-3)
    assert abs(data.facts["estimated - true spin rate, sigma"]) < 3.0
    words = " ".join(data_sentences(SimpleNamespace(data=data, config=chosen)))
    assert "the spin estimated from the noisy training samples" in words


def test_state_noise_follows_the_true_field_under_estimated_axes():
    made = prepare(config()).orbits
    noise = Noise(0.05, 0.0, "consistent")
    true = load_body("eros").spin_rate
    x = made[0].positions / 17700.0

    def field(points):
        return points * np.array([1.0, 2.0, 3.0])  # any field that is not round

    orbit = replace(made[0], positions=x, accelerations=x)
    data = make_learning_data(
        [orbit, orbit], [1.0, 1.0], NormalisedUnits(1.0, 1.0), noise, Streams(1),
        true_field=field, spin_rate=true, frame="body_fixed", axes_rate=1.1 * true,
    )  # fmt: skip
    s = data.train
    to_body = body_fixed_from_inertial(s.times, true)
    to_axes = body_fixed_from_inertial(s.times, 1.1 * true)
    inertial = turned(to_axes.mT, s.observed_positions)
    expected = turned(to_axes @ to_body.mT, field(turned(to_body, inertial)))
    assert s.observed_accelerations == pytest.approx(expected, rel=1e-9)


def test_a_spin_that_cannot_be_had_is_refused():
    along = [{"share": 0.1, "place": [0, 0, 0.4]}]
    with pytest.raises(DataError, match=r"not observable.*Change the data, or write data.spin"):
        prepare(config(along, spin="estimate"))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"spin": "estimate", "field": None}, "without a field that turns"),
        ({"spin_bracket": [1e-4, 2e-4]}, "spin_bracket with a known spin"),
        ({"spin": "estimated"}, "'known' or 'estimate'"),
    ],
)
def test_what_does_not_belong_together_is_refused(data, words):
    with pytest.raises(ConfigError, match=words):
        config(**data)


def test_ids_of_known_spins_stay_and_estimates_have_their_own():
    forms = [canonical(config()), canonical(config(spin="estimate"))]
    assert "spin" not in forms[0]["data"]
    assert run_id(forms[0]) != run_id(forms[1])
