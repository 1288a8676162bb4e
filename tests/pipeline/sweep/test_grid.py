import copy

import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.sweep.grid import make_plan
from unmodeled.pipeline.sweep.sweep_config import SweepConfig, load_sweep


def plan_of(content, **changes):
    return make_plan(SweepConfig.resolve(copy.deepcopy(content) | changes))


def text_of(content, **changes):
    with pytest.raises(ConfigError) as caught:
        plan_of(content, **changes)
    return str(caught.value)


def test_count_and_order(content):
    plan = plan_of(content)
    assert len(plan.runs) == 2 * 2 * 3
    assert plan.merged == 0
    table = plan.table()
    assert list(table) == ["id", "initial_condition", "learner", "kind", "noise.state"]
    assert list(table["initial_condition"][:4]) == [0, 1, 2, 0]
    assert table["id"].is_unique


def test_every_realisation_sees_the_same_orbits_and_draws(content):
    plan = plan_of(content)
    (orbits,) = plan.lists.values()
    for k in range(3):
        runs = [r for r in plan.runs if r.initial_condition == k]
        assert len(runs) == 4
        assert len({r.config.seed for r in runs}) == 1
        assert all(r.config.data.orbit.model_dump() == orbits.orbits[k][0] for r in runs)
        assert all(r.config.data.other_orbits[0].model_dump() == orbits.orbits[k][1] for r in runs)
    assert len({r.config.seed for r in plan.runs}) == 3


def test_ids_do_not_depend_on_the_place_in_the_grid(content):
    ids = {r.id for r in plan_of(content).runs}
    turned = copy.deepcopy(content)
    turned["axes"] = dict(reversed(turned["axes"].items()))
    turned["axes"]["learner"].reverse()
    assert {r.id for r in plan_of(turned).runs} == ids
    more = copy.deepcopy(content)
    more["axes"]["noise.state"] = [0, 0.05, 0.1]
    more["initial_conditions"] = {"count": 5}
    assert ids < {r.id for r in plan_of(more).runs}
    assert not ids & {r.id for r in plan_of(content, base=content["base"] | {"seed": 2}).runs}


def test_union_of_grids_has_no_run_twice(content):
    learner = content["axes"]["learner"]
    grids = [
        {"learner": learner, "noise.state": [0, 0.1]},
        {"learner": learner, "noise.acceleration": [0, 0.1]},
    ]
    plan = plan_of(content, axes=grids)
    assert len(plan.runs) == 2 * 3 * 3
    assert plan.merged == 2 * 3
    table = plan.table()
    assert set(zip(table["noise.state"], table["noise.acceleration"], strict=True)) == {
        (0.0, 0.0),
        (0.1, 0.0),
        (0.0, 0.1),
    }


def test_networks_have_their_own_weights_unless_told(content):
    mlp = {"kind": "spectral_mlp", "epochs": 2}
    plan = plan_of(content, axes={"learner": [mlp]})
    states = [r.config.learners[0].params["random_state"] for r in plan.runs]
    assert len(set(states)) == 3
    assert len({r.cell for r in plan.runs}) == 1
    plan = plan_of(content, axes={"learner": [mlp | {"random_state": 5}]})
    assert {r.config.learners[0].params["random_state"] for r in plan.runs} == {5}


def test_learners_of_a_scenario_are_an_axis(content):
    base = content["base"] | {"learners": content["axes"]["learner"]}
    plan = plan_of(content, base=base, axes={"noise.state": [0, 0.1]})
    assert {r.id for r in plan.runs} == {r.id for r in plan_of(content).runs}


def test_hyperparameters_can_vary(content):
    axes = {"learner": [{"kind": "rbf_network"}], "learner.centres": [5, 10]}
    plan = plan_of(content, axes=axes)
    assert sorted({r.config.learners[0].params["centres"] for r in plan.runs}) == [5, 10]
    assert set(plan.table()["learner.centres"]) == {5, 10}


def test_without_a_list_the_configuration_gives_the_orbit(content):
    changed = copy.deepcopy(content)
    del changed["initial_conditions"]
    changed["axes"]["seed"] = [1, 2]
    plan = plan_of(changed)
    assert len(plan.runs) == 8
    assert {r.config.seed for r in plan.runs} == {1, 2}
    assert all(r.initial_condition is None for r in plan.runs)


def test_volumes_share_one_list(content):
    plan = plan_of(content, base={}, axes={**content["axes"], "data.volume": ["low", "moderate"]})
    assert len(plan.lists) == 1
    (orbits,) = plan.lists.values()
    assert orbits.facts["screened_periods"] == 100.0
    assert set(plan.table()["data.volume"]) == {"low", "moderate"}


def test_bodies_have_their_own_lists(content):
    plan = plan_of(content, axes={**content["axes"], "body": ["bennu", "eros"]})
    assert sorted(key.partition("-")[0] for key in plan.lists) == ["bennu", "eros"]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"axes": {}}, "the sweep names no learner"),
        ({"axes": {"learner": []}}, "axis learner has no values"),
        ({"axes": {"learner": ["exact_gp"]}}, "a learner is given as 'exact_gp'"),
        (
            {"axes": {"learner": [{"kind": "point_mass"}], "noise.state": [0, -1]}},
            "sweep at noise.state -1: noise.state is -1: input should be greater than or equal",
        ),
        (
            {"axes": {"learner": [{"kind": "exact_gp"}], "learner.epoch": [1]}},
            'sweep at learner.epoch 1: learner exact_gp: unknown key "epoch", did you mean',
        ),
        ({"axes": {"learner": [{"kind": "exakt_gp"}]}}, 'Did you mean "exact_gp"?'),
        ({"base": {"sed": 1}}, 'unknown key "sed", did you mean "seed"?'),
        ({"base": {"noise": 3}}, "base: noise is not a section"),
        ({"bas": {}}, 'unknown key "bas", did you mean "base"?'),
        ({"initial_conditions": {}}, "Allowed: count and seed, or file"),
        ({"initial_conditions": {"count": 0}}, "initial_conditions.count is 0"),
        ({"initial_conditions": {"count": 2, "file": "a.csv"}}, "one of both"),
        ({"initial_conditions": {"cuont": 2}}, 'did you mean "count"?'),
        ({"base": {"data": {"trajectory": "a.csv"}}}, "leave initial_conditions out"),
        (
            {
                "base": {
                    "data": {"orbit": {"semi_major_axis": 2, "eccentricity": 0, "inclination": 0}}
                }
            },
            "initial_conditions and data.orbit",
        ),
        ({"base": {"data": {"extrapolation_orbits": 3}}}, "set initial_conditions.others to 3"),
        ({"base": {"body": "benu"}}, 'did you mean "bennu"?'),
    ],
)
def test_errors(content, changes, expected):
    assert expected.lower() in text_of(content, **changes).lower()


def test_files(content, tmp_path):
    plan = plan_of(content)
    (orbits,) = plan.lists.values()
    orbits.write(tmp_path / "list.csv")
    (tmp_path / "base.yaml").write_text("data: {train_periods: 3, extrapolation_periods: 2}\n")
    (tmp_path / "sweep.yaml").write_text(
        "base: base.yaml\n"
        "axes:\n"
        "  learner: [{kind: rbf_network, centres: 10}, {kind: point_mass}]\n"
        "  noise.state: [0, 1e-1]\n"
        "initial_conditions: {file: list.csv}\n"
    )
    again = make_plan(load_sweep(tmp_path / "sweep.yaml"))
    assert [r.id for r in again.runs] == [r.id for r in plan.runs]


def test_resolved_again_it_is_the_same(config):
    assert SweepConfig.resolve(config.as_dict()) == config
