"""Hidden effects, end to end: found, added, the error falls; and what is not there is not found."""

import json
from dataclasses import replace

import numpy as np
import pytest

from unmodeled.pipeline.cases.simulate_case import HiddenEffect, simulate
from unmodeled.pipeline.diagnosis.diagnose import diagnose
from unmodeled.pipeline.diagnosis.schema import as_text


def test_one_effect_is_found_and_the_error_falls():
    made = simulate("bennu", 7, [HiddenEffect("srp", noncentrality=3000.0)], held_out=True)
    answer = diagnose(made.case)
    (finding,) = answer.findings
    assert "srp" in finding.class_names
    (estimate,) = [e for e in finding.estimates if e.name == "srp_CrA_m"]
    assert abs(estimate.value - made.truth["srp"]["srp_CrA_m"]) < 3 * estimate.sigma
    assert finding.drop == pytest.approx(3000, rel=0.15)
    first, last = answer.steps[0], answer.steps[-1]
    assert first.rms > 1.5
    assert last.rms == pytest.approx(1.0, abs=0.05)
    assert last.held_out_rms == pytest.approx(1.0, abs=0.15)
    assert first.held_out_rms > last.held_out_rms
    # The final case is the model with what was found: nothing is left in it.
    assert diagnose(answer.final_case).verdict == "nothing missing"


def test_nothing_missing_says_what_would_have_been_seen():
    case = simulate("bennu", 8).case
    answer = diagnose(case)
    assert answer.verdict == "nothing missing"
    assert answer.findings == ()
    assert answer.noise == pytest.approx(1.0, abs=0.06)
    seen = answer.candidates.set_index("name")["smallest_detectable"]
    # An effect of that size is found nine times in ten: twice the size always.
    made = simulate("bennu", 8, [HiddenEffect("srp", values={"srp_CrA_m": 2 * seen["srp"]})])
    assert "srp" in diagnose(made.case).findings[0].class_names


def test_two_effects_at_once_with_noise_twice_as_stated():
    hidden = [
        HiddenEffect("srp", noncentrality=4000.0),
        HiddenEffect("tesseral_2_2", noncentrality=1000.0),
    ]
    made = simulate("bennu", 9, hidden, noise_factor=2.0)
    answer = diagnose(made.case)
    assert {"srp", "tesseral_2_2"} <= {n for f in answer.findings for n in f.class_names}
    assert len(answer.findings) == 2
    assert answer.noise == pytest.approx(2.0, abs=0.12)


def test_where_and_how_large_are_uncertain_together():
    """A decay time that the data hardly know: the amplitude is no surer than it allows."""
    made = simulate("bennu", 1283, [HiddenEffect("thermal_recoil", noncentrality=60.0)])
    few = [c for c in made.case.candidates if c.name in ("thermal_recoil", "zonal_3", "zonal_5")]
    answer = diagnose(replace(made.case, candidates=tuple(few)))
    (finding,) = answer.findings
    (push,) = finding.estimates
    (decay,) = finding.place
    assert (decay.name, decay.unit) == ("recoil_tau", "s")
    truth = made.truth["thermal_recoil"]
    assert push.sigma > 1.2 * answer.final_fit.sigmas["recoil_a_sun"] * answer.noise
    assert abs(push.value - truth["recoil_a_sun"]) < 3 * push.sigma
    assert abs(decay.value - truth["recoil_tau"]) < 3 * max(decay.sigma, decay.expected)
    assert answer.as_json()["found"][0]["place"][0]["name"] == "recoil_tau"


def test_a_force_that_the_catalogue_lacks_is_not_given_a_name():
    made = simulate("heliocentric", 3, [HiddenEffect("whirl", noncentrality=3000.0)])
    answer = diagnose(made.case)
    assert answer.verdict == "outside the catalogue"
    assert answer.remainder_log10_p < -10
    assert "no effect of the catalogue explains" in answer.sentence


def test_same_seed_same_answer_and_a_valid_document():
    made = simulate("bennu", 11, [HiddenEffect("tesseral_2_2", noncentrality=300.0)])
    texts = []
    for _ in range(2):
        content = diagnose(made.case).as_json()
        content["seconds"] = 0.0
        texts.append(json.dumps(content, default=float))
    assert texts[0] == texts[1]
    assert json.loads(as_text("diagnose", content))["verdict"] == content["verdict"]


@pytest.mark.slow
def test_false_alarms_are_within_binomial_limits():
    """40 cases without a hidden effect at a level of 5 %."""
    from dataclasses import replace

    named = 0
    for seed in range(40):
        case = replace(simulate("bennu", 500 + seed).case, false_alarm=0.05, seed=seed)
        named += bool(diagnose(case).findings)
    assert named <= 6  # 99.5 % of binomial(40, 0.05)
    assert np.isfinite(named)
