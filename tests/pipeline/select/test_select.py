"""Statistics against published numbers, and choices on made-up sweeps."""

import json
import math

import numpy as np
import pandas as pd
import pytest

from unmodeled.core.errors import InputError
from unmodeled.pipeline.select.blocks import blocks_of
from unmodeled.pipeline.select.paired import compare_pairs, holm, medians
from unmodeled.pipeline.select.pareto import on_front, pareto
from unmodeled.pipeline.select.ranks import critical_difference, groups_of, rank
from unmodeled.pipeline.select.regimes import regimes_of
from unmodeled.pipeline.select.select import select

#: [Demsar2006] section 3.2.3: mean ranks of four variants of C4.5 on 14 data sets.
DEMSAR = {"C4.5+m+cf": 1.964, "C4.5+m": 2.0, "C4.5+cf": 2.893, "C4.5": 3.143}


def test_groups_of_the_paper():
    """No two differ at 5 % (1.25); at 10 % (1.12) C4.5 is worse than the two with m."""
    mean = pd.Series(DEMSAR)
    at_5, at_10 = (critical_difference(4, 14, alpha) for alpha in (0.05, 0.10))
    assert at_5 == pytest.approx(1.25, abs=0.005)
    assert at_10 == pytest.approx(1.12, abs=0.005)
    assert groups_of(mean, at_5) == (tuple(DEMSAR),)
    assert groups_of(mean, at_10) == (tuple(DEMSAR)[:3], tuple(DEMSAR)[2:])
    assert groups_of(mean, 0.01) == ()


def test_ranks_share_ties():
    blocks = pd.DataFrame({"a": [1.0, 1.0, 3.0], "b": [2.0, 1.0, 2.0], "c": [3.0, 5.0, 1.0]})
    ranks = rank(blocks)
    assert ranks.mean.to_dict() == pytest.approx({"b": 5.5 / 3, "a": 5.5 / 3, "c": 7 / 3})
    assert 0.5 < ranks.p <= 1
    assert math.isnan(rank(blocks[["a", "b"]]).p)


@pytest.mark.parametrize(("k", "q"), [(2, 1.960), (3, 2.343), (5, 2.728), (10, 3.164)])
def test_critical_values_of_table_5(k, q):
    """[Demsar2006] Table 5(a), two-tailed Nemenyi test at 5 %."""
    n = k * (k + 1) / 6
    assert critical_difference(k, n) == pytest.approx(q, abs=1e-3)


def test_holm_as_in_the_manual_of_r():
    """R: p.adjust(c(0.01, 0.02, 0.03, 0.04, 0.05), "holm") is 0.05 0.08 0.09 0.09 0.09."""
    p = np.array([0.03, 0.01, 0.05, 0.02, 0.04])
    assert holm(p) == pytest.approx([0.09, 0.05, 0.09, 0.08, 0.09])
    assert holm(np.array([0.9, 0.8])).tolist() == [1.0, 1.0]


def sweep_table(errors, **columns):
    """One row a learner and problem; errors: learner -> values by problem."""
    rows = []
    for learner, values in errors.items():
        for k, value in enumerate(values):
            extra = {name: column[k] for name, column in columns.items()}
            rows.append(
                {"id": f"{learner}{k}", "initial_condition": k, "learner": learner, "kind": "x"}
                | {name.replace("_", ".", 1): v for name, v in extra.items()}
                | {"extrapolation_median": value, "failure": "" if value < 1e9 else "broke"}
                | {"cost_train_s": 1.0 if learner == "a" else 2.0, "model_bytes": 8}
            )
    return pd.DataFrame(rows)


@pytest.fixture
def errors():
    generator = np.random.default_rng(5)
    base = 10 ** generator.normal(-2, 1, 40)  # problems differ by decades
    return {
        "a": base,
        "b": base * 10 ** generator.normal(0.3, 0.1, 40),
        "c": base * 10 ** generator.normal(0, 0.1, 40),
    }


def test_pairing_sees_what_medians_do_not(errors):
    blocks = blocks_of(sweep_table(errors), "extrapolation_median")
    assert blocks.shape == (40, 3)
    pairs = compare_pairs(blocks).set_index(["better", "worse"])
    row = pairs.loc[("a", "b")]
    assert row["ratio"] == pytest.approx(10**0.3, rel=0.1)
    assert row["share"] > 0.95
    assert row["effect"] > 0.95
    assert row["p_holm"] < 1e-6
    intervals = medians(blocks).set_index("learner")
    assert intervals.loc["a", "high"] > intervals.loc["b", "low"]  # unpaired, they overlap


def test_equal_learners_are_not_told_apart(errors):
    found = select(sweep_table({"a": errors["a"], "c": errors["c"]}))
    (choice,) = found.choices
    assert not choice.sure
    assert "not told apart from" in choice.sentence
    same = select(sweep_table({"a": errors["a"], "b": errors["a"]}))
    pair = same.choices[0].pairs.iloc[0]
    assert (pair["p"], pair["effect"], pair["ratio"]) == (1.0, 0.0, 1.0)


def test_choice_and_words(errors):
    (choice,) = select(sweep_table({"a": errors["a"], "b": errors["b"]})).choices
    assert (choice.winner, choice.sure) == ("a", True)
    assert choice.sentence.startswith("All runs: a, median error ")
    assert "times below b, better on" in choice.sentence
    assert "of 40 problems" in choice.sentence


def test_failures_lose_and_do_not_vanish(errors):
    broken = errors["a"] / 10
    broken[:25] = 1e10
    blocks = blocks_of(sweep_table({"a": broken, "b": errors["b"]}), "extrapolation_median")
    assert np.isinf(blocks["a"]).sum() == 25
    (choice,) = select(sweep_table({"a": broken, "b": errors["b"]})).choices
    assert choice.winner == "b"
    assert math.isinf(medians(blocks).set_index("learner").loc["a", "median"])
    json.dumps(select(sweep_table({"a": broken, "b": errors["b"]})).as_json(), allow_nan=False)


def test_no_skill_is_said():
    (choice,) = select(sweep_table({"a": np.full(20, 1.5), "b": np.full(20, 3.0)})).choices
    assert "an error of 1 is no skill" in choice.sentence


def test_bootstrap_interval_covers_as_often_as_it_says():
    """Median of a lognormal; 400 samples: 95 % within 6 standard errors of 380."""
    generator = np.random.default_rng(0)
    inside = 0
    for k in range(200):
        blocks = pd.DataFrame({"a": np.exp(generator.normal(size=31))})
        row = medians(blocks, seed=k).iloc[0]
        inside += row["low"] <= 1.0 <= row["high"]
    assert abs(inside - 190) < 6 * math.sqrt(200 * 0.95 * 0.05)


def test_regimes(errors):
    noise = [0.0, 0.2, 0.4, 1.0] * 10
    table = sweep_table(errors, noise_state=noise)
    found = regimes_of(table)
    assert list(found) == ["low noise", "high noise"]
    assert set(found["low noise"]["noise.state"]) == {0.0, 0.2}
    volume = ["low"] * 20 + ["moderate"] * 20
    table = sweep_table(errors, noise_state=noise, data_volume=volume)
    assert list(regimes_of(table)) == [
        "low noise, low volume",
        "low noise, high volume",
        "high noise, low volume",
        "high noise, high volume",
    ]
    selection = select(table)
    assert selection["low noise, high volume"].winner in "ac"
    with pytest.raises(InputError, match=r"(?i)did you mean"):
        selection["low noise"]


def test_front():
    values = np.array([[1.0, 9.0], [1.0, 9.0], [0.5, 9.5], [2.0, 9.0]])
    assert on_front(values).tolist() == [True, True, True, False]
    table = sweep_table({"a": np.full(5, 1e-3), "b": np.full(5, 1e-2)})
    assert pareto(table, "extrapolation_median")["front"].tolist() == [True, False]


def test_errors(errors):
    table = sweep_table(errors)
    with pytest.raises(InputError, match="1 learner in the sweep"):
        select(table[table["learner"] == "a"])
    with pytest.raises(InputError, match="Allowed: interpolation_median"):
        select(table, "extrapolation")
    with pytest.raises(InputError, match="several results on one problem"):
        select(pd.concat([table, table]))
    half = table[(table["learner"] == "a") == (table["initial_condition"] < 20)]
    with pytest.raises(InputError, match="no problem has results of every learner"):
        select(half)
    assert len(blocks_of(table.drop(index=[3, 50]), "extrapolation_median")) == 38


def test_worse_than_a_point_mass_is_not_to_be_used(errors):
    ratios = {"a": 0.1, "b": 2.1, "c": 1.9}
    table = sweep_table(errors)
    table = table.assign(extrapolation_over_point_mass=table["learner"].map(ratios))
    table.loc[(table["learner"] == "c") & (table["initial_condition"] < 30), "failure"] = "broke"
    choice = select(table).choices[0]
    said = choice.medians.set_index("learner")["use"].to_dict()
    assert said == {"a": "passes", "b": "do not use", "c": "do not use"}  # c: most fits failed
    assert "do not use, against a bare point mass: b (2.1 times), c (inf times)" in choice.sentence
    table["extrapolation_over_point_mass"] = 300.0
    assert (
        "even so 300 times the error of a bare point mass: do not use"
        in select(table).choices[0].sentence
    )


def test_a_sweep_of_an_older_version_is_not_judged(errors):
    choice = select(sweep_table(errors)).choices[0]
    assert set(choice.medians["use"]) == {"not known"}
    assert "do not use" not in choice.sentence
