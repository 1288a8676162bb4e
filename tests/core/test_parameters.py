import dataclasses
import math

import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter


def test_a_new_value_leaves_the_old_object_alone():
    p = Parameter("J2", unit="1", value=0.5, scale=1e-3, lower=0.0, upper=1.0)
    q = p.with_value(1)
    assert (p.value, q.value) == (0.5, 1.0)
    assert type(q.value) is float
    assert dataclasses.replace(q, value=0.5) == p
    assert hash(dataclasses.replace(q, value=0.5)) == hash(p)
    with pytest.raises(dataclasses.FrozenInstanceError):
        p.value = 2.0


def test_bounds_are_inclusive():
    p = Parameter("e", unit="1", lower=0.0, upper=1.0)
    assert p.with_value(0.0).value == 0.0
    assert p.with_value(1.0).value == 1.0


@pytest.mark.parametrize("value", [-0.1, 1.1, math.nan, math.inf])
def test_value_out_of_bounds(value):
    with pytest.raises(ConfigError) as caught:
        Parameter("e", unit="m", value=value, lower=0.0, upper=1.0)
    assert str(caught.value) == f"parameter e = {value} m. Allowed: 0.0 to 1.0 m."


@pytest.mark.parametrize("scale", [0.0, -1.0, math.nan])
def test_scale_must_be_positive(scale):
    with pytest.raises(ConfigError) as caught:
        Parameter("e", unit="m", scale=scale)
    assert str(caught.value) == f"parameter e has scale {scale}. Allowed: scale > 0."
