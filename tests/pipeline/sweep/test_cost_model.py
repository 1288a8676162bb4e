import math

import pytest

from unmodeled.models.learned import learner_names
from unmodeled.pipeline.sweep.cost_model import _MEASURED, _between, expected_cost
from unmodeled.pipeline.sweep.grid import make_plan
from unmodeled.pipeline.sweep.sweep_config import SweepConfig


def plan_of(*learners, count=2, **base):
    content = {"base": base, "axes": {"learner": list(learners)}}
    return make_plan(SweepConfig.resolve(content | {"initial_conditions": {"count": count}}))


def test_every_learner_has_been_measured():
    assert set(learner_names()) - {"residual"} <= set(_MEASURED)


def test_between_measured_sizes():
    values = (1.0, 4.0, 40.0)
    assert [_between(n, values) for n in (237, 950, 2375)] == pytest.approx(values)
    assert 1.0 < _between(500, values) < 4.0
    assert _between(50, values) == 1.0  # fixed costs rule
    power = math.log(10) / math.log(2375 / 950)
    assert _between(4750, values) == pytest.approx(40 * 2**power)


def test_epochs_and_counts_multiply():
    one = expected_cost(plan_of({"kind": "spectral_mlp", "epochs": 1000}), {})
    more = expected_cost(plan_of({"kind": "spectral_mlp", "epochs": 2000}, count=4), {})
    assert (one.runs, one.from_table) == (2, 2)
    assert 3.8 < more.seconds / one.seconds <= 4.0
    gp = expected_cost(plan_of({"kind": "exact_gp"}, data={"volume": "moderate"}), {})
    assert gp.peak_bytes > one.peak_bytes
    assert gp.seconds > 100 * one.seconds / 2  # n^3 against n


def test_finished_runs_replace_the_table():
    plan = plan_of({"kind": "point_mass"}, count=4)
    first = plan.runs[0].id
    found = expected_cost(plan, {first: {"cost_total_s": 7.0, "cost_peak_bytes": 5}})
    assert (found.runs, found.measured_here, found.from_table) == (3, 3, 0)
    assert found.seconds == pytest.approx(21.0)
    assert "3 by finished runs here" in found.sentence()


def test_an_estimate_of_a_real_run_is_of_the_right_size(tmp_path):
    """Within a factor of ten in processor time: machines differ, a unit slip is a thousand."""
    from unmodeled.pipeline.sweep.runner import PlainRunner

    plan = plan_of({"kind": "spectral_mlp", "epochs": 200}, count=1)
    (result,) = PlainRunner()(plan.runs)
    ratio = result.values["cost_cpu_s"] / expected_cost(plan, {}).seconds
    assert 0.1 < ratio < 10
