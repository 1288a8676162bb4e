"""Plan, fields, oracle, runner, cells and page of the skill table."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import skill_table
from skill.fields import FIELDS, eros_mesh, region_points, shape_gravity
from skill.learners import ORACLE, learner_rows
from skill.oracle import FamilyOracle, register
from skill.page import write_page
from skill.plan import FULL, NOISE, SMALL, NotRun, make_runs
from skill.runner import NO_DATA, SkillRunner
from skill.summary import check_use, summarize_cells

from unmodeled.core.errors import ConfigError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import NoiseLevel, PointMassOnly, learner_names
from unmodeled.models.physics.polyhedron_sums import polyhedron_gravity
from unmodeled.pipeline.sweep.run_config import RunConfig, RunResult
from unmodeled.pipeline.sweep.runner import learning_data
from unmodeled.pipeline.sweep.store import Store
from unmodeled.pipeline.sweep.sweep import Opened, sweep
from unmodeled.pipeline.use_check import DO_NOT_USE

ONE = replace(SMALL, fields=("bennu-zonal",), flown_noise=())


# Fields


def test_the_truth_near_the_shape_is_the_closed_form() -> None:
    points = np.array([[0.0, 0.5, 0.1], [1.3, 0.0, 0.2], [2.0, 0.3, 0.0]])

    def series(x: np.ndarray) -> np.ndarray:
        return np.full_like(x, 7.0)

    found = shape_gravity(series, points)
    exact = polyhedron_gravity(eros_mesh(), points[:2], NORMALISED_GM).acceleration
    np.testing.assert_array_equal(found[:2], exact)
    assert np.all(found[2] == 7.0)


def test_regions_lie_where_they_say() -> None:
    run = runs_of("point_mass")[0]
    data = learning_data(run.config)
    regions = region_points(FIELDS["bennu-zonal"], data)
    radii = {k: np.linalg.norm(x, axis=1) for k, x in regions.items()}
    lowest = np.linalg.norm(data.train.positions, axis=1).min()
    assert 1.0 <= radii["below"].min() < radii["below"].max() <= lowest
    assert 5.0 <= radii["far"].min() < radii["far"].max() <= 20.0
    np.testing.assert_allclose(radii["surface"], 1.0)
    again = region_points(FIELDS["bennu-zonal"], data)
    np.testing.assert_array_equal(regions["far"], again["far"])


# Oracle


@pytest.mark.parametrize("noise", [NoiseLevel(), NoiseLevel(0.05, 0.0)])
def test_the_oracle_recovers_its_masses(noise: NoiseLevel) -> None:
    X = np.random.default_rng(1).uniform(1.5, 3.0, (20, 3)) * [1, -1, 1]
    centre = PointMassOnly()
    y = centre._predict(X) + 0.1 * centre._predict(X - [0.5, 0.0, 0.0])
    y -= 0.1 * centre._predict(X - np.array([-0.5, 0.0, 0.0]))
    model = FamilyOracle("hidden_masses").fit(X, y, noise)
    np.testing.assert_allclose(model.coefficients_, [1.0, 0.1, -0.1], atol=1e-11)
    step = np.array([1e-6, 0.0, 0.0])
    slope = (model.predict(X + step) - model.predict(X - step)) / 2e-6
    np.testing.assert_allclose(model.jacobian(X)[:, :, 0], slope, rtol=1e-6, atol=1e-6)


def test_the_oracle_refuses_other_families() -> None:
    X = np.eye(3).repeat(2, axis=0)
    with pytest.raises(ConfigError, match=r'family is "cube".*hidden_masses, polyhedron'):
        FamilyOracle("cube").fit(X, X)


def test_the_registry_knows_the_oracle_only_when_asked() -> None:
    assert "family_oracle" not in learner_names()
    register()
    assert "family_oracle" in learner_names()


# Plan


def runs_of(*kinds: str) -> list[RunConfig]:
    plan, _ = make_runs(ONE, kinds)
    return [r for r in plan.runs if r.axes["kind"] in kinds]


def test_every_registered_learner_has_a_row() -> None:
    wanted = set(learner_names()) - {"residual", "zonal_oracle", "family_oracle"}
    for field in FIELDS.values():
        rows = learner_rows(field)
        assert wanted <= {row.spec["kind"] for row in rows}
        assert [row.spec["kind"] for row in rows][:2] == ["point_mass", "fitted_point_mass"]
        assert sum(row.spec.get("label") == ORACLE for row in rows) == 1


def test_what_is_not_run_has_a_reason() -> None:
    size = replace(FULL, fields=("bennu-zonal",), noise=NOISE[:1], allowance=1.0, patience=1.0)
    plan, left_out = make_runs(size)
    seen = {(r.axes["learner"], r.axes["volume"]) for r in plan.runs}
    missing = {(n.learner, n.volume) for n in left_out}
    assert not seen & missing
    names = {name for name, _ in seen | missing}
    assert seen | missing == {(n, v) for n in names for v in ("low", "moderate")}
    reason = next(n.reason for n in left_out if n.kind == "exact_gp" and n.volume == "moderate")
    assert reason == "29 s a fit: 1 cells of 3 pairs would take 87 s, more than 1 s"


def test_ids_are_stable_and_differ() -> None:
    plan, _ = make_runs(SMALL)
    again, _ = make_runs(SMALL)
    ids = [run.id for run in plan.runs]
    assert ids == [run.id for run in again.runs]
    assert len(set(ids)) == len(ids)
    part, _ = make_runs(SMALL, ("elm",))
    assert {r.axes["kind"] for r in part.runs} >= {"elm", "point_mass"}
    assert {run.id for run in part.runs} < set(ids)


# Runner


def test_a_row_has_every_measure() -> None:
    flown = replace(SMALL, fields=("bennu-zonal",), noise=((0.0, 0.1),))
    plan, _ = make_runs(flown, ("harmonic_least_squares",))
    batch = [r for r in plan.runs if r.axes["kind"] == "harmonic_least_squares"]
    (row,) = (q.values for q in SkillRunner()(batch[:1]))
    for name in ("interpolation", "extrapolation", "below", "far", "surface"):
        assert 0 < row[f"{name}_median"] < 1  # type: ignore[operator]
        assert 0 < row[f"{name}_point_mass"] < 1  # type: ignore[operator]
    assert row["advice"] == row["training_advice"] == "passes"
    assert 0 < row["flight_1"] < row["flight_10"] < 290  # type: ignore[operator]
    assert row["extrapolation_over_point_mass"] == pytest.approx(
        row["extrapolation_median"] / row["extrapolation_point_mass"]  # type: ignore[operator]
    )


def test_a_point_mass_is_its_own_reference() -> None:
    (row,) = (q.values for q in SkillRunner()(runs_of("point_mass")[:1]))
    for name in ("interpolation", "extrapolation", "below", "far", "surface"):
        assert row[f"{name}_median"] == pytest.approx(row[f"{name}_point_mass"])


class Interrupted(SkillRunner):
    """A runner that is stopped in the middle of its batch."""

    def __call__(self, runs: Sequence[RunConfig]) -> Iterator[RunResult]:
        for k, result in enumerate(super().__call__(runs)):
            if k == 2:
                raise KeyboardInterrupt
            yield result


class Counting(SkillRunner):
    done: list[str] = []  # noqa: RUF012

    def __call__(self, runs: Sequence[RunConfig]) -> Iterator[RunResult]:
        for result in super().__call__(runs):
            self.done.append(result.id)
            yield result


def test_interrupted_nothing_is_lost_and_nothing_done_twice(tmp_path: Path) -> None:
    plan, _ = make_runs(replace(ONE, noise=((0.0, 0.0),)), ("fitted_point_mass",))
    plan = replace(plan, runs=tuple(r for r in plan.runs if r.axes["learner"] != ORACLE))
    store = Store(tmp_path / "store")
    store.create()
    opened = Opened(store, plan, ())
    with pytest.raises(KeyboardInterrupt):
        sweep(opened, run_batch=Interrupted())
    kept = set(store.finished())
    assert len(kept) == 2
    Counting.done.clear()
    table = sweep(opened, run_batch=Counting())
    assert set(Counting.done) == {r.id for r in plan.runs} - kept
    assert len(Counting.done) == len(plan.runs) - 2
    assert len(table) == len(plan.runs)


# Cells


def made_up(**changes: object) -> pd.DataFrame:
    base = {
        "field": "bennu-zonal",
        "volume": "low",
        "sigma_s": 0.0,
        "sigma_a": 0.1,
        "learner": "elm on point mass",
        "kind": "elm",
        "baseline": "point_mass",
        "failure": "",
        "advice": "passes",
        "cost_cpu_s": 1.0,
        "initial_condition": 101,
    }
    for name in ("interpolation", "extrapolation", "below", "far", "surface"):
        base |= {f"{name}_median": 0.01, f"{name}_mean": 0.02, f"{name}_point_mass": 0.01}
    frame = pd.DataFrame([base] * 3)
    for key, values in changes.items():
        frame[key] = values
    return frame


def test_a_cell_is_the_median_of_medians_and_the_mean_of_means() -> None:
    cells = summarize_cells(
        made_up(extrapolation_median=[0.001, 0.002, 0.009], extrapolation_mean=[0.1, 0.2, 0.6])
    )
    (cell,) = cells.to_dict("records")
    assert cell["extrapolation_median"] == 0.002
    assert cell["extrapolation_mean"] == pytest.approx(0.3)
    assert (cell["pairs"], cell["failures"], cell["verdict"]) == (3, 0, "passes")


def test_a_failed_fit_is_infinite_and_no_data_does_not_count() -> None:
    runs = made_up(failure=["it broke", "", NO_DATA + "it hit the body"])
    runs.loc[0, ["extrapolation_median", "extrapolation_mean", "advice"]] = np.nan
    (cell,) = summarize_cells(runs).to_dict("records")
    assert (cell["pairs"], cell["failures"]) == (2, 1)
    assert cell["extrapolation_median"] == np.inf  # of 0.01 and infinity
    assert cell["verdict"] == DO_NOT_USE


def test_a_cell_that_is_worse_says_so_although_single_runs_do_not() -> None:
    runs = made_up(
        extrapolation_median=[0.03, 0.03, 0.1],
        extrapolation_point_mass=[0.02, 0.01, 0.01],
        advice=["passes", DO_NOT_USE, DO_NOT_USE],
    )
    (cell,) = summarize_cells(runs).to_dict("records")
    assert cell["verdict"] == DO_NOT_USE
    assert cell["worse_at"] == "extrapolation"
    assert check_use(runs, summarize_cells(runs)).holds


def test_the_check_finds_a_verdict_that_was_left_out() -> None:
    """Numbers, not words, decide: with the advice taken out the check must fail."""
    runs = made_up(extrapolation_median=0.03, advice=DO_NOT_USE)
    assert check_use(runs, summarize_cells(runs)).holds
    silent = runs.assign(advice="passes")
    found = check_use(silent, summarize_cells(silent))
    assert not found.holds
    assert (found.worse_runs, found.silent_runs) == (3, 3)
    assert '"do not use" FAILS: of 3 runs 3 are worse' in found.sentence()
    cells = summarize_cells(runs).assign(verdict="passes")
    assert check_use(runs, cells).silent_cells == 1


# Page


def test_the_first_pairs_come_first_and_what_is_not_run_is_in_the_table() -> None:
    plan, _ = make_runs(replace(FULL, fields=("two-mascons",), noise=NOISE[:1]), ("point_mass",))
    parts = skill_table.passes(plan)
    seeds = [{r.config.seed for r in part.runs} for part in parts]
    assert seeds == [set(range(101, 101 + k)) for k in (3, 3, 5, 20)]
    assert {r.config.seed for r in parts[0].runs if r.flights} == {101}
    assert parts[-1] is plan
    small, _ = make_runs(ONE, ("point_mass",))
    assert skill_table.passes(small) == [small]
    rows = skill_table.not_run_rows([NotRun("sparse gp", "sparse_gp", "low", "10 s a fit")])
    assert rows.loc[0, "verdict"] == "not run: 10 s a fit"


def test_the_page_shows_what_was_run_and_what_was_not(tmp_path: Path) -> None:
    runs = pd.concat(
        [
            made_up(learner="point mass", kind="point_mass", baseline="none"),
            made_up(extrapolation_median=0.03, advice=DO_NOT_USE),
        ],
        ignore_index=True,
    )
    cells = summarize_cells(runs)
    left_out = [NotRun("sparse gp", "sparse_gp", "low", "10 s a fit")]
    write_page(runs, cells, left_out, SMALL, tmp_path / "skill.html", planned=7)
    text = (tmp_path / "skill.html").read_text()
    assert "0.030 / 0.020 ✗" in text
    assert "not run: 10 s a fit" in text
    assert "Only 6 of 7 runs are finished" in text
    assert "point mass (zero residual)" in text
    assert "http" not in text.replace("http-equiv", "")
    assert (tmp_path / "skill-low.png").stat().st_size > 10_000


def test_a_learner_that_takes_fewer_samples_is_not_run_and_says_why() -> None:
    plan, left = make_runs(replace(FULL, fields=("two-mascons",), noise=NOISE[:1]))
    why = {item.reason for item in left if item.kind == "harmonic_kernel_gp"}
    assert why == {"it takes at most 1,000 samples, here are 2,375"}
    volumes = {r.axes["volume"] for r in plan.runs if r.axes["kind"] == "harmonic_kernel_gp"}
    assert volumes == {"low"}
