"""What a settled search means: verdicts, confidence, imitation."""

from dataclasses import replace

import pytest

from unmodeled.pipeline.diagnosis.judgement import is_imitation, verdict_of, weighed
from unmodeled.pipeline.diagnosis.remainder import Remainder
from unmodeled.pipeline.diagnosis.result import Alternative, Estimate, Finding, Rival

QUIET = Remainder(log_p=-1.0, log_p_stated=-1.0, log_p_quiet=-1.0)
FORCE = Remainder(log_p=-40.0, log_p_stated=-40.0, log_p_quiet=-0.1)
COVERED = Remainder(log_p=-40.0, log_p_stated=-40.0, log_p_quiet=-40.0)


def finding(name, pull=None, rivals=()):
    accepted = None if pull is None else 1.0
    estimate = Estimate("x", 1.0, 0.1, "1", 1.0, accepted, pull)
    return Finding(name, name, "test", (estimate,), 90.0, 15.0, -20.0, 30.0, rivals, 0.8, None, 1.0)


UNKNOWN = [finding(n) for n in "abcd"]


def test_four_effects_that_nobody_knows_imitate_one():
    assert is_imitation(UNKNOWN)
    assert not is_imitation(UNKNOWN[:3])
    assert verdict_of(UNKNOWN, (), QUIET) == "outside the catalogue"


def test_effects_at_their_accepted_values_are_believed_however_many():
    known = [finding(n, pull=1.2) for n in ("moon", "sun", "tide", "relativity")]
    assert not is_imitation([*known, *UNKNOWN[:3]])
    assert is_imitation([finding("moon", pull=5.0), *UNKNOWN[:3]])
    assert verdict_of(known, (), QUIET) == "found"


@pytest.mark.parametrize(
    ("findings", "others", "remainder", "verdict"),
    [
        ([], (), QUIET, "nothing missing"),
        ([], (), FORCE, "outside the catalogue"),
        ([], (), COVERED, "nothing missing"),
        ([finding("a")], (), COVERED, "found"),
        ([finding("a")], (Alternative(("b", "c"), ("b", "c"), 3.0, 90.0),), QUIET, "ambiguous"),
        ([finding("a", rivals=(Rival("b", "b", 0.99, 2.0, 0.6),))], (), QUIET, "ambiguous"),
    ],
)
def test_verdicts(findings, others, remainder, verdict):
    assert verdict_of(findings, others, remainder) == verdict


def test_sets_that_do_without_a_finding_lower_its_confidence():
    other = Alternative(("b", "c"), ("b", "c"), 2.0, 90.0)
    assert weighed(finding("a"), (other,)).confidence == pytest.approx(1 / (1 / 0.8 + 0.5))
    assert weighed(finding("b"), (other,)).confidence == pytest.approx(0.8)
    certain = replace(finding("a"), confidence=1.0)
    assert weighed(certain, ()).confidence == 1.0
