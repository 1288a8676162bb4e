"""Body cards: published values, conventions, and what is refused."""

import math
import pickle
from pathlib import Path

import heyoka as hy
import numpy as np
import pytest

from unmodeled.core.constants import ASTRONOMICAL_UNIT
from unmodeled.core.errors import ConfigError
from unmodeled.datasets.atmosphere import Atmosphere, Layer
from unmodeled.datasets.bodies import Body, body_names, heliocentric_orbits, load_body


def test_bennu_is_the_papers_table_2():
    b = load_body("Bennu")
    assert (b.gm, b.radius, b.reference_radius) == (4.89, 290.0, 290.0)
    assert b.zonal_unnormalised() == {2: 1.93e-2, 3: -1.22e-3, 4: -6.50e-3, 5: 6.73e-5}
    assert 2 * math.pi / b.spin_rate / 3600 == pytest.approx(4.296, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "j2", "period_h"),
    [
        # Textbook J2 (NASA fact sheets) and sidereal periods; Eros: sqrt(5) x 0.052478.
        ("earth", 1.08263e-3, 23.9345),
        ("moon", 202.7e-6, 655.72),
        ("mars", 1960.45e-6, 24.6229),
        ("eros", 0.1173, 5.27026),
    ],
)
def test_cards_agree_with_published_values(name, j2, period_h):
    b = load_body(name)
    assert b.zonal_unnormalised()[2] == pytest.approx(j2, rel=3e-3)
    assert 2 * math.pi / b.spin_rate / 3600 == pytest.approx(period_h, rel=1e-5)


def test_earth_is_egm2008():
    b, row = load_body("earth"), 0
    coefficients = hy.model.get_egm2008_CS()
    for n in range(2, 7):
        assert b.zonals[n] == pytest.approx(-coefficients[row, 0], rel=1e-14)
        row += n + 1
    assert (b.gm, b.reference_radius) == (hy.model.get_egm2008_mu(), hy.model.get_egm2008_a())


@pytest.mark.parametrize("name", body_names())
def test_every_card_is_complete(name):
    b = load_body(name)
    assert b.name == name
    assert b.title
    assert b.notes
    assert hash(b) == hash(load_body(name))
    optional = ("pole", "heliocentric_orbit", "love_number_k2", "atmosphere", "gravity_field")
    given = [v for v in optional if getattr(b, v)]
    references = (Path(__file__).parents[2] / "REFERENCES.md").read_text()
    for value in ("gm", "reference_radius", "zonals", "spin_rate", *given):
        assert f"| {b.sources[value]} |" in references
    assert b.brillouin_radius >= b.reference_radius
    assert pickle.loads(pickle.dumps(b)) == b  # noqa: S301 - workers get bodies this way


def test_normalised_zonals_are_multiplied_by_the_root(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(
        "name: own\ngm: 1e-2\nbrillouin_radius: 5\nzonals: {2: 1e-3, 6: 2}\n"
        "zonal_convention: fully_normalised\n"
    )
    b = load_body(path)
    assert b.gm == 0.01  # YAML 1.2: a number without a dot
    assert (b.title, b.reference_radius, b.spin_rate) == ("own", 5.0, 0.0)
    assert b.zonal_unnormalised() == {2: math.sqrt(5) * 1e-3, 6: math.sqrt(13) * 2}
    with pytest.raises(TypeError):
        b.zonals[2] = 0.0


@pytest.mark.parametrize(
    ("name", "perihelion", "aphelion", "days", "obliquity"),
    [
        # JPL's fact pages; obliquity of the spin to the orbit: Lauretta2019 177.6, Miller2002 89.
        ("bennu", 0.897, 1.356, 436.6, 177.6),
        ("eros", 1.133, 1.783, 643.1, 89.0),
    ],
)
def test_orbits_and_poles_of_small_bodies(name, perihelion, aphelion, days, obliquity):
    orbit = heliocentric_orbits()[name]
    times = np.linspace(0.0, orbit.period, 3001)
    au = np.linalg.norm(orbit.position(orbit.epoch, times), axis=1) / ASTRONOMICAL_UNIT.value
    assert au.min() == pytest.approx(perihelion, abs=1e-3)
    assert au.max() == pytest.approx(aphelion, abs=1e-3)
    assert orbit.period / 86_400 == pytest.approx(days, abs=0.4)
    tilt = math.degrees(math.acos(load_body(name).pole.axis @ orbit.normal))
    assert tilt == pytest.approx(obliquity, abs=0.2)


def test_poles_of_moon_and_mars():
    # The Moon's mean pole is the ecliptic's (1.543 degrees off with a period of 18.6 years).
    ecliptic = np.array([0.0, -math.sin(math.radians(23.4393)), math.cos(math.radians(23.4393))])
    moon, mars = load_body("moon").pole.axis, load_body("mars").pole.axis
    assert math.degrees(math.acos(moon @ ecliptic)) < 0.1
    # Mars: 25.19 degrees to its orbit, whose normal is at i = 1.850, node = 49.558 degrees.
    i, node = np.radians([1.850, 49.558])
    normal = np.array([math.sin(i) * math.sin(node), -math.sin(i) * math.cos(node), math.cos(i)])
    c, s = math.cos(math.radians(23.4393)), math.sin(math.radians(23.4393))
    normal = np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ normal
    assert math.degrees(math.acos(mars @ normal)) == pytest.approx(25.19, abs=0.02)


def test_body_axes_turn_about_the_cards_pole():
    b = load_body("eros")
    m = b.pole_matrix()
    np.testing.assert_array_equal(m[2], b.pole.axis)
    day = 2 * math.pi / b.spin_rate
    turned = b.body_fixed_from_icrf("2000-02-14T00:00:00 UTC", [0.0, day / 4, day])
    np.testing.assert_allclose(turned[2], turned[0], atol=1e-12)
    np.testing.assert_allclose(turned[1, 0], turned[0, 1], atol=1e-12)  # x comes where y was
    np.testing.assert_allclose(turned[:, 2], m[[2, 2, 2]], atol=1e-12)
    with pytest.raises(ConfigError, match=r"card of earth has no pole\. Use core.earth_orient"):
        load_body("earth").pole_matrix()
    with pytest.raises(ConfigError, match=r"card of x has no pole\. Add one"):
        Body("x", "X", 1.0, 2.0, 3.0).body_fixed_from_icrf("2000-02-14T00:00:00 UTC", [0.0])


def test_earths_air_and_tides():
    b = load_body("earth")
    assert (b.gravity_field, b.love_number_k2) == ("egm2008", 0.30190)
    assert [load_body(n).love_number_k2 for n in ("moon", "mars", "bennu")] == [0.0242, 0.169, None]
    assert b.atmosphere.layer(525e3) == (500e3, 6.967e-13, 63.822e3)
    assert b.atmosphere.layer(10.0).altitude == 200e3
    # U.S. Standard Atmosphere 1976 at 550 km: 2.8e-13 to 3.3e-13 kg/m3 by source.
    assert b.atmosphere.density([550e3])[0] == pytest.approx(3.0e-13, rel=0.1)
    heights = np.arange(200e3, 1200e3, 5e3)
    density = b.atmosphere.density(heights)
    assert np.all(np.diff(density) < 0)
    # The layers meet: a wrong row would make a step.
    for low, high in zip(b.atmosphere.layers, b.atmosphere.layers[1:], strict=False):
        reached = low.density * math.exp(-(high.altitude - low.altitude) / low.scale_height)
        assert reached == pytest.approx(high.density, rel=2e-3)


def card(**changes):
    values = {"name": "own", "gm": "1.0", "brillouin_radius": "5.0", **changes}
    return "".join(f"{k}: {v}\n" for k, v in values.items() if v is not None)


def orbit(**changes):
    values = {
        "epoch": "2019-01-01T00:00:00 TDB",
        "semi_major_axis_au": 1,
        "eccentricity": 0.1,
        "inclination_deg": 0,
        "node_deg": 0,
        "perihelion_deg": 0,
        "mean_anomaly_deg": 0,
    }
    return "{" + ", ".join(f"{k}: {v}" for k, v in {**values, **changes}.items()) + "}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (card(gravity="3"), 'unknown key "gravity"'),
        (card(spin_rat="3"), r'unknown key "spin_rat"\. Did you mean "spin_rate"'),
        (card(gm=None), 'lacks the key "gm"'),
        (card(gm="0"), r"body own: gm is 0\.0\. Allowed: a number > 0"),
        (card(gm="-1"), r"gm is -1\.0"),
        (card(gm=".nan"), "gm is nan. Allowed: a finite number"),
        (card(gm="many"), "gm is 'many'. Allowed: a number"),
        (card(gm="true"), "gm is True"),
        (card(brillouin_radius="-5"), r"brillouin_radius is -5\.0"),
        (card(zonals="{1: 0.1}"), "zonal degree 1. Allowed: whole numbers >= 2"),
        (card(zonals="{J2: 0.1}"), "zonal degree 'J2'"),
        (card(zonals="{2: .inf}"), "zonal J2 is inf"),
        (card(zonals="[1, 2]"), "zonals and sources must be tables"),
        (card(zonal_convention="normalised"), 'zonal_convention is "normalised".*Did you mean'),
        (card(sources="{mass: Me1999}"), 'sources name "mass"'),
        (card(pole="[1, 2]"), r"own.yaml, pole is \[1, 2\]\. Allowed: a table of right_asc"),
        (card(pole="{right_ascension_deg: 1}"), 'pole lacks the key "declination_deg"'),
        (card(pole="{declination: 1}"), 'pole has an unknown key.*mean "declination_deg"'),
        (
            card(pole="{right_ascension_deg: 1, declination_deg: 95}"),
            "pole: pole: declination is 95 degrees",
        ),
        (
            card(pole="{right_ascension_deg: .nan, declination_deg: 5}"),
            "right_ascension_deg is nan. Allowed: a finite number",
        ),
        (card(heliocentric_orbit="{epoch: 2019-01-01}"), 'lacks the key "semi_major_axis_au"'),
        (card(heliocentric_orbit=orbit(eccentricity=1.5)), "heliocentric_orbit: eccentricity 1.5"),
        (card(heliocentric_orbit=orbit(epoch="soon")), 'heliocentric_orbit: epoch "soon" cannot'),
        (card(atmosphere="5"), "atmosphere is not a list of rows of three"),
        (card(atmosphere="[[1, 2]]"), "atmosphere is not a list of rows of three"),
        (card(atmosphere="[]"), "atmosphere: the atmosphere has no layers"),
        (card(atmosphere="[[1, 0, 3]]"), "density of layer 1 is 0. Allowed: a number > 0"),
        (card(atmosphere="[[5, 1, 3], [4, 1, 3]]"), "altitudes of the layers do not increase"),
        (card(atmosphere="[[1, x, 3]]"), "atmosphere is 'x'"),
        (card(love_number_k2="2"), "love_number_k2 is 2. Allowed: 0 to 1.5"),
        (card(gravity_field="egm2088"), 'gravity_field is "egm2088".*mean "egm2008"'),
        ("- 1\n- 2\n", "is not a table"),
        ("a: [1\n", "cannot be read"),
    ],
)
def test_bad_cards_are_refused(tmp_path, text, message):
    path = tmp_path / "own.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_body(path)


def test_unknown_bodies_are_refused(tmp_path):
    with pytest.raises(ConfigError, match=r'no body "benu".*Did you mean "bennu"'):
        load_body("benu")
    with pytest.raises(ConfigError, match="there is no card"):
        load_body(Path(tmp_path / "absent.yaml"))


def test_bodies_can_be_made_in_python():
    assert Body("x", "X", 1.0, 2.0, 3.0).zonal_unnormalised() == {}


def test_parts_of_another_kind_are_refused():
    with pytest.raises(ConfigError, match=r"body x: pole is 3\. Allowed: a Pole"):
        Body("x", "X", 1.0, 2.0, 3.0, pole=3)
    with pytest.raises(ConfigError, match=r"layer 1 is .*Allowed: finite numbers"):
        Atmosphere((Layer(0.0, math.inf, 1.0),))
