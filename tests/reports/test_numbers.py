"""Numbers for people, at their edges."""

from __future__ import annotations

import math

import pytest

from unmodeled.reports.numbers import engineering, number, power_of_ten, seconds_text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (math.nan, "–"),
        (-math.inf, "−∞"),
        (0.000999, "0.0010"),
        (0.00999, "0.010"),
        (9.99, "10"),
        (99_949.0, "1.0e5"),
        (-0.5, "-0.50"),
        (5e-324, "4.9e-324"),
    ],
)
def test_number(value, text):
    assert number(value) == text


@pytest.mark.parametrize("size", [0.0, math.inf, math.nan])
def test_engineering_without_a_size(size):
    assert engineering(size) == (1.0, "")


@pytest.mark.parametrize("size", [1e-20, 2e-9, 1e-6, 999.0, 1000.0, 3e14])
def test_engineering_scales_back(size):
    factor, _ = engineering(size)
    assert size * factor >= 0.99 or factor == 1e15
    assert size * factor < 1000 or factor == 1e-9


def test_power_of_ten():
    assert power_of_ten(0) == "10⁰"


def test_seconds_that_are_unknown():
    assert seconds_text(math.nan) == "–"
