import dataclasses
import math

import numpy as np
import pandas as pd
import pytest

from unmodeled.core.errors import ConfigError, DataError, OrbitError
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import ELEMENT_NAMES
from unmodeled.datasets.initial_conditions import states_of
from unmodeled.datasets.noise import Noise
from unmodeled.datasets.simulation import gravity_of, simulate_orbits
from unmodeled.datasets.tabular import write_csv
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.prepare import prepare, simulate

BODY = load_body("bennu")
R = BODY.brillouin_radius
UNITS = NormalisedUnits.of_body(BODY.gm, R)
ORBIT = {"semi_major_axis": 1.9, "eccentricity": 0.3, "inclination": 60.0}


def config(**changes):
    return CharacterizationConfig.resolve(
        {"seed": 5, "learners": [{"kind": "point_mass"}]} | changes
    )


def trajectory(periods=13.0, axis=1.9, **options):
    table = pd.DataFrame([[axis, 0.3, 60, 0, 0, 0]], columns=list(ELEMENT_NAMES))
    states = states_of(table, BODY.gm, R)
    return simulate_orbits(gravity_of(BODY), table, states, R, periods=[periods], **options).orbits[
        0
    ]


@pytest.fixture
def folder(tmp_path):
    write_csv(trajectory(), tmp_path / "a.csv")
    write_csv(trajectory(5.0, axis=2.4), tmp_path / "b.csv")
    return tmp_path


def test_the_papers_sizes():
    data = prepare(config())
    assert [len(s) for s in data.sets] == [237, 13, 75]
    assert data.units == UNITS
    assert data.noise == Noise()
    assert len(data.orbits) == len(data.periods) == 2
    for s in data.sets:
        assert (np.linalg.norm(s.positions, axis=1) > 1.0).all()


def test_same_configuration_same_data():
    a, b = (prepare(config(noise={"state": 0.05, "acceleration": 0.1})) for _ in range(2))
    for s, t in zip(a.sets, b.sets, strict=True):
        for f in dataclasses.fields(s):
            assert np.array_equal(getattr(s, f.name), getattr(t, f.name))
    other = prepare(config(seed=6))
    assert not np.array_equal(a.train.positions, other.train.positions)


def test_more_extrapolation_orbits_and_noise_change_nothing_else():
    few = prepare(config())
    many = prepare(config(data={"extrapolation_orbits": 3}, noise={"acceleration": 0.1}))
    assert np.array_equal(few.train.positions, many.train.positions)
    assert np.array_equal(few.extrapolation.positions, many.extrapolation.positions[:75])
    assert len(many.extrapolation) == 225
    assert set(many.extrapolation.orbit) == {1, 2, 3}


def test_noise_in_si_and_normalised_agree():
    a = prepare(config(noise={"state": 0.1, "acceleration": 0.2}))
    si = {"state": 29.0, "acceleration": 0.2 * UNITS.acceleration, "unit": "si"}
    b = prepare(config(noise=si))
    np.testing.assert_allclose(
        a.train.observed_accelerations, b.train.observed_accelerations, rtol=1e-12
    )


def test_own_orbit():
    data = prepare(config(data={"orbit": ORBIT}))
    start = states_of(pd.DataFrame([[1.9, 0.3, 60, 0, 0, 0]], columns=list(ELEMENT_NAMES)), 4.89, R)
    assert np.array_equal(data.orbits[0].states[0], start[0])
    # the extrapolation orbit is the first of the drawn list
    drawn = prepare(config()).orbits[0]
    assert np.array_equal(data.orbits[1].states[0], drawn.states[0])


def test_colliding_orbit():
    with pytest.raises(OrbitError) as caught:
        prepare(config(data={"orbit": ORBIT | {"eccentricity": 0.6, "true_anomaly": 180}}))
    text = str(caught.value)
    assert text.startswith(
        "orbit 0 (a = 1.9 Brillouin radii, e = 0.6) hits the body: it enters the Brillouin sphere "
        "of 290 m after 0."
    )
    assert text.endswith(" periods. Raise its semi-major axis or lower its eccentricity.")


def test_ranges_are_respected():
    ranges = {"semi_major_axis": [2.0, 2.1], "eccentricity": [0.1, 0.11], "inclination": [80, 90]}
    _, _, facts = simulate(config(data={"ranges": ranges, "extrapolation_orbits": 4}))
    assert len(facts["elements"]) == 5
    for row in facts["elements"]:
        for name, (low, high) in ranges.items():
            assert low <= row[name] <= high


def test_facts_of_a_simulation():
    _, orbits, facts = simulate(config(data={"train_periods": 2}))
    assert facts["truth"] == "point mass + zonal"
    assert facts["integrator"] == "heyoka"
    assert facts["initial conditions drawn to find the collision-free ones"] % 16 == 0
    assert facts["largest RK4 - heyoka distance (200 steps a period), m"] == pytest.approx(
        orbits.rk4_difference.max()
    )


@pytest.mark.parametrize("integrator", ["heyoka", "rk4"])
def test_accelerations_are_those_of_the_field(integrator):
    data = prepare(config(data={"integrator": integrator, "train_periods": 2}))
    field = gravity_of(BODY)
    a = field.acceleration(data.train.positions * R) / UNITS.acceleration
    # positions are divided by and multiplied with the radius: rounding
    np.testing.assert_allclose(data.train.accelerations, a, rtol=0, atol=1e-13 * np.abs(a).max())


def test_unknown_body():
    with pytest.raises(ConfigError, match=r'no body "benu".*Did you mean "bennu"\?$'):
        prepare(config(body="benu"))


def test_too_few_samples():
    with pytest.raises(ConfigError) as caught:
        prepare(config(data={"train_periods": 0.1}))
    assert str(caught.value) == (
        "0.1 periods with 25 samples each give 2 samples. Allowed: at least 4. "
        "Use more periods or a higher data.samples_per_period."
    )


# Files ---------------------------------------------------------------------------------------


def test_a_file_replaces_the_simulation_with_one_line(folder):
    simulated = prepare(config(data={"orbit": ORBIT, "volume": "low"}))
    measured = prepare(
        config(data={"orbit": ORBIT, "volume": "low", "trajectory": "a.csv"}), [folder]
    )
    # A file's period is that of its median energy, a simulated one's that of its start: with
    # Bennu's J2 they differ by some 3 J2 / 2 = 3 %.
    assert measured.periods[0] == pytest.approx(simulated.periods[0], rel=0.03)
    for s, t in zip(measured.sets, simulated.sets, strict=True):
        assert len(s) == pytest.approx(len(t), rel=0.03)
    # the same orbit, sample by sample
    whole, part = simulated.orbits[0], measured.orbits[0]
    assert np.array_equal(part.times, whole.times[: len(part)])
    assert np.array_equal(part.positions, whole.positions[: len(part)])
    assert np.array_equal(part.accelerations, whole.accelerations[: len(part)])
    assert measured.facts["extrapolation"] == "later revolutions of the same orbit"
    assert measured.extrapolation.times.min() > measured.train.times.max()


def test_a_whole_file_is_split_70_to_30(folder):
    data = prepare(config(data={"trajectory": "a.csv"}), [folder])
    n = [len(s) for s in data.sets]
    assert sum(n) == 325
    assert (n[0] + n[1]) / 325 == pytest.approx(0.7, abs=2 / 325)
    assert data.periods[0] == data.periods[1] == pytest.approx(36749.6, rel=0.03)


def test_thinning(folder):
    data = prepare(
        config(data={"trajectory": "a.csv", "volume": "low", "samples_per_period": 5}), [folder]
    )
    train = np.sort(np.concatenate([data.train.times, data.interpolation.times]))
    # the osculating period is not the Kepler period of the start: every 5th sample still
    assert len(train) == pytest.approx(50, abs=1)
    assert np.ptp(np.diff(train)) < 1e-6 * np.diff(train).mean()


def test_extrapolation_file(folder):
    data = prepare(
        config(data={"trajectory": "a.csv", "extrapolation_trajectory": "b.csv"}), [folder]
    )
    assert len(data.train) + len(data.interpolation) == 325
    assert len(data.extrapolation) == 125
    assert data.orbits[1].radii.max() > data.orbits[0].radii.max()
    assert data.periods[1] > data.periods[0]
    data = prepare(
        config(
            data={
                "trajectory": "a.csv",
                "extrapolation_trajectory": "b.csv",
                "train_periods": 4,
                "extrapolation_periods": 2,
            }
        ),
        [folder],
    )
    assert len(data.train) + len(data.interpolation) == pytest.approx(100, abs=2)
    assert len(data.extrapolation) == pytest.approx(50, abs=2)


def test_where_files_are_looked_for(folder, tmp_path, monkeypatch):
    first, second = tmp_path / "1", tmp_path / "2"
    first.mkdir()
    second.mkdir()
    write_csv(trajectory(6.0), second / "a.csv")

    def length(name, folders):
        data = prepare(config(data={"trajectory": str(name)}), folders)
        return sum(len(s) for s in data.sets)

    assert length("a.csv", [first, second, folder]) == 150
    assert length("a.csv", [folder, second]) == 325
    assert length(second / "a.csv", [folder]) == 150
    monkeypatch.chdir(folder)
    assert length("a.csv", []) == 325
    with pytest.raises(ConfigError) as caught:
        prepare(config(data={"trajectory": "c.csv"}), [first])
    assert str(caught.value) == (
        f"no trajectory file c.csv. Looked in {first}, .; give the folder with --data, "
        "or write data.trajectory: simulated."
    )


def test_noise_on_a_file(folder):
    data = prepare(config(data={"trajectory": "a.csv"}, noise={"acceleration": 0.1}), [folder])
    shift = data.train.observed_accelerations - data.train.accelerations
    n = shift.size
    assert abs(shift.std() / 0.1 - 1) < 6 / math.sqrt(2 * n)
    with pytest.raises(ConfigError, match=r"noise\.state is 0\.1 for a measured trajectory"):
        prepare(config(data={"trajectory": "a.csv"}, noise={"state": 0.1}), [folder])


def test_file_of_another_body_or_unit(folder):
    with pytest.raises(DataError) as caught:
        prepare(config(body="eros", data={"trajectory": "a.csv"}), [folder])
    text = str(caught.value)
    assert " m from the centre of (433) Eros, below its Brillouin sphere (" in text
    assert text.endswith(
        "Allowed: positions outside the Brillouin sphere. "
        "Check the body and the unit of the positions."
    )


def test_file_in_body_axes(folder):
    t = dataclasses.replace(trajectory(), frame="body_fixed")
    write_csv(t, folder / "c.csv")
    with pytest.raises(DataError, match="is given in body_fixed axes"):
        prepare(config(data={"trajectory": "c.csv"}), [folder])


def test_file_too_short(folder):
    with pytest.raises(DataError, match=r"covers .* periods of .* 10\.00 for training and 3.00"):
        prepare(config(data={"trajectory": "b.csv", "volume": "low"}), [folder])


def test_option_that_the_file_type_lacks(folder):
    with pytest.raises(ConfigError, match=r'files of type \.csv have no option "satellite"'):
        prepare(config(data={"trajectory": "a.csv", "satellite": "L52"}), [folder])
