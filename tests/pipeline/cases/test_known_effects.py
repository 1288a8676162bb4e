"""Entries of the known model: values from the card, the craft, the file; what is refused."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.bodies import load_body
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.cases.accepted_values import Surveyed
from unmodeled.pipeline.cases.known_effects import effect_names, entry_of, read_known
from unmodeled.pipeline.cases.spacecraft import Spacecraft

BENNU = Surveyed(load_body("bennu"), Spacecraft(1500.0, 12.0, 1.25, 2.0))
EARTH = Surveyed(load_body("earth"))


def test_values_come_from_card_and_craft_unless_given():
    known = read_known(
        [
            {"effect": "point_mass", "GM": "5.2 m3/s2", "free": {"GM": "0.01 m3/s2"}},
            {"effect": "zonal", "degrees": [2, 3], "values": {"J3": -0.001}, "free": ["J2"]},
            {"effect": "srp"},
            {"effect": "third_body", "body": "sun"},
        ],
        BENNU,
    )
    v = known.values
    assert (v["GM"], v["J2"], v["J3"], v["R_ref"]) == (5.2, 0.0193, -0.001, 290.0)
    assert v["srp_CrA_m"] == pytest.approx(1.25 * 12 / 1500)
    assert v["shadow_radius"] == 290.0
    assert v["GM_sun"] == pytest.approx(1.32712440e20, rel=1e-8)
    assert known.estimate == {"GM": 0.01, "J2": None}


def test_the_field_of_the_earth_is_egm2008():
    known = read_known(
        [{"effect": "point_mass"}, {"effect": "spherical_harmonics", "degree": 3}], EARTH
    )
    # Coefficients as published, tide-free [Pavlis2012].
    assert known.values["C_2_0"] == pytest.approx(-0.484165143790815e-03, rel=1e-12)
    assert known.values["C_2_2"] == pytest.approx(0.243938357328313e-05, rel=1e-12)
    assert known.values["S_3_1"] == pytest.approx(0.248200415856872e-06, rel=1e-12)


def test_zonals_of_a_card_as_spherical_harmonics_are_the_same_field():
    point = {"effect": "point_mass"}
    one = read_known([point, {"effect": "zonal", "degrees": [2, 3, 4]}], BENNU)
    two = read_known(
        [point, {"effect": "spherical_harmonics", "degree": 4, "order": 0, "min_degree": 2}], BENNU
    )
    places = np.random.default_rng(0).normal(size=(5, 3)) * 600.0
    a, b = (Dynamics(k.effects, k.values).acceleration(places) for k in (one, two))
    np.testing.assert_allclose(a, b, rtol=1e-12)


FIELD = """modelname toy
earth_gravity_constant 4.9E+00
radius 250.0
max_degree 2
norm fully_normalized
key n m C S sigma sigma
end_of_head =======
gfc 0 0 1.0D+00 0.0
gfc 2 0 -8.0e-03 0.0
gfc 2 1 1.0e-04 -2.0e-04
gfc 2 2 3.0e-03 4.0e-03
"""


def test_a_field_from_a_file(tmp_path):
    (tmp_path / "toy.gfc").write_text(FIELD)
    entry = {"effect": "spherical_harmonics", "degree": 2, "file": "toy.gfc"}
    known = read_known([{"effect": "point_mass"}, entry], BENNU, tmp_path)
    v = known.values
    assert (v["GM"], v["R_ref"]) == (4.9, 250.0)
    assert (v["C_2_0"], v["C_2_1"], v["S_2_1"], v["S_2_2"]) == (-8e-3, 1e-4, -2e-4, 4e-3)
    with pytest.raises(ConfigError, match=r"toy\.gfc has no C_3_0"):
        read_known([{**entry, "degree": 3}], BENNU, tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FIELD.replace("fully_normalized", "unnormalized"), "norm is unnormalized"),
        (FIELD.replace("gfc 2 0", "gfct 2 0"), "line 9: coefficients that depend on time"),
        (FIELD + "gfc 3 0 1.0", "line 12 is not a coefficient"),
        (FIELD.split("gfc ")[0], "has no coefficients"),
        (FIELD.replace("radius 250.0\n", ""), "radius is None"),
    ],
)
def test_a_damaged_field_is_refused(tmp_path, text, message):
    (tmp_path / "toy.gfc").write_text(text)
    entry = {"effect": "spherical_harmonics", "degree": 2, "file": "toy.gfc"}
    with pytest.raises(DataError, match=message):
        read_known([entry], BENNU, tmp_path)


def test_drag_of_an_altitude_takes_that_layer():
    entry = {"effect": "drag", "altitude": "550 km", "drag_B": "0.02 m2/kg"}
    v = read_known([{"effect": "point_mass"}, entry], EARTH).values
    layer = load_body("earth").atmosphere.layer(550e3)
    assert (v["drag_rho0"], v["drag_H"]) == (layer.density, layer.scale_height)
    assert v["drag_r0"] == EARTH.body.reference_radius + layer.altitude
    assert v["drag_omega"] == EARTH.body.spin_rate
    with pytest.raises(ConfigError, match="the card of bennu has no atmosphere"):
        read_known([entry], BENNU)


@pytest.mark.parametrize(
    ("entries", "text"),
    [
        ([{"effect": "zonl"}], 'unknown effect "zonl"'),
        ([{"efect": "zonal"}], "known.0 does not say which effect"),
        ([{"effect": "third_body"}], r"known.0 \(third_body\) lacks body"),
        ([{"effect": "zonal", "degree": 2}], 'unknown key "degree". Did you mean "degrees"'),
        ([{"effect": "zonal", "values": {"J9": 1}}], 'unknown key "J9"'),
        ([{"effect": "zonal", "degrees": [9]}], "zonal needs J9"),
        ([{"effect": "zonal", "degrees": [1]}], r"zonal degrees are \(1,\)"),
        ([{"effect": "zonal", "J2": 0.1, "values": {"J2": 0.1}}], "gives J2 twice"),
        ([{"effect": "zonal", "J2": "0.1 m"}], "J2 is 0.1 m. Allowed: a number without unit"),
        ([{"effect": "zonal", "free": {"J2": "1 m"}}], "prior of J2 is 1 m"),
        ([{"effect": "zonal", "free": "J2"}], "values and free are tables"),
        ([{"effect": "drag"}], "exponential_drag needs drag_rho0"),
        ([{"effect": "mascon"}], "mascon needs mascon1_x"),
        ([{"effect": "third_body", "body": "nemesis"}], "third_body needs GM_nemesis"),
        ([{"effect": "time_tag"}, {"effect": "time_tag"}], '"time_tag" is known twice'),
        (
            [{"effect": "point_mass", "GM": "1 m3/s2"}, {"effect": "zonal", "GM": "2 m3/s2"}],
            "known.1 gives GM = 2.0, an entry before it 1.0",
        ),
    ],
)
def test_what_is_wrong_is_said(entries, text):
    with pytest.raises(ConfigError, match=text):
        read_known(entries, BENNU)


def test_an_effect_twice_is_refused():
    known = read_known([{"effect": "point_mass"}, {"effect": "point_mass"}], BENNU)
    with pytest.raises(ConfigError, match="twice"):
        Dynamics(known.effects, known.values)


def test_instruments_stand_in_the_same_list():
    known = read_known(
        [{"effect": "range_bias", "of": "DSS-14", "free": {"range_bias[DSS-14]": "3 m"}}], EARTH
    )
    assert known.instruments[0].of == "DSS-14"
    assert known.instrument_values == {"range_bias[DSS-14]": 0.0}
    assert known.estimate == {"range_bias[DSS-14]": 3.0}
    entry = entry_of(known.instruments[0], known.instrument_values, known.estimate)
    assert read_known([entry], EARTH) == known


def test_rotation_is_an_entry_of_its_own():
    known = read_known(
        [{"effect": "point_mass"}, {"effect": "rotation", "spin_rate": "15 deg/h"}], EARTH
    )
    assert known.values["spin_rate"] == pytest.approx(np.pi / 12 / 3600)
    assert "rotation" in effect_names()
    assert "srp" in effect_names()


def test_new_pushes_take_their_values_from_card_file_and_constants():
    moon = Surveyed(load_body("moon"), Spacecraft(1000.0, 10.0, 1.3, 2.2))
    known = read_known([{"effect": "srp", "occulter": "earth"}], moon)
    assert known.values["occulter_radius"] == pytest.approx(6_378_136.6)
    lift = read_known(
        [{"effect": "aerodynamic_lift", "altitude": "550 km", "lift_B": "1e-3 m2/kg"}], EARTH
    )
    assert lift.values["drag_rho0"] == EARTH.body.atmosphere.layer(550e3).density
    assert lift.values["drag_omega"] == EARTH.body.spin_rate
    lag = read_known(
        [{"effect": "tidal_lag", "tide_lag": "638 s", "tide_own_GM": "4902.8 km3/s2"}], EARTH
    )
    assert lag.values["tide_spin"] == EARTH.body.spin_rate
    for entry, missing in (
        ({"effect": "tidal_lag", "tide_k2": 0.3}, "tide_own_GM"),
        ({"effect": "thermal_recoil"}, "recoil_tau"),
        ({"effect": "velocity_drag"}, "friction_v0"),
        ({"effect": "srp", "occulter": "moonlet"}, "occulter_radius"),
    ):
        with pytest.raises(ConfigError, match=f"needs {missing}"):
            read_known([entry], BENNU)
    for entry, text in (
        ({"effect": "thermal_recoil", "axis": "up"}, 'axis of the recoil is "up"'),
        ({"effect": "velocity_drag", "power": 7}, "power of the friction is 7"),
        ({"effect": "srp", "occulter": "sun"}, "another body than the Sun"),
        ({"effect": "nongravitational_a123", "law": "ice"}, "Allowed: power, water_ice"),
    ):
        with pytest.raises(ConfigError, match=text):
            read_known([entry], BENNU)


def test_new_instrument_effects_are_entries():
    known = read_known(
        [
            {"effect": "troposphere", "of": "DSS-14", "values": {"zenith_delay[DSS-14]": "2.1 m"}},
            {"effect": "refraction", "refraction_scale": 1.0},
            {"effect": "relativistic_delay", "relativistic_delay": 1.0},
            {"effect": "antenna_offset", "free": {"antenna_R": "1 m"}},
        ],
        EARTH,
    )
    assert known.instrument_values["zenith_delay[DSS-14]"] == 2.1
    assert known.estimate == {"antenna_R": 1.0}
    assert [e.name for e in known.instruments][-1] == "antenna_offset"
