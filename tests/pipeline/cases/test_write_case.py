"""Every effect of the catalogue can be added to a case file and read back."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.cases.load_case import case_from_mapping, load_case
from unmodeled.pipeline.cases.simulate_case import simulate
from unmodeled.pipeline.cases.write_case import add_to_source, write_case
from unmodeled.pipeline.yaml12 import read_yaml


@pytest.fixture(scope="module", params=["bennu", "leo_tracking", "heliocentric"])
def simulated(request):
    return simulate(request.param, 1)


def test_every_candidate_added_written_and_read_is_the_same_model(simulated, tmp_path):
    case = simulated.case
    assert len(case.candidates) >= 10
    for number, candidate in enumerate(case.candidates):
        values = {n: 0.5 * p for n, p in zip(candidate.estimate, candidate.priors, strict=True)}
        values |= candidate.places[0] if candidate.places else {}
        sigmas = {n: 2.0 * p for n, p in zip(candidate.estimate, candidate.priors, strict=True)}
        path = write_case(
            add_to_source(case.source, candidate, values, sigmas), tmp_path / f"{number}.yaml"
        )
        read = case_from_mapping(read_yaml(path), data=simulated.data)
        assert dict(read.estimate) == {**case.estimate, **sigmas}, candidate.name
        if candidate.is_force:
            wanted = {**candidate.values, **case.dynamics.values, **values}
            found = read.dynamics.values
            assert {k: v for k, v in wanted.items() if found.get(k) != v} == {}, candidate.name
            known = set(candidate.estimate) <= set(case.dynamics.values)
            assert known or candidate.effect in read.dynamics.effects
        else:
            assert read.instruments == (candidate.effect,)
            assert dict(read.instrument_values) == {**candidate.values, **values}


def test_a_second_addition_keeps_the_first():
    sim = simulate("heliocentric", 1)
    first, second = (
        next(c for c in sim.case.candidates if c.name == f"nongravitational_{k}")
        for k in ("A1", "A2")
    )
    source = add_to_source(sim.case.source, first, {"A1": 3e-12}, {"A1": None})
    source = add_to_source(source, second, {"A2": 4e-14}, {"A2": 1e-13})
    case = case_from_mapping(source, data=sim.data)
    assert [e.name for e in case.dynamics.effects].count("nongravitational_a123") == 1
    assert case.dynamics.values["A1"] == 3e-12
    assert case.dynamics.values["A2"] == 4e-14
    assert case.estimate == {"A1": None, "A2": 1e-13}
    assert (
        sim.case.source["known"]
        == case_from_mapping(sim.case.source, data=sim.data).source["known"]
    )  # the first content was not changed


def test_a_case_file_is_read_back_as_it_was(tmp_path):
    sim = simulate("bennu", 2)
    path = write_case(sim.case.source, tmp_path / "case.yaml")
    assert read_yaml(path) == dict(sim.case.source)
    again = case_from_mapping(read_yaml(path), data=sim.data)
    assert again.dynamics.values == sim.case.dynamics.values
    np.testing.assert_array_equal(again.arcs[0].state, sim.case.arcs[0].state)
    assert [f.name for f in tmp_path.iterdir()] == ["case.yaml"]


def test_a_file_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(ConfigError, match="cannot be written"):
        write_case({"name": "x"}, tmp_path / "missing" / "case.yaml")
    with pytest.raises(ConfigError, match="no file"):
        load_case(tmp_path / "missing" / "case.yaml")
