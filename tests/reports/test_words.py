"""Every rule of the words, on made-up numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from unmodeled.datasets.noise import Noise
from unmodeled.pipeline.metrics import Calibration, ErrorSummary, summarize
from unmodeled.pipeline.results import LearnerResult
from unmodeled.reports.data_words import elsewhere, noise_sentence
from unmodeled.reports.words import (
    calibration_sentence,
    learner_sentence,
    overview,
    summary_words,
    verdict,
)


def flat(median: float, count: int = 100, failures: int = 0) -> ErrorSummary:
    return ErrorSummary(count, failures, *[median] * 6)


def three(train: float, interpolation: float, extrapolation: float) -> dict[str, ErrorSummary]:
    return {
        "train": flat(train),
        "interpolation": flat(interpolation),
        "extrapolation": flat(extrapolation),
    }


POINT_MASS = three(0.004, 0.004, 0.005)


def learner(*medians: float, kind: str = "exact_gp", label: str = "gp") -> LearnerResult:
    return LearnerResult(label, kind, "none", summaries=three(*medians))


def test_the_whole_sentence():
    assert learner_sentence(learner(1.9e-5, 2.1e-5, 0.49), POINT_MASS) == (
        "gp: safe on its own orbit (interpolation median 2.1e-5, 1.1 times the training error) but "
        "not robust: on other orbits 0.49, 4.4 decades worse, and 98 times worse than a bare point "
        "mass. Do not use it off its training orbit: the bare point mass, which learns nothing, "
        "has 0.0050 on other orbits."
    )


@pytest.mark.parametrize(
    ("medians", "safety"),
    [
        ((1e-5, 2.9e-5, 1e-4), "safe"),
        ((1e-5, 3.1e-5, 1e-4), "less safe"),  # more than three times the training error
        ((0.01, 0.01, 0.1), "not safe"),  # equal errors, but worse than a point mass
        ((0.0, 0.01, 0.1), "not safe"),
        ((1e-16, 9e-13, 1e-9), "safe"),  # rounding against rounding
        ((1e-5, np.inf, np.inf), "not safe"),
    ],
)
def test_safety(medians, safety):
    assert verdict(three(*medians), POINT_MASS).safety == safety


@pytest.mark.parametrize(
    ("medians", "robustness"),
    [
        ((1e-4, 1e-4, 3.1e-4), "robust"),
        ((1e-4, 1e-4, 3.2e-4), "moderately robust"),
        ((1e-4, 1e-4, 3.2e-3), "not robust"),
        ((1e-4, 1e-4, np.inf), "not robust"),
        ((1e-4, np.inf, np.inf), "not robust"),
        ((1e-16, 1e-16, 8e-13), "robust"),
        ((1e-4, 1e-4, 1e-5), "robust"),
    ],
)
def test_robustness(medians, robustness):
    assert verdict(three(*medians), POINT_MASS).robustness == robustness


@pytest.mark.parametrize(
    ("extrapolation", "words", "unfit"),
    [
        (0.0101, "2.0 times worse than a bare point mass", True),
        (0.0099, "2.0 times worse than a bare point mass", False),
        (0.005, "no better than a bare point mass", False),
        (0.001, "5.0 times better than a bare point mass", False),
        (np.inf, "without a finite error to compare with a bare point mass", True),
    ],
)
def test_against_the_point_mass(extrapolation, words, unfit):
    text = learner_sentence(learner(1e-4, 1e-4, extrapolation), POINT_MASS)
    assert words in text
    assert ("Do not use it off its training orbit" in text) == unfit


def test_robust_but_useless_is_said():
    text = learner_sentence(learner(3e-3, 3e-3, 6e-3), POINT_MASS)
    assert "and robust: on other orbits 0.0060, 0.3 decades worse, yet 1.2 times worse" in text


def test_fragile_but_useful_is_said():
    text = learner_sentence(learner(1e-9, 1e-9, 1e-6), POINT_MASS)
    assert "but not robust: on other orbits 1.0e-6, 3.0 decades worse, yet 5000 times" in text


def test_moderately_robust():
    text = learner_sentence(learner(1e-4, 1e-4, 1e-3), POINT_MASS)
    assert "but only moderately robust: on other orbits 0.0010, 1.0 decades worse, yet 5.0" in text


def test_better_elsewhere_is_no_worse():
    assert "no worse" in learner_sentence(learner(1e-3, 1e-3, 1e-3), POINT_MASS)
    assert "1.0 decades better" in learner_sentence(learner(1e-3, 1e-3, 1e-4), POINT_MASS)


def test_memorised_samples():
    text = learner_sentence(learner(0.0, 1e-3, 1e-3), POINT_MASS)
    assert "though it repeats its training samples exactly" in text


def test_rounding_level():
    text = learner_sentence(learner(5e-16, 6e-16, 6e-16, kind="zonal_oracle"), POINT_MASS)
    assert "like the training error at rounding level" in text
    assert "a bound, not a candidate" in text


def test_failure_is_named():
    broken = LearnerResult("gp", "exact_gp", "none", failure="not positive definite.")
    assert learner_sentence(broken, POINT_MASS) == (
        "gp: the fit failed (not positive definite); nothing to judge."
    )


def test_predictions_that_are_not_finite_are_counted():
    bad = learner(1e-4, 1e-4, 1e-3)
    summaries = bad.summaries | {"extrapolation": flat(1e-3, 100, 7)}
    text = learner_sentence(replace(bad, summaries=summaries), POINT_MASS)
    assert "7 of its 300 predictions are not finite." in text


def test_yardstick():
    text = learner_sentence(learner(0.004, 0.004, 0.005, kind="point_mass"), POINT_MASS)
    assert "the yardstick; it learns nothing" in text


@pytest.mark.parametrize(
    ("coverage", "count", "word"),
    [
        ((0.68, 0.95), 1000, "well calibrated"),
        ((0.50, 0.95), 1000, "over-confident"),
        ((0.68, 0.85), 1000, "over-confident"),
        ((0.90, 0.99), 1000, "cautious"),
        ((0.50, 0.85), 10, "well calibrated"),  # ten samples cannot tell
        ((0.05, 0.10), 10, "over-confident"),
    ],
)
def test_calibration(coverage, count, word):
    c = Calibration(0.0, *coverage, 1.0)
    both = {"interpolation": c, "extrapolation": c}
    counts = dict.fromkeys(both, count)
    assert f"is {word} in interpolation" in calibration_sentence("gp", both, counts)


def test_noise_in_si_and_share(result):
    assert noise_sentence(result) == "No noise was added. Errors are counted from the truth."
    noisy = replace(result, data=replace(result.data, noise=Noise(0.01, 0.0)))
    assert "2.9 m in position (0.5" in noise_sentence(noisy)
    noisy = replace(result, data=replace(result.data, noise=Noise(0.0, 0.1, "consistent")))
    text = noise_sentence(noisy)
    assert "1.5e-7 m/s² in acceleration (" in text
    assert "consistent draws" in text


def test_where(result, measured):
    assert elsewhere(result) == "on other orbits"
    assert elsewhere(measured) == "on later revolutions"
    one = replace(result, data=replace(result.data, orbits=result.data.orbits[:2]))
    assert elsewhere(one) == "on another orbit"


def test_few_orbits_are_said(result, measured):
    text = " ".join(summary_words(result))
    assert "2 other orbits over 2 periods" in text
    assert "one training orbit and 2 others these numbers describe these orbits" in text
    assert "later revolutions of the same orbit" in " ".join(summary_words(measured))
    words = " ".join(summary_words(measured))
    assert "orbits that were drawn" not in words
    assert "a mild test of robustness. Give an arc of another orbit as data.extrap" in words


def test_of_measured_data_nobody_knows_the_family():
    oracle = replace(learner(1e-6, 1e-6, 1e-6), kind="zonal_oracle")
    assert "a bound, not a candidate" in learner_sentence(oracle, POINT_MASS)
    words = learner_sentence(oracle, POINT_MASS, simulated=False)
    assert "a bound, not a candidate" not in words


def test_the_error_of_smoothed_accelerations_is_said(measured):
    orbit = measured.data.orbits[0]
    assert "differences below that mean nothing" not in " ".join(summary_words(measured))
    sizes = np.linalg.norm(measured.data.train.accelerations, axis=1)
    sigma = 0.25 * float(np.median(sizes)) * measured.data.units.acceleration
    rough = replace(orbit, acceleration_sigma=sigma)
    data = replace(measured.data, orbits=(rough, *measured.data.orbits[1:]))
    words = " ".join(summary_words(replace(measured, data=data)))
    assert "m/s² (one sigma), 0.25 of the acceleration: differences below that" in words


def test_overview_counts_what_to_avoid(result):
    text = overview(result)
    assert text.startswith("Of 5 learners, harmonic least squares is the most accurate on other")
    assert "Do not use 4 of 5 off the training orbit" in text


def test_overview_without_candidates(result):
    yardsticks = tuple(r for r in result.learners if r.kind == "point_mass")
    assert "No learner was fitted" in overview(replace(result, learners=yardsticks))


def test_overview_when_none_beats_the_point_mass(result):
    worse = summarize(np.full(10, 5.0))
    learners = tuple(
        replace(r, summaries=r.summaries | {"extrapolation": worse}) for r in result.learners
    )
    assert "No learner beats the bare point mass" in overview(replace(result, learners=learners))
