import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from unmodeled.core.errors import ConfigError
from unmodeled.core.units import NORMALISED_GM, NormalisedUnits

BENNU = {"gm": 4.89, "radius": 290.0}


def test_bennu_by_hand():
    # 2 pi sqrt(290^3 / 4.89) s; one unit of acceleration is gm / (4 pi^2 radius^2).
    u = NormalisedUnits.of_body(**BENNU)
    assert u.length == 290.0
    assert u.time == pytest.approx(14032.0, rel=5e-5)
    assert u.acceleration == pytest.approx(4.89 / (4 * math.pi**2 * 290.0**2), rel=1e-15)
    assert u.velocity == pytest.approx(290.0 / u.time, rel=1e-15)


@given(st.floats(1e-3, 1e20), st.floats(1.0, 1e9))
def test_gm_becomes_4_pi_squared(gm, radius):
    u = NormalisedUnits.of_body(gm, radius)
    # a handful of roundings of 1.1e-16 each
    assert gm * u.time**2 / u.length**3 == pytest.approx(NORMALISED_GM, rel=1e-14)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_refusals(value):
    with pytest.raises(ConfigError) as caught:
        NormalisedUnits.of_body(gm=value, radius=1.0)
    assert str(caught.value) == f"gm is {value}. Allowed: a number > 0."
    with pytest.raises(ConfigError) as caught:
        NormalisedUnits.of_body(gm=1.0, radius=value)
    assert str(caught.value) == f"radius is {value}. Allowed: a number > 0."
    with pytest.raises(ConfigError) as caught:
        NormalisedUnits(length=1.0, time=value)
    assert str(caught.value) == f"normalised unit of time is {value}. Allowed: a number > 0."
