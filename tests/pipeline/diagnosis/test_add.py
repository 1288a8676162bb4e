"""Adding one effect: the error falls as the truth demands, and the next case file says the same."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pydantic
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.cases.load_case import load_case
from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate
from unmodeled.pipeline.cases.simulated_files import simulate_case
from unmodeled.pipeline.cases.write_case import write_case
from unmodeled.pipeline.diagnosis.add_effect import add, addable, unit_of
from unmodeled.pipeline.diagnosis.next_case import moved, next_case
from unmodeled.pipeline.diagnosis.schema import AdditionJson, as_text, json_schema

STRENGTH = 400.0


@pytest.fixture(scope="module")
def simulated():
    return simulate("bennu", 5, [HiddenEffect("srp", noncentrality=STRENGTH)], held_out=True)


@pytest.fixture(scope="module")
def added(simulated):
    return add(simulated.case, "srp")


def test_the_hidden_effect_is_estimated_and_the_error_falls_to_the_noise(simulated, added):
    (estimate,) = added.estimates
    truth = simulated.truth["srp"]["srp_CrA_m"]
    assert abs(estimate.value - truth) < 4 * estimate.sigma
    # The best test's mean fall of chi-square is its non-centrality plus one, its variance
    # 4 lambda + 2: five sigmas of it.
    spread = math.sqrt(4 * STRENGTH + 2)
    assert added.delta_chi_square == pytest.approx(STRENGTH + 1, abs=5 * spread)
    # 1296 components: the RMS of pure noise scatters by 2 %.
    assert added.rms_after == pytest.approx(1.0, abs=0.08)
    assert added.rms_before > 1.08
    assert added.held_out_after < added.held_out_before


def test_the_sigma_is_that_of_the_strength(simulated, added):
    """Non-centrality is the squared true size over the variance of its estimate."""
    noise = math.sqrt(added.final_fit.cost / added.final_fit.freedom)
    sigma = added.estimates[0].sigma / noise
    truth = simulated.truth["srp"]["srp_CrA_m"]
    assert (truth / sigma) ** 2 == pytest.approx(STRENGTH, rel=0.02)


def test_rms_in_si_is_sigma_times_rms_in_sigmas(added):
    (row,) = added.rms().to_dict(orient="records")
    assert (row["label"], row["unit"], row["count"]) == ("positions", "m", 1296)
    assert row["before"] == pytest.approx(0.5 * row["before_in_sigmas"], rel=1e-12)
    assert row["after_in_sigmas"] == pytest.approx(added.rms_after, rel=1e-12)


def test_the_next_case_file_gives_the_same_fit(tmp_path):
    path = simulate_case(
        "bennu", [HiddenEffect("zonal_5", noncentrality=300.0)], seed=6, folder=tmp_path / "a"
    )
    addition = add(load_case(path), "zonal_5")
    (tmp_path / "b").mkdir()
    target = tmp_path / "b" / "next.yaml"
    write_case(moved(addition.source, path.parent, target.parent), target)
    again = load_case(target)
    fit = again.fit()
    assert fit.cost == pytest.approx(addition.final_fit.cost, rel=1e-9)
    assert fit.values["J5"] == pytest.approx(addition.estimates[0].value, rel=1e-6)
    with pytest.raises(ConfigError, match="has zonal_5 already: J5 is free in it"):
        add(again, "zonal_5")


def test_an_error_of_a_value_in_the_model_is_added_to_its_entry(simulated):
    case = simulated.case
    candidate = next(c for c in case.candidates if c.name == "zonal_3")
    fitted = case.with_effect(candidate, {"J3": 1e-3}, {"J3": None})
    entry = next(e for e in next_case(fitted, [candidate])["known"] if e["effect"] == "zonal")
    assert entry["values"]["J3"] == 1e-3
    assert entry["free"] == {"J3": None}
    assert case.source["known"] != next_case(fitted, [candidate])["known"]


def test_a_manoeuvre_is_found_in_time():
    hidden = HiddenEffect("manoeuvre", noncentrality=600.0)
    simulated = simulate("bennu", 8, [hidden])
    addition = add(simulated.case, "manoeuvre")
    epoch = addition.final_fit.values["manoeuvre1_t0"]
    candidate = addition.candidate
    step = np.diff([p["manoeuvre1_t0"] for p in candidate.places[:2]])[0]
    assert abs(epoch - simulated.truth["manoeuvre"]["manoeuvre1_t0"]) < 3 * step
    assert addition.rms_after == pytest.approx(1.0, abs=0.08)
    free = next_case(addition.final_case, [candidate])["known"][-1]["free"]
    assert free["manoeuvre1_t0"].endswith(" s")  # stays near where it was found
    assert free["manoeuvre1_dv_R"] is None


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        ("third_body_sun", "the model of bennu-5 has third_body_sun already"),
        ("point_mass", "the model of bennu-5 has point_mass already"),
        ("zonal5", 'there is no effect "zonal5" for bennu-5. Did you mean "zonal_5"?'),
    ],
)
def test_what_cannot_be_added(simulated, effect, words):
    with pytest.raises(ConfigError) as error:
        add(simulated.case, effect)
    assert words in str(error.value)


def test_the_whole_catalogue_can_be_added_not_only_the_listed(simulated):
    short = replace(simulated.case, candidates=simulated.case.candidates[:1])
    assert {c.name for c in addable(short)} == {c.name for c in simulated.case.candidates}


@pytest.mark.parametrize("listed", [["srp", "zonal_5"], {"exclude": ["srp", "zonal_5"]}])
def test_what_is_in_the_model_leaves_the_lists_of_candidates(added, listed):
    source = {**added.final_case.source, "candidates": listed}
    content = next_case(replace(added.final_case, source=source), [added.candidate])
    kept = content["candidates"]
    assert (kept if isinstance(kept, list) else kept["exclude"]) == ["zonal_5"]


def test_files_beside_the_case_are_found_from_its_new_folder(tmp_path):
    old, new = tmp_path / "a", tmp_path / "runs" / "b"
    old.mkdir()
    new.mkdir(parents=True)
    (old / "p.csv").write_text("x")
    content = {
        "body": "bennu",
        "known": [{"effect": "point_mass"}],
        "measurements": [{"file": "p.csv"}, {"file": "elsewhere.csv"}],
    }
    fresh = moved(content, old, new)
    names = [m["file"] for m in fresh["measurements"]]
    assert (new / names[0]).resolve() == (old / "p.csv").resolve()
    assert names[1] == "elsewhere.csv"
    assert fresh["body"] == "bennu"
    assert content["measurements"][0]["file"] == "p.csv"
    assert moved(content, old, old)["measurements"][0]["file"] == "p.csv"


def test_units_of_components():
    assert unit_of("range_rate", "range_rate") == unit_of("position_velocity", "vz") == "m/s"
    assert unit_of("position", "z") == unit_of("range", "range") == "m"


def test_the_json_is_what_the_schema_says(added):
    content = json.loads(as_text("add", added.as_json()))
    assert content["effect"] == "srp"
    assert content["parameters"][0]["unit"] == "m2 kg-1"
    assert content["residual_rms_after"] == added.rms_after
    with pytest.raises(pydantic.ValidationError, match="Extra inputs"):
        AdditionJson.model_validate({**added.as_json(), "more": 1})


def test_nan_is_null_in_json(added):
    content = added.as_json()
    content["parameters"][0]["sigma"] = math.nan
    assert json.loads(as_text("add", content))["parameters"][0]["sigma"] is None


@pytest.mark.parametrize("command", ["add", "compare", "diagnose"])
def test_schemas_forbid_more_than_they_describe(command):
    schema = json_schema(command)
    assert schema["additionalProperties"] is False
    assert all(part["additionalProperties"] is False for part in schema["$defs"].values())


def test_a_command_without_schema():
    with pytest.raises(ConfigError, match='no schema for "simulate"'):
        json_schema("simulate")


def test_next_case_does_not_change_the_source(simulated, added):
    assert Path(str(simulated.case.source["measurements"][0]["file"])).name == "positions.csv"
    assert all(e["effect"] != "solar_radiation_pressure" for e in simulated.case.source["known"])
    assert added.source["known"][-1]["effect"] == "solar_radiation_pressure"
