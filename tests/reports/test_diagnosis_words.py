"""Words of a diagnosis."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from unmodeled.pipeline.diagnosis.result import Estimate, Finding, Forecast, Rival, Step
from unmodeled.reports.diagnosis_words import (
    estimate_text,
    finding_sentence,
    noise_sentence,
    remainder_sentence,
    residual_sentence,
    step_label,
)


@pytest.mark.parametrize(
    ("value", "sigma", "unit", "text"),
    [
        (-2.19e-4, 5.4e-5, "1", "(-2.19 ± 0.54)e-4"),
        (3e-9, 5e-8, "m s-2", "(0.3 ± 5.0)e-8 m s-2"),
        (1.32712e20, 3.1e15, "m3 s-2", "(1.327120 ± 0.000031)e20 m3 s-2"),
        (0.0, 0.25, "s", "0.00 ± 0.25 s"),
        (1234.5, 67.0, "m", "1234 ± 67 m"),
        (2.5e-7, math.nan, "rad", "2.5e-07 rad"),
    ],
)
def test_values_carry_two_digits_of_their_sigma(value, sigma, unit, text):
    assert estimate_text(value, sigma, unit) == text


def finding(**more) -> Finding:
    values = {
        "name": "srp",
        "title": "solar radiation pressure",
        "family": "radiation",
        "estimates": (Estimate("srp_CrA_m", 0.01, 0.001, "m2 kg-1", 0.02),),
        "drop": 120.0,
        "threshold": 14.0,
        "log10_p": -26.0,
        "evidence": 50.0,
        "rivals": (),
        "confidence": 1.0,
        "consistency_p": None,
        "largest_change": 0.4,
    }
    return Finding(**(values | more))


def test_a_finding_says_estimate_strength_and_need():
    assert finding_sentence(finding()) == (
        "solar radiation pressure: srp_CrA_m = 0.0100 ± 0.0010 m2 kg-1. Without it chi-square is "
        "120 higher; 14.0 was needed."
    )


def test_a_finding_names_its_rivals_and_remarks():
    rival = Rival("push", "constant push", 0.999, 2.0, 0.6)
    text = finding_sentence(finding(rivals=(rival,), confidence=0.6, remarks=("it is odd",)))
    assert "cannot tell it from: constant push" in text
    assert "probability of 0.60 at most" in text
    assert text.endswith("It is odd.")


@pytest.mark.parametrize(
    ("noise", "words"),
    [(1.02, "stated rightly"), (2.0, "larger than stated"), (0.5, "smaller than stated")],
)
def test_the_noise_in_words(noise, words):
    assert words in noise_sentence(SimpleNamespace(noise=noise, remainder=None))


def test_what_remains_in_words():
    assert "No force is left" in remainder_sentence(SimpleNamespace(remainder_log10_p=-0.2))
    assert "p 1e-12" in remainder_sentence(
        SimpleNamespace(remainder_log10_p=-12.3, within_stated_noise=False)
    )
    assert "the stated noise, which covers it" in remainder_sentence(
        SimpleNamespace(remainder_log10_p=-12.3, within_stated_noise=True)
    )


def test_the_fall_in_words():
    steps = (Step("", 3.1, 2.0), Step("srp", 1.01, 1.02))
    assert residual_sentence(SimpleNamespace(steps=steps, forecast=None)) == (
        "The residual RMS falls from 3.10 to 1.01 σ, on the held-out arcs, which are not fitted, "
        "from 2.00 to 1.02 σ."
    )
    forecast = Forecast(before=2.1, after=1.01, log10_p=-0.3)
    text = residual_sentence(SimpleNamespace(steps=steps, forecast=forecast))
    assert text.endswith("2.10 and 1.01 σ are to be expected there: as seen.")
    surprised = replace(forecast, log10_p=-9.0)
    text = residual_sentence(SimpleNamespace(steps=steps, forecast=surprised))
    assert text.endswith("less than is seen, so the model is not right.")
    assert "nothing was added" in residual_sentence(SimpleNamespace(steps=(Step("", 1.0, None),)))


def test_labels_of_steps():
    titles = {"srp": "solar radiation pressure"}
    assert step_label("", titles) == "model as given"
    assert step_label("nothing for srp", titles) == "- solar radiation pressure"
