"""What is wrong in a case file is said, with what is allowed."""

import copy

import pytest

from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.pipeline.cases.case_config import CaseConfig, parse_vector
from unmodeled.pipeline.cases.load_case import case_from_mapping


def changed(mapping, path, value):
    """The mapping with one value replaced; a path is keys and places in lists."""
    out = copy.deepcopy(mapping)
    inner = out
    for key in path[:-1]:
        inner = inner[key]
    if value is KeyError:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return out


FIRST = ("measurements", 0)


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (("frmae",), "icrf", 'unknown key "frmae", did you mean "frame"?'),
        ((*FIRST, "sgima"), 1, 'unknown key "measurements.0.sgima", did you mean "sigma"?'),
        (("known",), KeyError, 'missing key "known"'),
        (("frame",), "j2000", "frame is 'j2000'"),
        (("epoch",), "2019-01-01T00:00:00", 'Write it like "2016-03-13T00:00:00 UTC"'),
        (("epoch",), "2019-01-01T00:00:00 TBD", 'Did you mean "TDB"?'),
        (("body",), "benu", 'Did you mean "bennu"?'),
        ((*FIRST, "sigma"), KeyError, "sigma of positions.csv is not stated"),
        ((*FIRST, "sigma"), "0.5 s", "sigma of positions.csv is 0.5 s. Allowed: a length"),
        ((*FIRST, "sigma"), 0.5, "without a unit"),
        ((*FIRST, "sigma"), "-1 m", "Allowed: a number > 0"),
        ((*FIRST, "sigma"), ["1 m", "1 m"], "has 2 values. Allowed: one value"),
        ((*FIRST, "kind"), "postion", "measurements.0.kind is 'postion'"),
        ((*FIRST, "station"), "DSS-14", 'the station "DSS-14" of positions.csv is not described'),
        ((*FIRST, "file"), "none.csv", "there is no measurement file none.csv"),
        ((*FIRST, "frame"), "itrf", "the body is bennu. Allowed: ICRF, EME2000, body_equator"),
        ((*FIRST, "frame"), "icrs2", 'frame "icrs2"'),
        ((*FIRST, "time_scale"), "UCT", 'time scale "UCT"'),
        (("stations",), {"a": {"latitude": "3 deg"}}, "a station needs its place"),
        (
            ("stations",),
            {"a": {"latitude": "3 m", "longitude": "1 deg", "height": "0 m"}},
            "stations.a.latitude is 3 m. Allowed: an angle",
        ),
        (("spacecraft",), {"mass": "12 m2", "area": "12 m2"}, "Allowed: a mass, e.g. 1500 kg"),
        (("spacecraft",), {"mass": "0 kg", "area": "12 m2"}, "spacecraft mass is 0.0"),
        (("false_alarm",), 0.7, "false_alarm is 0.7"),
        (("candidates",), ["spr"], "there is no candidate"),
        (("ephemeris",), "circular", "Allowed: circular for the Earth only"),
        (("arcs",), {"length": "1 d", "held_out": [9]}, "arcs.held_out is [9]"),
        (("arcs",), {"length": "9 d", "held_out": [1]}, "every arc is held out"),
        (("arcs",), {"length": "0 d"}, "arcs.length is 0 d. Allowed: a time > 0"),
        (("arcs",), [{"start": "9 d", "end": "10 d"}], "arc 1 from 777600 s to 864000 s has no"),
        (("arcs",), [{"start": "1 d", "end": "0 d"}], "arc 1 ends at 0 s and starts at 86400 s"),
        (("arcs",), [{"start": "0 d", "end": "1 d", "rol": "fit"}], 'unknown key "arcs.0.rol'),
        (("initial_state",), {"position": "1, 2 m", "velocity": "0, 0, 0 m/s"}, "three values"),
    ],
)
def test_a_wrong_case_is_refused(mapping, folder, path, value, text):
    with pytest.raises(InputError) as caught:
        case_from_mapping(changed(mapping, path, value), folder)
    assert text in str(caught.value)


def test_the_earth_needs_icrf(mapping):
    earth = changed(mapping, ("body",), "earth")
    with pytest.raises(ConfigError, match="frame is body_equator and the body is the Earth"):
        case_from_mapping(earth)


def test_two_sets_of_one_name(mapping):
    mapping["measurements"] *= 2
    with pytest.raises(ConfigError, match="Give each its own label"):
        CaseConfig.resolve({**mapping})


def test_sigma_stated_twice_is_refused(mapping, folder):
    twice = changed(mapping, (*FIRST, "file"), "with-sigma.csv")
    with pytest.raises(DataError, match="sigma is stated twice"):
        case_from_mapping(twice, folder)


def test_vectors():
    assert parse_vector("1, 2, 3 km", "m", "p") == [1e3, 2e3, 3e3]
    assert parse_vector(["1 km", "2 m", "3 m"], "m", "p") == [1e3, 2.0, 3.0]
    with pytest.raises(ConfigError, match="p is '1 km'"):
        parse_vector("1 km", "m", "p")
    with pytest.raises(ConfigError, match="without a unit"):
        parse_vector("1, 2, 3", "m", "p")
