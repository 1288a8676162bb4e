import numpy as np
import pytest

from unmodeled.core.errors import DataError
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.initial_conditions import require_collision_free
from unmodeled.datasets.simulation import gravity_of
from unmodeled.pipeline.sweep.orbit_list import draw_orbits, read_orbits


@pytest.fixture(scope="module")
def orbits():
    return draw_orbits("bennu", 4, seed=7, others=2, periods=50.0)


def test_shape(orbits):
    assert (len(orbits), orbits.others, len(orbits.elements)) == (4, 2, 12)
    assert len(orbits.orbits[3]) == 3
    assert orbits.orbits[1][0]["eccentricity"] == orbits.elements["eccentricity"].iloc[3]
    assert orbits.facts["seed"] == 7


def test_every_orbit_is_free_of_collisions(orbits):
    body = load_body("bennu")
    states = require_collision_free(
        gravity_of(body), orbits.elements, body.brillouin_radius, periods=50.0
    )
    assert states.shape == (12, 6)


def test_a_longer_list_begins_with_the_shorter_one(orbits):
    longer = draw_orbits("bennu", 6, seed=7, others=2, periods=50.0)
    assert longer.first(4).hash == orbits.hash
    assert longer.hash != orbits.hash
    assert draw_orbits("bennu", 4, seed=8, others=2, periods=50.0).hash != orbits.hash


def test_written_and_read_it_is_the_same_to_the_last_digit(orbits, tmp_path):
    orbits.write(tmp_path / "list.csv")
    again = read_orbits(tmp_path / "list.csv")
    assert np.array_equal(again.elements.to_numpy(), orbits.elements.to_numpy())
    assert again.hash == orbits.hash
    assert again.orbits == orbits.orbits
    assert [p.name for p in tmp_path.iterdir()] == ["list.csv"]


def test_a_list_by_hand_needs_no_hash(orbits, tmp_path):
    orbits.write(tmp_path / "list.csv")
    text = (tmp_path / "list.csv").read_text().partition("\n")[2]
    (tmp_path / "own.csv").write_text(text)
    assert read_orbits(tmp_path / "own.csv").hash == orbits.hash


def change_digit(text):
    return text[:-4] + ("1" if text[-4] != "1" else "2") + text[-3:]


def drop_last(text):
    return text[: text.rstrip().rindex("\n") + 1]


def drop_hash(text):
    return text.partition("\n")[2]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (change_digit, "was changed: its content has not the hash"),
        (drop_last, "not numbered 0, 1, ... with the same number of orbits"),
        (lambda t: drop_hash(t).replace("node", "knot"), "is not a list of initial conditions"),
        (lambda t: "", "not numbered 0, 1"),
        (lambda t: drop_hash(t).replace("0,", "x,", 1), "is not a list of initial conditions"),
        (lambda t: drop_hash(t).partition("\n")[0] + "\n", "not numbered 0, 1"),
    ],
)
def test_damage_is_found(orbits, tmp_path, change, expected):
    path = tmp_path / "list.csv"
    orbits.write(path)
    path.write_text(change(path.read_text()))
    with pytest.raises(DataError) as caught:
        read_orbits(path)
    assert expected in str(caught.value)


def test_missing_file(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_orbits(tmp_path / "none.csv")
