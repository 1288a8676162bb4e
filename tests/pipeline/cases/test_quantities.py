"""Units in case files."""

import math

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.cases.quantities import parse_quantity, write_quantity


@pytest.mark.parametrize(
    ("given", "unit", "value"),
    [
        ("0.5 km", "m", 500.0),
        ("1 d", "s", 86_400.0),
        ("12 m2", "m2", 12.0),
        ("4.89 m3/s2", "m3 s-2", 4.89),
        ("398600.4415 km3/s2", "m3 s-2", 3.986004415e14),
        ("180 deg", "rad", math.pi),
        ("0.3 mm/s", "m s-1", 3e-4),
        ("-4.56e-14 au/d2", "m s-2", -4.56e-14 * 149_597_870_700.0 / 86_400.0**2),
        (".5m", "m", 0.5),
        (2, "1", 2.0),
        ("2 %", "1", 0.02),
    ],
)
def test_units_are_converted_to_si(given, unit, value):
    assert parse_quantity(given, unit, "x") == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("value", np.random.default_rng(1).normal(size=5) * 1e-9)
@pytest.mark.parametrize("unit", ["m", "m3 s-2", "1", "kg m-3"])
def test_what_is_written_is_read_to_the_last_digit(value, unit):
    assert parse_quantity(write_quantity(value, unit), unit, "x") == value


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("0.5 s", "sigma is 0.5 s. Allowed: a length, e.g. 0.5 m."),
        (0.5, "sigma is 0.5 without a unit. Allowed: a length, e.g. 0.5 m. Write the unit."),
        ("0.5 furlong", 'sigma is "0.5 furlong": unknown unit "furlong"'),
        ("half a metre", "sigma is 'half a metre'. Allowed: a length"),
        (True, "sigma is True"),
        (None, "sigma is None"),
        (float("nan"), "sigma is nan"),
    ],
)
def test_what_is_wrong_is_said(given, text):
    with pytest.raises(ConfigError, match="sigma") as caught:
        parse_quantity(given, "m", "sigma")
    assert str(caught.value).startswith(text)
