import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.sweep.axes import combinations, known_keys, parse_axes, spaced


def text_of(axes):
    with pytest.raises(ConfigError) as caught:
        parse_axes(axes, "a.yaml")
    return str(caught.value)


def test_values():
    axes = parse_axes(
        {
            "noise.state": {"linspace": [0, 1, 11]},
            "noise.acceleration": {"logspace": [1e-3, 1, 4]},
            "seed": {"linspace": [1, 3, 3]},
            "learner": [{"kind": "point_mass"}],
            "data.volume": ["low", "moderate"],
        },
        "a.yaml",
    )
    # the values that a person would write, to the last digit: the ids are made from them
    assert axes["noise.state"] == (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
    assert axes["noise.acceleration"] == (0.001, 0.01, 0.1, 1.0)
    assert axes["seed"] == (1, 2, 3)
    assert all(isinstance(v, int) for v in axes["seed"])
    assert list(axes) == ["noise.state", "noise.acceleration", "seed", "learner", "data.volume"]


def test_spaced_ends_are_values():
    assert spaced("logspace", 2, 8, 3) == (2.0, 4.0, 8.0)
    assert spaced("linspace", -1, 1, 3) == (-1.0, 0.0, 1.0)


def test_product_has_the_last_axis_fastest():
    points = list(combinations({"a": (1, 2), "b": ("x", "y")}))
    assert [(p["a"], p["b"]) for p in points] == [(1, "x"), (1, "y"), (2, "x"), (2, "y")]


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        ({"noise.stat": [1]}, 'a.yaml: unknown axis "noise.stat". Did you mean "noise.state"?'),
        ({"nosie.state": [1]}, 'did you mean "noise.state"?'),
        ({"learners": [1]}, 'unknown axis "learners". Did you mean "learner"?'),
        ({"name": ["a"]}, 'unknown axis "name"'),
        ({"data": [1]}, 'unknown axis "data"'),
        ({"data.other_orbits": [1]}, 'unknown axis "data.other_orbits"'),
        ({"learner.a.b": [1]}, 'unknown axis "learner.a.b"'),
        ({"noise.state": []}, "axis noise.state has no values: the grid is empty"),
        ({"noise.state": 0.1}, "axis noise.state is 0.1. Allowed: a list of values"),
        ({"noise.state": {"linspce": [0, 1, 3]}}, "Allowed: a list of values"),
        ({"noise.state": [0, 0.0]}, "axis noise.state has the value 0.0 twice"),
        ({"noise.state": {"linspace": [0, 1]}}, "Allowed: [first, last, count]"),
        ({"noise.state": {"linspace": [0, 1, 2.5]}}, "Allowed: [first, last, count]"),
        ({"noise.state": {"linspace": [0, float("nan"), 3]}}, "Allowed: [first, last, count]"),
        ({"noise.state": {"linspace": [0, 1, 1]}}, "1 values. Allowed: 2 or more"),
        ({"noise.state": {"linspace": [1, 1, 3]}}, "has the value 1 twice"),
        ({"noise.state": {"logspace": [-3, 0, 4]}}, "give the ends as values, not as exponents"),
        ([1], "axes is [1]"),
    ],
)
def test_errors(axes, expected):
    assert expected.lower() in text_of(axes).lower()


def test_every_section_of_the_configuration_can_vary():
    known = known_keys()
    for key in ("seed", "body", "learner", "data.volume", "noise.unit", "flight.periods"):
        assert key in known
    assert {"data.orbit.eccentricity", "data.ranges.eccentricity"} <= set(known)
    assert not {"name", "learners", "data.ranges"} & set(known)
