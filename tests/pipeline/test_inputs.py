"""Inputs beyond the position, from the configuration to flights and saved fields."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.frames import body_fixed_from_inertial, turned
from unmodeled.datasets.bodies import load_body
from unmodeled.models.physics.solar_radiation_pressure import SolarRadiationPressure
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.filters.flight_form import FlightForm
from unmodeled.pipeline.learned_field import LearnedField
from unmodeled.pipeline.prepare import prepare
from unmodeled.pipeline.sweep.run_id import canonical, run_id
from unmodeled.pipeline.sweep.sweep import sweep

DRAG = {"effect": "velocity_drag", "friction_a": "3e-9 m/s2", "friction_v0": "0.07 m/s"}
SRP = {"effect": "srp", "shadow": False}
CRAFT = {"mass": "1500 kg", "area": "3 m2"}
EPOCH = "2019-02-16T00:00:00 TDB"
POINT = {"kind": "mascons", "masses": [{"share": 1, "place": [0, 0, 0]}]}
RANGES = {"semi_major_axis": [2.5, 4.0], "eccentricity": [0.02, 0.3]}
GP = {"kind": "exact_gp", "optimizer": "newton"}


def config(*learners, training="samples", noise=None, **data):
    content = {"data": data, "learners": list(learners or [GP]), "training": training}
    content |= {"flight": {"periods": [1], "orbits": 1}, "noise": noise or {}}
    return CharacterizationConfig.resolve(content)


def small(*learners, frame="inertial", noise=None, **data):
    few = {"train_periods": 3, "extrapolation_periods": 2, "samples_per_period": 10}
    few |= {"training_orbits": 6, "ranges": RANGES, "field": POINT | {"frame": frame}}
    return config(*learners, noise=noise, **few | {"effects": [DRAG]} | data)


@pytest.mark.parametrize("frame", ["inertial", "body_fixed"])
def test_the_velocity_makes_drag_learnable_and_flyable(frame):
    result = characterize(small(GP, GP | {"inputs": ["position", "velocity"]}, frame=frame))
    alone, aware = result.learners
    assert aware.label == "exact gp with velocity on point mass"
    assert aware.summaries["extrapolation"].median < 1e-3 * alone.summaries["extrapolation"].median
    assert aware.use.advice == "passes"
    assert aware.training_check.held_out == "each of 5 orbits of 6"
    flown = [r.flights[1].flight.position_error[-1] for r in (alone, aware)]
    assert flown[1] < 1e-3 * flown[0]
    assert result.flight_floor < 1e-6  # m: the true force was flown, friction and all


def test_what_learners_see_of_samples():
    data = prepare(small(frame="body_fixed", epoch=EPOCH, effects=[DRAG]))
    other, orbit = data.extrapolation, data.orbits[1]
    turns = body_fixed_from_inertial(orbit.times, load_body("bennu").spin_rate)
    v = turned(turns, orbit.velocities) / data.units.velocity
    assert other.velocities == pytest.approx(v, abs=1e-12)
    towards = turned(turns, data.sun(orbit.times))
    assert other.sun_directions == pytest.approx(towards, abs=1e-12)
    assert np.array_equal(other.observed_velocities, other.velocities)
    assert set(data.train.orbit) == {0, 2, 3, 4, 5, 6}
    assert set(other.orbit) == {1}


def test_further_training_orbits_change_neither_the_first_nor_the_others():
    one, six = prepare(small(training_orbits=1)), prepare(small())
    for k in (0, 1):
        assert np.array_equal(one.orbits[k].positions, six.orbits[k].positions)
    assert np.array_equal(one.extrapolation.accelerations, six.extrapolation.accelerations)
    assert len(six.train) + len(six.interpolation) == 6 * 30


def test_sunlight_pushes_away_from_the_sun():
    """The simulated push against the formula at the distance of JPL Horizons' Bennu."""
    bare = prepare(small(effects=[DRAG], training_orbits=1))
    lit = prepare(small(effects=[DRAG, SRP], epoch=EPOCH, spacecraft=CRAFT, training_orbits=1))
    orbit = lit.orbits[1]
    states = np.hstack([orbit.positions, orbit.velocities])
    push = lit.true_force(states, orbit.times) - bare.true_force(states, orbit.times)
    size = np.linalg.norm(push, axis=1)
    assert push / size[:, None] == pytest.approx(-lit.sun(orbit.times), abs=1e-6)
    # Cr A / m = 0.0026 m2/kg; Bennu was 0.96 au from the Sun in the middle of February 2019.
    assert size[0] == pytest.approx(4.56e-6 * 0.0026 / 0.96**2, rel=0.07)
    assert SolarRadiationPressure(shadow=False).bodies == ("sun",)


def test_noise_of_the_velocity_and_of_the_state():
    noise = {"velocity": 1e-3, "state": 0.01, "draws": "consistent"}
    data = prepare(small(noise=noise))
    s = data.train
    assert (s.observed_velocities - s.velocities).std() == pytest.approx(1e-3, rel=0.1)
    # Consistent draws: what was observed lies on the true force, here with its friction.
    states = np.hstack(
        [s.observed_positions * data.units.length, s.velocities * data.units.velocity]
    )
    a = data.true_force(states, s.times) / data.units.acceleration
    assert s.observed_accelerations == pytest.approx(a, rel=1e-9)
    si = config(noise={"velocity": 1e-3, "unit": "si"}).noise.resolve(data.units)
    assert si.velocity == pytest.approx(1e-3 / data.units.velocity)


def test_a_saved_field_knows_its_inputs(tmp_path):
    inputs = ["position", "velocity", "phase"]
    elm = {"kind": "elm", "inputs": inputs, "phase_period": 15469.0}
    result = characterize(small(elm, training_orbits=2))
    result.save(tmp_path)
    field = LearnedField.load(
        tmp_path / "models" / "elm-with-velocity-and-phase-on-point-mass.safetensors"
    )
    assert field.features.names == tuple(inputs)
    s, units = result.data.extrapolation, result.data.units
    x, v = s.positions * units.length, s.velocities * units.velocity
    a = field.acceleration(x, v, s.times)
    predicted = result.learners[0].predictions["extrapolation"] * units.acceleration
    assert a == pytest.approx(predicted, rel=1e-12)
    later = field.acceleration(x, v, s.times + 15469.0)
    assert later == pytest.approx(a, rel=1e-9)
    with pytest.raises(DataError, match=r"input velocity without velocities\. Give velocities too"):
        field.acceleration(x)
    text = "of a field learned from position, velocity, phase. Allowed: fields of the position"
    with pytest.raises(DataError, match=f"jacobian {text}"):
        field.jacobian(x)
    with pytest.raises(DataError, match=f"the flight form {text}"):
        FlightForm.of(field)


def test_a_sweep_over_inputs(tmp_path):
    base = small().as_dict()
    del base["learners"]
    grid = {
        "name": "inputs",
        "base": base,
        "axes": {
            "learner": [{"kind": "rbf_network", "centres": 20}],
            "learner.inputs": [["position"], ["position", "velocity"]],
        },
        "initial_conditions": {"count": 2, "seed": 1},
    }
    table = sweep(grid, tmp_path / "store")
    assert list(table["learner.inputs"]) == ['["position"]'] * 2 + ['["position", "velocity"]'] * 2
    alone, aware = table["extrapolation_median"][:2], table["extrapolation_median"][2:]
    assert np.all(aware.to_numpy() < 0.5 * alone.to_numpy())


def test_older_configurations_keep_their_hash_and_id():
    plain = CharacterizationConfig.resolve({"learners": [{"kind": "rbf_network", "centres": 20}]})
    assert plain.hash.startswith(PLAIN_HASH)
    assert run_id(canonical(plain)) == PLAIN_ID
    default = plain.as_dict()
    default["learners"][0] |= {"inputs": ["position"], "phase_period": None}
    default["data"] |= {"training_orbits": 1, "effects": None, "epoch": None}
    default["noise"]["velocity"] = 0
    assert CharacterizationConfig.resolve(default).hash == plain.hash


PLAIN_HASH = "257c106cd0b928f0"
PLAIN_ID = "61054d789d7b01905bd928cf5ef64ee8"


def test_ids_follow_the_meaning_of_effects():
    first = run_id(canonical(small()))
    same = {"power": 1} | DRAG | {"friction_a": "0.3e-8 m s-2"}
    assert run_id(canonical(small(effects=[same]))) == first
    others = [
        small(effects=[DRAG | {"friction_a": "4e-9 m/s2"}]),
        small(effects=[DRAG | {"power": 2}]),
        small(effects=[DRAG, SRP], epoch=EPOCH, spacecraft=CRAFT),
        small(training_orbits=5),
        small(GP | {"inputs": ["position", "velocity"]}),
        small(noise={"velocity": 0.1}),
    ]
    ids = {run_id(canonical(c)) for c in others} | {first}
    assert len(ids) == len(others) + 1


@pytest.mark.parametrize(
    ("learner", "text"),
    [
        (
            GP | {"inputs": ["position", "velocty"]},
            r'learner "exact_gp": unknown input "velocty"\. Did you mean "velocity"',
        ),
        (GP | {"inputs": ["velocity"]}, "the inputs are velocity. Allowed: position first"),
        (GP | {"inputs": "velocity"}, r"is 'velocity'\. Allowed: a list, e\.g\. \[position"),
        (GP | {"inputs": ["position", "phase"]}, "input phase with a period of None"),
        (GP | {"phase_period": 10.0}, "a period of 10.0 without the input phase"),
        (GP | {"inputs": ["position", "phase"], "phase_period": "day"}, "phase_period .* seconds"),
        (
            {"kind": "harmonic_gp", "inputs": ["position", "velocity"]},
            r'learner "harmonic_gp" with inputs position, velocity\. Allowed: position: it learns '
            r"from that alone\. Use one of elm, exact_gp, mlp",
        ),
        (GP | {"input": ["position", "velocity"]}, 'unknown key "input", did you mean "inputs"'),
        ({"kind": "potential_mlp", "inputs": ["position", "velocity"]}, "inputs is .*'direction'"),
    ],
)
def test_wrong_inputs(learner, text):
    with pytest.raises(ConfigError, match=text):
        small(learner)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ({"effects": [{"effect": "velocity_drg"}]}, 'unknown effect "velocity_drg"'),
        ({"effects": [DRAG | {"friction_a": "3e-9 m"}]}, "data.effects.0: friction_a"),
        ({"effects": [DRAG | {"frction_v0": 1}]}, 'unknown key "frction_v0"'),
        ({"effects": [{"effect": "velocity_drag"}]}, "velocity_drag needs friction_v0"),
        ({"effects": [SRP], "spacecraft": CRAFT}, "needs the place of sun and data.epoch"),
        ({"effects": [SRP], "epoch": EPOCH}, "srp_CrA_m.* Give data.spacecraft"),
        ({"effects": [DRAG | {"free": ["friction_a"]}]}, "holds the free parameter friction_a"),
        ({"effects": [{"effect": "range_bias"}]}, "holds range_bias, an effect of instruments"),
        ({"effects": [{"effect": "rotation", "spin_rate": "1 rad/s"}]}, "holds no force"),
        ({"effects": [{"effect": "point_mass"}]}, "twice .point_mass, point_mass"),
        ({"effects": []}, "data.effects"),
        ({"effects": [DRAG], "integrator": "rk4"}, "data.effects with integrator rk4"),
        ({"epoch": "2019-02-16"}, "scale"),
        ({"spacecraft": {"mass": "1 m", "area": "1 m2"}, "effects": [DRAG]}, "spacecraft.mass"),
    ],
)
def test_wrong_effects(data, text):
    with pytest.raises((ConfigError, DataError), match=text):
        prepare(config(GP, **data))


def test_the_sun_needs_an_epoch():
    sunny = GP | {"inputs": ["position", "sun_cosine"]}
    with pytest.raises(ConfigError, match=r"input sun_cosine and data\.epoch is not given"):
        prepare(small(sunny))
    data = prepare(small(sunny, epoch=EPOCH))
    assert data.train.sun_directions is not None


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"effects": [DRAG]}, "data.effects with trajectory orbit.csv. Allowed: simulated orbits"),
        ({"training_orbits": 2}, "data.training_orbits is 2 with trajectory orbit.csv"),
    ],
)
def test_measured_orbits_have_their_own_forces(changes, text):
    with pytest.raises(ConfigError, match=text):
        config(GP, trajectory="orbit.csv", **changes)


def test_an_orbit_fit_takes_positions_of_one_orbit():
    aware = GP | {"inputs": ["position", "velocity"]}
    with pytest.raises(
        ConfigError, match=r"training is trajectory_consistent and .* has the inputs"
    ):
        config(aware, training="trajectory_consistent")
    with pytest.raises(
        ConfigError, match=r"data.training_orbits is 2\. Allowed: one training orbit"
    ):
        config(GP, training="trajectory_consistent", training_orbits=2)
    noise = {"state": 0.1, "draws": "consistent"}
    text = r"noise\.draws is consistent\. Allowed: independent: the accelerations are read"
    with pytest.raises(ConfigError, match=text):
        config(GP, training="trajectory_consistent", noise=noise)
