"""Whole sweeps with real learners."""

import copy
import json

import pytest

import unmodeled as um
from unmodeled.core.errors import InputError
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.sweep.status import export, status
from unmodeled.pipeline.sweep.sweep import open_sweep, sweep
from unmodeled.pipeline.sweep.table import results_only

CONTENT = {
    "name": "small",
    "base": {"data": {"train_periods": 3, "extrapolation_periods": 2}},
    "axes": {
        "learner": [
            {"kind": "rbf_network", "centres": 10},
            {"kind": "spectral_mlp", "epochs": 5},
            {"kind": "exact_gp", "epochs": 5},
        ],
        "noise.state": [0, 0.1],
    },
    "initial_conditions": {"count": 3},
}


def never(runs):
    raise AssertionError("nothing is left to run")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep") / "store"
    return folder, um.sweep(CONTENT, folder)


def test_table(whole):
    _, table = whole
    assert len(table) == 3 * 2 * 3
    assert list(table)[:8] == [
        *("id", "initial_condition", "learner", "kind", "noise.state"),
        *("train_median", "interpolation_median", "extrapolation_median"),
    ]
    assert (table["failure"] == "").all()
    assert table["train_median"].notna().all()
    gp = table[table["kind"] == "exact_gp"]
    assert gp["interpolation_coverage_95"].notna().all()
    noisy = table[table["noise.state"] > 0]
    assert noisy["train_median"].median() > 3 * table["train_median"].min()


def test_a_run_is_the_characterisation_of_its_configuration(whole):
    folder, table = whole
    run = open_sweep(folder).plan.runs[4]
    result = characterize(run.config)
    row = table[table["id"] == run.id].iloc[0]
    for name, summary in result.learners[0].summaries.items():
        for key, value in summary.as_dict().items():
            assert row[f"{name}_{key}"] == value


@pytest.mark.slow
def test_two_workers_and_other_batches_give_the_same_table(whole, tmp_path):
    table = um.sweep(CONTENT, tmp_path / "two", workers=2, batch_size=2)
    assert results_only(table).equals(results_only(whole[1]))


def test_shuffled_grid_and_solo_batches_give_the_same_rows(whole, tmp_path):
    turned = copy.deepcopy(CONTENT)
    turned["axes"] = {"noise.state": [0.1, 0], "learner": CONTENT["axes"]["learner"][::-1]}
    table = um.sweep(turned, tmp_path / "turned", batch_size=1)
    a, b = (results_only(t).sort_values("id", ignore_index=True) for t in (table, whole[1]))
    assert a[b.columns.tolist()].equals(b)


def test_two_shards_are_one(whole, tmp_path):
    first = um.sweep(CONTENT, tmp_path / "shards", shard="1/2")
    assert 0 < len(first) < 18
    both = um.sweep(CONTENT, tmp_path / "shards", shard="2/2")
    assert results_only(both).equals(results_only(whole[1]))
    assert not list((tmp_path / "shards" / "journal").iterdir())  # the last one compacted


def test_resume_runs_nothing_again(whole):
    folder, table = whole
    assert sweep(folder, run_batch=never).equals(table)
    assert sweep(CONTENT, folder, run_batch=never).equals(table)


def test_a_grid_can_grow(whole, tmp_path):
    folder = tmp_path / "grows"
    small = copy.deepcopy(CONTENT)
    small["axes"]["learner"] = [{"kind": "rbf_network", "centres": 10}]
    small["initial_conditions"] = {"count": 2}
    um.sweep(small, folder)
    done = []
    told = um.sweep(CONTENT, folder, tell=lambda finished, total: done.append((finished, total)))
    assert done[0] == (4, 18)
    assert results_only(told).equals(results_only(whole[1]))
    less = um.sweep(small, folder, run_batch=never)
    assert len(less) == 4


def test_status(whole):
    found = status(open_sweep(whole[0]))
    assert (found.planned, found.finished, found.failed, found.other) == (18, 18, 0, 0)
    assert found.remaining.runs == 0
    assert json.loads(json.dumps(found.as_json()))["learners"][0]["finished"] == 6


@pytest.mark.parametrize("suffix", ["parquet", "csv", "json"])
def test_export(whole, tmp_path, suffix):
    import pandas as pd

    target = tmp_path / f"table.{suffix}"
    assert export(open_sweep(whole[0]), target) == 18
    back = getattr(pd, f"read_{suffix}")(target)
    assert list(back) == list(whole[1])
    assert back["id"].tolist() == whole[1]["id"].tolist()
    assert [p.name for p in tmp_path.iterdir()] == [target.name]


def test_export_errors(whole, tmp_path):
    with pytest.raises(InputError, match=r"ends in \.parquet, \.csv, \.json"):
        export(open_sweep(whole[0]), tmp_path / "table.xlsx")
    with pytest.raises(InputError, match=r"no run of .* is finished"):
        export(open_sweep(CONTENT, tmp_path / "new"), tmp_path / "table.csv")


def test_a_bad_grid_leaves_no_folder(tmp_path):
    with pytest.raises(InputError, match=r"(?i)did you mean"):
        um.sweep(CONTENT | {"axes": {"noise.stat": [1]}}, tmp_path / "store")
    bad = CONTENT | {"axes": {"learner": [{"kind": "exact_gp", "epoch": 1}]}}
    with pytest.raises(InputError, match=r"(?i)did you mean"):
        um.sweep(bad, tmp_path / "store")
    assert not (tmp_path / "store").exists()


def test_the_stored_list_is_used_and_guarded(whole, tmp_path):
    folder = tmp_path / "store"
    content = copy.deepcopy(CONTENT)
    content["axes"] = {"learner": [{"kind": "point_mass"}]}
    um.sweep(content, folder)
    (path,) = folder.glob("initial-conditions-*.csv")
    head, _, rest = path.read_text().partition("\n")
    record = json.loads((folder / "provenance.json").read_text())
    assert list(record["initial_conditions"].values()) == [json.loads(head[1:])["sha256"]]
    path.write_text(rest.replace("0.", "0.1", 1))  # another list, by hand and without a hash
    content["initial_conditions"] = {"count": 4}
    with pytest.raises(InputError, match="not the beginning of the longer list"):
        um.sweep(content, folder)


def test_a_failing_fit_is_a_row_with_its_reason(tmp_path, monkeypatch):
    from unmodeled.core.errors import NumericalError
    from unmodeled.models.learned import RBFNetwork

    def breaks(*_, **__):
        raise NumericalError("no pivot")

    monkeypatch.setattr(RBFNetwork, "_fit", breaks)
    content = copy.deepcopy(CONTENT)
    content["axes"]["learner"] = [{"kind": "rbf_network"}, {"kind": "point_mass"}]
    table = um.sweep(content, tmp_path / "store")
    failed = table[table["kind"] == "rbf_network"]
    assert (failed["failure"] == "no pivot.").all()
    assert failed["train_median"].isna().all()
    found = status(open_sweep(tmp_path / "store"))
    assert (found.finished, found.failed) == (12, 6)
