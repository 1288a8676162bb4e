"""Shapes as known effects and candidates, kernels as measurements, the search for a planet."""

import math

import numpy as np
import pytest
from tests.core.test_ephemeris import kernel
from tests.models.physics.shapes import cube

from unmodeled.core.constants import G
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.bodies import load_body
from unmodeled.models.physics import Dynamics, Polyhedron
from unmodeled.pipeline.cases.accepted_values import Surveyed
from unmodeled.pipeline.cases.catalogue import candidate_by_name
from unmodeled.pipeline.cases.known_effects import entry_of, read_known
from unmodeled.pipeline.cases.load_case import case_from_mapping
from unmodeled.pipeline.cases.write_case import add_to_source

BENNU = Surveyed(load_body("bennu"))
SHAPE = {"effect": "polyhedron", "file": "shape.obj", "scale": "0.2 km", "degree": 4}
AXES = {"ellipsoid_a": "0.3 km", "ellipsoid_b": "250 m", "ellipsoid_c": "200 m"}


@pytest.fixture
def shape(folder):
    lines = ["v " + " ".join(f"{x:g}" for x in v) for v in cube().vertices * [1.0, 0.9, 0.8]]
    lines += ["f " + " ".join(str(k + 1) for k in f) for f in cube().faces]
    (folder / "shape.obj").write_text("\n".join(lines))
    return folder


def test_density_and_scale_make_gm(shape):
    known = read_known([{"effect": "point_mass"}, {**SHAPE, "density": "1.2 g/cm3"}], BENNU, shape)
    volume = 8 * 200.0**3 * 0.9 * 0.8
    assert known.values["GM"] == pytest.approx(G.value * 1200.0 * volume, rel=1e-12)
    assert known.effects[1].mesh.brillouin_radius == pytest.approx(200 * math.sqrt(2.45))
    # written and read again it is the same effect
    entry = entry_of(known.effects[1], {"polyhedron_scale": 0.5}, {})
    again = read_known([entry], BENNU, shape)
    assert again.effects[0] == known.effects[1]
    assert again.values["polyhedron_scale"] == 0.5


def test_an_ellipsoid_has_axes_and_a_density(shape):
    known = read_known([{"effect": "ellipsoid", **AXES, "density": "2000 kg/m3"}], BENNU)
    volume = 4 / 3 * math.pi * 300.0 * 250.0 * 200.0
    assert known.values["GM"] == pytest.approx(G.value * 2000.0 * volume, rel=1e-12)
    bare = read_known([{"effect": "ellipsoid", **AXES}], BENNU)
    assert bare.values["GM"] == 4.89  # of the card


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"effect": "polyhedron", "file": "shape.obj"}, "lacks scale.*the length of its unit"),
        ({**SHAPE, "scale": "3 kg"}, "scale"),
        ({**SHAPE, "density": "3 km"}, "density"),
        ({**SHAPE, "density": "-1 kg/m3"}, "Allowed: a density > 0"),
        ({**SHAPE, "density": "1 kg/m3", "GM": "5 m3/s2"}, "both GM and density"),
        ({**SHAPE, "mesh": "x"}, 'unknown key "mesh"'),
        ({"effect": "ellipsoid", "ellipsoid_a": "1 km"}, "needs ellipsoid_b"),
        ({"effect": "ellipsoid", "density": "1 kg/m3"}, "lacks ellipsoid_a"),
        ({"effect": "unknown_perturber"}, "needs perturber1_GM"),
    ],
)
def test_entries_that_say_too_little_or_too_much(shape, entry, message):
    with pytest.raises(ConfigError, match=message):
        read_known([entry], BENNU, shape)


def test_a_shape_that_is_not_there(shape):
    with pytest.raises(DataError, match="there is no shape"):
        read_known([{**SHAPE, "file": "other.obj"}], BENNU, shape)


def test_a_shape_is_a_candidate_if_it_is_described(mapping, shape):
    point = [{"effect": "point_mass"}]
    listed = {**mapping, "known": point, "candidates": ["gm_error", SHAPE]}
    case = case_from_mapping(listed, shape)
    assert [c.name for c in case.candidates] == ["gm_error", "polyhedron"]
    c = candidate_by_name("polyhedron", case.candidates)
    assert isinstance(c.effect, Polyhedron)
    assert c.values == {"polyhedron_scale": 0.0}
    # nothing at scale 0, and of the size of its harmonics at 1
    at = np.array([[600.0, 100.0, 50.0]])
    force = Dynamics([c.effect], {"GM": 4.89, "polyhedron_scale": 0.0})
    assert not force.acceleration(at).any()
    assert force.with_values({"polyhedron_scale": 1.0}).acceleration(at).any()
    # added, it is an entry of the next case, whose list no longer counts
    content = add_to_source(listed, c, {"polyhedron_scale": 0.9})
    assert content["known"][1] == {
        "effect": "polyhedron",
        "file": "shape.obj",
        "scale": "200.0 m",
        "degree": 4,
        "values": {"polyhedron_scale": 0.9},
    }
    after = case_from_mapping(content, shape)
    assert [c.name for c in after.candidates] == ["gm_error"]
    assert after.dynamics.values["polyhedron_scale"] == 0.9
    assert add_to_source(content, case.candidates[0], {"GM": 4.9})["known"][1]["file"]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"effect": "srp"}, "tables of polyhedron, ellipsoid"),
        ({**SHAPE, "density": "1 kg/m3"}, "gives density"),
        (SHAPE, r'contains "gravity C\(2,0\)", which the model has'),
    ],
)
def test_candidates_that_cannot_be(mapping, shape, entry, message):
    known = [{"effect": "point_mass"}, {"effect": "zonal", "degrees": [2]}]
    with pytest.raises(ConfigError, match=message):
        case_from_mapping({**mapping, "known": known, "candidates": [entry]}, shape)


# A straight line for a planet, in km from J2000 on: enough to see what is read.
LINE = np.array([[[1.5e8, 2e6, 0.0], [2e8, 0.0, 0.0], [0.0, -3e5, 0.0]]])
KERNEL = {
    "file": "planet.bsp",
    "kind": "position",
    "target": 1,
    "center": 10,
    "start": "0 d",
    "end": "10 d",
    "step": "1 d",
    "sigma": "1 km",
}
STATE = {"position": "1.5e8, 2e8, 0 km", "velocity": "2, 0, -0.3 km/s"}
SUN = {
    "name": "planet",
    "body": "sun",
    "epoch": "2000-01-01T12:00:00 TDB",
    "known": [{"effect": "point_mass"}],
    "initial_state": STATE,
    "measurements": [KERNEL],
}


def planet(folder):
    span = (-1e6, 1e6)
    kernel(folder / "planet.bsp", [(1, 0, *span, LINE, 1, 2), (10, 0, *span, 0 * LINE, 1, 2)])


def test_a_kernel_is_measured_at_its_steps(folder):
    planet(folder)
    case = case_from_mapping(SUN, folder)
    (m,) = case.arcs[0].measurements
    np.testing.assert_allclose(m.times, np.arange(11) * 86_400.0, atol=1e-6)
    x = m.times / 1e6
    # TDB leads TT by 1.7 ms at most: some metres at 2 km/s
    np.testing.assert_allclose(m.values[:, 0], 1.5e11 + 2e9 * x, atol=20.0)
    np.testing.assert_allclose(m.values[:, 2], -3e8 * x, atol=20.0)
    assert m.sigmas.max() == 1000.0
    later = {**KERNEL, "start": "2000-01-05T12:00:00 TDB"}
    case = case_from_mapping({**SUN, "measurements": [later]}, folder)
    assert case.arcs[0].measurements[0].times[0] == pytest.approx(4 * 86_400.0, abs=0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"target": None}, "is a kernel, and target is not stated"),
        ({"step": None}, "step is not stated"),
        ({"center": 399}, "center of planet.bsp is 399, and the body is sun. Allowed: 10"),
        ({"every": 2}, "has no every"),
        ({"frame": "ICRF"}, "has no frame"),
        ({"light_time": True}, "no light time"),
        ({"sigma": "file"}, "a kernel states none"),
        ({"file": "a.csv"}, "is no kernel, and target is stated"),
    ],
)
def test_what_a_kernel_needs_is_asked_for(folder, change, message):
    planet(folder)
    entry = {k: v for k, v in {**KERNEL, **change}.items() if v is not None}
    with pytest.raises(ConfigError, match=message):
        case_from_mapping({**SUN, "measurements": [entry]}, folder)


def test_kernels_along_other_axes_are_refused(folder):
    kernel(folder / "planet.bsp", [(1, 10, -1e6, 1e6, LINE, 17, 2)])
    with pytest.raises(DataError, match="NAIF frame 17"):
        case_from_mapping(SUN, folder)
