"""True fields that turn with the body: samples, noise, flights and ids in the right axes."""

import numpy as np
import pytest
from tests.models.physics.shapes import ellipsoid_mesh

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.units import NORMALISED_GM
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.truth_field import mascon_field, shape_field, shape_tesseral_field
from unmodeled.models.physics import built_in_shape, polyhedron_gravity
from unmodeled.models.physics.gravity_file import GravityField, write_gravity_field
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.shape_harmonics import mesh_harmonics
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.flight import fly
from unmodeled.pipeline.prepare import prepare, simulate
from unmodeled.pipeline.sweep.run_id import canonical, run_id
from unmodeled.reports.data_words import data_sentences

EROS = load_body("eros")
ORBITS = {
    "orbit": {"semi_major_axis": 2.2, "eccentricity": 0.2, "inclination": 50.0},
    "other_orbits": [{"semi_major_axis": 2.5, "eccentricity": 0.1, "inclination": 120.0}],
    "train_periods": 4,
    "extrapolation_periods": 2,
}


def config(field, **changes):
    content = {"body": "eros", "learners": [{"kind": "harmonic_gp", "degree": 4}]}
    data = ORBITS if field is None else ORBITS | {"field": field}
    return CharacterizationConfig.resolve(content | {"data": data} | changes)


def two_masses(x):
    """+0.1 GM at x = 1/2 and -0.1 GM at -1/2 on a point mass, written out."""
    total = np.zeros_like(x)
    for share, place in ((1.0, 0.0), (0.1, 0.5), (-0.1, -0.5)):
        d = x - [place, 0.0, 0.0]
        total -= share * NORMALISED_GM * d / np.linalg.norm(d, axis=1)[:, None] ** 3
    return total


def test_samples_are_those_of_the_body_fixed_field_and_of_the_turned_orbit():
    data = prepare(config({"kind": "hidden_masses"}))
    for samples in data.sets:
        assert samples.accelerations == pytest.approx(two_masses(samples.positions), rel=1e-11)
    other, orbit = data.extrapolation, data.orbits[1]
    assert np.array_equal(other.times, orbit.times)
    angle = EROS.spin_rate * orbit.times
    x, y, z = orbit.positions.T / data.units.length
    turned = [np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x, z]
    assert other.positions == pytest.approx(np.transpose(turned), abs=1e-12)


@pytest.mark.parametrize("frame", ["body_fixed", "inertial"])
def test_state_noise_moves_along_the_true_field(frame):
    noise = {"state": 0.05, "draws": "consistent"}
    data = prepare(config({"kind": "hidden_masses", "frame": frame}, noise=noise))
    s = data.train
    angle = EROS.spin_rate * s.times if frame == "inertial" else 0.0 * s.times
    c, n, o, one = np.cos(angle), np.sin(angle), 0.0 * angle, 1.0 + 0.0 * angle
    turn = np.moveaxis(np.array([[c, n, o], [-n, c, o], [o, o, one]]), -1, 0)
    body = (turn @ s.observed_positions[:, :, None])[:, :, 0]
    expected = (turn.mT @ two_masses(body)[:, :, None])[:, :, 0]
    assert s.observed_accelerations == pytest.approx(expected, rel=1e-9)


def test_a_learned_field_turns_in_its_flight():
    chosen = config({"kind": "hidden_masses"}, flight={"periods": [1], "orbits": 1})
    result = characterize(chosen)
    data = result.data
    # Rounding of the solver on orbits of some 40 km.
    assert result.flight_floor < 1e-4
    still = fly(data.true_field, data.orbits[0], data.units, data.periods[0], data.periods[0])
    assert still.position_error.max() > 1e3
    assert result.learners[0].summaries["extrapolation"].median < 1e-3
    assert result.field(chosen.learners[0].label).frame == "body_fixed"
    words = " ".join(data_sentences(result))
    assert "Truth: point mass + mascon + mascon; axes of the samples: body-fixed, spin " in words


def test_a_field_of_inertial_position_loses_what_turns():
    errors = {}
    for frame in ("body_fixed", "inertial"):
        chosen = config({"kind": "hidden_masses", "frame": frame}, flight={"orbits": 1})
        result = characterize(chosen)
        errors[frame] = result.learners[0].summaries["interpolation"].median
        assert result.field(chosen.learners[0].label).frame == frame
    assert errors["inertial"] > 100 * errors["body_fixed"]


def test_polyhedron_against_the_closed_form(tmp_path):
    mesh = ellipsoid_mesh((1.0, 0.4, 0.3), 2)
    rows = [
        f"v {x!r} {y!r} {z!r}" for x, y, z in (mesh.vertices + np.array([0.2, 0.0, 0.0])).tolist()
    ]
    rows += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
    (tmp_path / "long.obj").write_text("\n".join(rows))
    field = {"kind": "polyhedron", "file": "long.obj", "degree": 12}
    data = prepare(config(field), [tmp_path])
    x = data.extrapolation.positions
    exact = polyhedron_gravity(Mesh(mesh.vertices, mesh.faces), x, NORMALISED_GM).acceleration
    # The first term left out is of degree 14: 1.76^-14 (lowest radius) x 1e-3 x 15 x 13.
    assert data.extrapolation.accelerations == pytest.approx(exact, abs=1e-4)
    with pytest.raises(DataError, match="outside the Brillouin sphere"):
        simulate(config(field | {"scale": 20000.0}), folders=[tmp_path])


def test_built_in_shape_against_the_closed_form():
    field = shape_field(EROS, "comet_like", 8)
    x = np.array([[1.0, 2.0, 1.2], [-2.0, 1.0, 1.0], [0.3, -2.4, 0.5]])
    mesh = built_in_shape("comet_like", EROS.brillouin_radius)
    exact = polyhedron_gravity(mesh, x * EROS.brillouin_radius, EROS.gm).acceleration
    # Degree 9 and more: 10 / r^9 of the point mass at most for a mass all at the surface.
    np.testing.assert_allclose(
        field.acceleration(x * EROS.brillouin_radius), exact, atol=1e-3 * np.abs(exact).max()
    )
    assert field.values["spin_rate"] == EROS.spin_rate


def test_tesserals_of_a_shape_go_with_the_zonals_of_the_card():
    values = shape_tesseral_field(EROS, "eros_like", 4).values
    share = EROS.reference_radius / EROS.brillouin_radius
    assert values["C_2_0"] == pytest.approx(-EROS.zonals[2] * share**2)
    shape = mesh_harmonics(built_in_shape("eros_like"), 4, 1.0)
    for name in ("C_2_2", "C_3_1", "S_4_3"):
        assert values[name] == pytest.approx(shape[name], abs=1e-13)
    assert values["R_ref"] == EROS.brillouin_radius


def test_two_mascons_have_the_mass_and_its_centre():
    field = mascon_field(EROS)
    far = np.array([[0.0, 0.0, 1e4], [1e4, 0.0, 0.0]]) * EROS.brillouin_radius
    expected = -EROS.gm * far / np.linalg.norm(far, axis=1)[:, None] ** 3
    # no dipole (1e-4 of it at this distance) is left, only a quadrupole of 1e-8
    np.testing.assert_allclose(
        field.acceleration(far), expected, rtol=3e-8, atol=1e-7 * np.abs(expected).max()
    )
    with pytest.raises(ConfigError, match="less than 1 from the origin"):
        mascon_field(EROS, [(0.5, (1.0, 0.2, 0.0))])


def test_masses_of_a_configuration_make_the_field():
    masses = [{"share": 0.1, "place": [0.5, 0, 0]}, {"share": -0.1, "place": [-0.5, 0, 0]}]
    data = prepare(config({"kind": "mascons", "masses": masses}))
    for samples in data.sets:
        assert samples.accelerations == pytest.approx(two_masses(samples.positions), rel=1e-11)


def test_zonal_file_gives_what_the_card_gives(tmp_path):
    sqrt = {2: 5.0, 3: 7.0, 4: 9.0}
    unnormalised = EROS.zonal_unnormalised()
    zonals = {f"C_{n}_0": -unnormalised[n] / sqrt[n] ** 0.5 for n in sqrt}
    made = GravityField(EROS.gm, EROS.reference_radius, {"C_0_0": 1.0} | zonals)
    write_gravity_field(made, tmp_path / "field.gfc")
    file = prepare(config({"kind": "tesseral", "file": "field.gfc"}), [tmp_path])
    card = prepare(config(None))
    # A field about the axis does not notice the spin.
    assert file.orbits[0].positions == pytest.approx(card.orbits[0].positions, rel=1e-9, abs=1e-4)
    with pytest.raises(ConfigError, match="goes to degree 4"):
        simulate(config({"kind": "tesseral", "file": "field.gfc", "degree": 5}), folders=[tmp_path])


@pytest.mark.parametrize(
    ("field", "words"),
    [
        ({"kind": "polyhedron"}, "a shape file for polyhedron"),
        ({"kind": "polyhedron", "shape": "comet_like", "file": "x.obj"}, "file x.obj and shape"),
        ({"kind": "polyhedron", "shape": "comet_lik"}, 'Did you mean "comet_like"'),
        ({"kind": "polyhedron", "shape": "comet_like", "scale": 2.0}, "Leave scale out"),
        (
            {
                "kind": "tesseral",
                "shape": "eros_like",
                "masses": [{"share": 1, "place": [0, 0, 0]}],
            },
            "Leave masses out",
        ),
        ({"kind": "mascons", "masses": [{"share": 1, "plac": [0, 0, 0]}]}, 'did you mean "place"'),
        ({"kind": "hidden_masses", "file": "x"}, "none otherwise"),
        ({"kind": "hidden_masses", "degree": 4}, "Leave degree out"),
        ({"kind": "tesseral", "file": "x.gfc", "scale": 2.0}, "Leave scale out"),
        ({"kind": "tesserall"}, "hidden_masses"),
    ],
)
def test_what_does_not_belong_together_is_refused(field, words):
    with pytest.raises(ConfigError, match=words):
        config(field)


def test_ids_tell_fields_and_axes_apart_and_zonal_ones_stay():
    fields = [None, {"kind": "hidden_masses"}, {"kind": "hidden_masses", "frame": "inertial"}]
    fields += [{"kind": "mascons"}, {"kind": "polyhedron", "shape": "comet_like"}]
    forms = [canonical(config(field)) for field in fields]
    assert len({run_id(form) for form in forms}) == 5
    assert "field" not in forms[0]["data"]
    assert "shape" not in forms[1]["data"]["field"]


def test_a_field_that_turns_needs_a_spin_and_heyoka():
    with pytest.raises(ConfigError, match="integrator rk4"):
        CharacterizationConfig.resolve(
            {
                "learners": [{"kind": "point_mass"}],
                "data": {"field": {"kind": "hidden_masses"}, "integrator": "rk4"},
            }
        )
