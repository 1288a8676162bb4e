"""Equal meanings have equal ids, different ones different ids."""

import pytest

from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.sweep.run_id import canonical, cell_id, run_id

MASS = {"kind": "point_mass"}
ORBIT = {"semi_major_axis": 2.0, "eccentricity": 0.1, "inclination": 30.0}
OTHER = ORBIT | {"inclination": 40.0}
GIVEN = {"orbit": ORBIT, "other_orbits": [OTHER]}


def of(flights=False, folders=(), **content):
    config = CharacterizationConfig.resolve({"learners": [MASS]} | content)
    return canonical(config, flights=flights, folders=folders)


@pytest.mark.parametrize(
    "same",
    [
        {"data": {"volume": "low"}},
        {"data": {"train_periods": 10, "extrapolation_periods": 3}},
        {"data": {"samples_per_period": 25}},
        {"data": {"rk4_steps_per_period": 100}},
        {"name": "other"},
        {"noise": {"state": 0, "acceleration": 0.0, "unit": "si", "draws": "consistent"}},
        {"learners": [MASS | {"label": "mine"}]},
        {"flight": {"orbits": 7}},
        {"body": "bennu"},
    ],
)
def test_same_meaning_same_id(same):
    assert run_id(of(**same)) == run_id(of())


@pytest.mark.parametrize(
    "other",
    [
        {"data": {"volume": "moderate"}},
        {"data": {"integrator": "rk4"}},
        {"data": GIVEN},
        {"noise": {"state": 1e-300}},
        {"noise": {"state": 0.1, "unit": "si"}},
        {"learners": [MASS | {"gm": 1.0}]},
        {"learners": [{"kind": "exact_gp"}]},
        {"body": "eros"},
        {"seed": 2},
        {"flights": True},
    ],
)
def test_another_meaning_another_id(other):
    assert run_id(of(**other)) != run_id(of())


def test_what_does_not_act_is_left_out():
    noisy = {"state": 0.1}
    assert run_id(of(noise=noisy | {"draws": "consistent"})) != run_id(of(noise=noisy))
    acceleration = {"acceleration": 0.1}
    assert run_id(of(noise=acceleration | {"draws": "consistent"})) == run_id(
        of(noise=acceleration)
    )
    ranges = {"ranges": {"eccentricity": [0.1, 0.2]}}
    assert run_id(of(data=ranges)) != run_id(of())
    assert run_id(of(data=GIVEN | ranges)) == run_id(of(data=GIVEN))
    rk4 = {"integrator": "rk4"}
    assert run_id(of(data=rk4 | {"rk4_steps_per_period": 100})) != run_id(of(data=rk4))
    assert run_id(of(flights=True, flight={"orbits": 7})) != run_id(of(flights=True))


def test_a_file_is_known_by_its_content(tmp_path):
    for folder, text in (("a", "one"), ("b", "one"), ("c", "two")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "t.csv").write_text(text)
    ids = [run_id(of(data={"trajectory": "t.csv"}, folders=[tmp_path / f])) for f in "abc"]
    assert ids[0] == ids[1] != ids[2]


def test_a_body_card_is_known_by_its_content(tmp_path):
    from unmodeled.datasets import bodies

    text = (bodies.Path(bodies.__file__).parent / "cards" / "bennu.yaml").read_text()
    (tmp_path / "mine.yaml").write_text(text.replace("name: bennu", "name: mine"))
    assert run_id(of(body=str(tmp_path / "mine.yaml"))) == run_id(of())


def test_cells_differ_in_orbit_and_seeds_only():
    mlp = {"kind": "spectral_mlp"}
    one = of(data=GIVEN, learners=[mlp | {"random_state": 1}], seed=1)
    orbits = {"orbit": OTHER, "other_orbits": [ORBIT]}
    same = of(data=orbits, learners=[mlp | {"random_state": 2}], seed=2)
    assert run_id(one) != run_id(same)
    assert cell_id(one) == cell_id(same)
    for other in ({"noise": {"state": 0.1}}, {"learners": [mlp | {"epochs": 7}]}):
        assert cell_id(of(**({"data": GIVEN, "learners": [mlp]} | other))) != cell_id(one)
