"""What no catalogue has, hidden: its kind in words, a model of it, and how far that carries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from unmodeled.core.errors import DataError
from unmodeled.models.learned import PointMassOnly
from unmodeled.pipeline.cases.outside_effects import PulseTrain, Whirl
from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate
from unmodeled.pipeline.diagnosis.diagnose import diagnose
from unmodeled.pipeline.diagnosis.learned_force import LearnedForce
from unmodeled.pipeline.diagnosis.remainder_model import MODEL_FILE, learn_remainder
from unmodeled.pipeline.diagnosis.save import save_diagnosis
from unmodeled.pipeline.diagnosis.schema import DiagnosisJson
from unmodeled.pipeline.linearisation import Linearisation

#: Residuals of about nine sigmas.
STRONG = 1e5
FORCES = {"whirl": Whirl(), "pulse_train": PulseTrain()}


def made(scenario, effect):
    return simulate(scenario, 3, [HiddenEffect(effect, noncentrality=STRONG)], held_out=True)


def learn(simulated):
    case = simulated.case
    fit = case.fit()
    return learn_remainder(Linearisation(case.at(fit), fit))


def true_force(simulated, effect, states, times):
    """Return the hidden acceleration: that of the model with it minus that without."""
    known = simulated.case.dynamics
    full = known.with_effects([*known.effects, FORCES[effect]], simulated.truth[effect])
    return full.acceleration(states, times) - known.acceleration(states, times)


@pytest.fixture(scope="module")
def bennu_pulses():
    simulated = made("bennu", "pulse_train")
    # No candidate at all: the verdict is certain, and what is learned is the hidden force.
    return simulated, diagnose(replace(simulated.case, candidates=()))


@pytest.fixture(scope="module")
def bennu_whirl():
    simulated = made("bennu", "whirl")
    return simulated, learn(simulated)


def test_pulses_have_a_period_of_their_own_and_carry(bennu_pulses):
    simulated, answer = bennu_pulses
    rest = answer.remainder
    assert answer.verdict == "outside the catalogue"
    assert "fixed in space that repeats every" in rest.kind
    assert "a period of its own" in rest.kind
    period = rest.dependence.best.inputs.period
    assert period == pytest.approx(simulated.truth["pulse_train"]["pulse_period"], rel=0.01)
    assert rest.skill[0] == pytest.approx(rest.dependence.possible_skill, abs=0.01)
    assert rest.learned
    assert rest.carries
    assert rest.rms_before > 8
    assert rest.rms_after == pytest.approx(1.0, abs=0.06)
    # Another orbit, a day later, that took no part.
    assert rest.held_out_rms_before > 4
    assert rest.held_out_rms_after == pytest.approx(1.0, abs=0.15)
    assert rest.sentence in answer.sentence
    assert "the held-out error from" in answer.sentence


def test_the_learned_force_is_the_hidden_one_as_far_as_it_is_seen(bennu_pulses):
    simulated, answer = bennu_pulses
    truth = simulated.truth["pulse_train"]
    phase = 2 * np.pi * np.arange(64) / 64
    states = np.repeat(answer.final_case.arcs[0].state[None], 64, axis=0)
    times = phase / (2 * np.pi) * truth["pulse_period"]
    learned = answer.remainder.model.predict(states, times)
    true = true_force(simulated, "pulse_train", states, times)
    first = np.exp(-1j * phase) / 32
    # Answers fall with the square of the frequency: half a metre of noise shows the first
    # harmonic to some per cent, and hides what makes the peak narrow.
    assert np.linalg.norm(first @ (learned - true)) < 0.1 * np.linalg.norm(first @ true)
    assert np.linalg.norm((learned - true).mean(axis=0)) < 0.1 * np.linalg.norm(true.mean(axis=0))


def test_a_whirl_depends_on_place_with_curl_and_does_not_carry(bennu_whirl):
    _, rest = bennu_whirl
    assert rest.kind.startswith("a force that depends on inertial position, with curl")
    assert rest.dependence.best.curl_log_bayes < -10
    assert rest.learned
    assert rest.skill[0] > 0.9
    assert rest.rms_after == pytest.approx(1.0, abs=0.06)
    # The held-out orbit does not come near the place: there is nothing to gain, and it is said.
    assert not rest.carries
    assert "It does not carry to the held-out arcs" in rest.sentence
    assert "use it on these days only" in rest.sentence


def test_about_the_sun_and_beyond_the_moon():
    for scenario, effect, words in (
        ("heliocentric", "pulse_train", "a period of its own"),
        ("cislunar", "whirl", "inertial position, with curl"),
    ):
        rest = learn(made(scenario, effect))
        assert words in rest.kind
        assert rest.learned
        assert rest.rms_after < 0.15 * rest.rms_before


def test_one_pass_of_the_place_is_not_called_a_law():
    # In 548 days the place is passed once: no other stretch tells of it.
    rest = learn(made("heliocentric", "whirl"))
    assert not rest.carries
    assert rest.skill[0] < 0.6


def test_noise_teaches_nothing():
    case = simulate("bennu", 5, held_out=True).case
    fit = case.fit()
    rest = learn_remainder(Linearisation(case.at(fit), fit))
    assert not rest.learned
    assert not rest.carries
    assert "Nothing could be learned that carries" in rest.sentence


def test_files_and_json(bennu_pulses, tmp_path):
    simulated, answer = bennu_pulses
    save_diagnosis(answer, tmp_path, case_folder=tmp_path)
    content = DiagnosisJson.model_validate(answer.as_json()).remainder
    assert content.learner == answer.remainder.learners[0].name
    assert content.inputs == ["cos_phase", "sin_phase"]
    assert content.carries
    assert content.file == MODEL_FILE
    table = pd.read_csv(tmp_path / "remainder-acceleration.csv")
    assert {"t_s", "R_m_s2", "sigma_T_m_s2", "x_m_s2", "learned_N_m_s2"} <= set(table.columns)
    assert np.isfinite(table.drop(columns="arc").to_numpy()).all()
    again = LearnedForce.load(tmp_path / MODEL_FILE, simulated.case)
    arc = simulated.case.arcs[0]
    model = answer.remainder.model
    np.testing.assert_array_equal(
        again.predict(arc.state[None], np.array([100.0])),
        model.predict(arc.state[None], np.array([100.0])),
    )


def test_bad_files_and_shapes(bennu_pulses, tmp_path):
    simulated, answer = bennu_pulses
    learner = PointMassOnly().fit(np.eye(4)[:, :3] + 1.0, np.ones((4, 3)))
    learner.save(tmp_path / "other.safetensors")
    with pytest.raises(DataError, match="without the inputs of a force"):
        LearnedForce.load(tmp_path / "other.safetensors", simulated.case)
    with pytest.raises(DataError, match="2 states and 1 times"):
        answer.remainder.model.predict(np.ones((2, 6)), np.ones(1))


def test_what_is_found_or_nothing_has_no_remainder():
    assert diagnose(simulate("bennu", 8).case).remainder is None
