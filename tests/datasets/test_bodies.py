"""Body cards: published values, conventions, and what is refused."""

import math
import pickle
import re
from pathlib import Path

import heyoka as hy
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.datasets.bodies import Body, body_names, load_body


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
    for value in ("gm", "reference_radius", "zonals", "spin_rate"):
        assert re.fullmatch(r"[A-Z][A-Za-z0-9]+", b.sources[value])
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


def card(**changes):
    values = {"name": "own", "gm": "1.0", "brillouin_radius": "5.0", **changes}
    return "".join(f"{k}: {v}\n" for k, v in values.items() if v is not None)


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
