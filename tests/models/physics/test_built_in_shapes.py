"""Built-in shapes: closed, outward, about their centroid, with the field of their own harmonics."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import SHAPE_NAMES, built_in_shape, polyhedron_gravity
from unmodeled.models.physics.exterior_harmonics import (
    column_names,
    derivative,
    exterior_harmonics,
)
from unmodeled.models.physics.shape_harmonics import mesh_harmonics


def directions(n, seed=3):
    x = np.random.default_rng(seed).normal(size=(n, 3))
    return x / np.linalg.norm(x, axis=1)[:, None]


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_a_shape_is_closed_outward_centred_and_fills_its_sphere(name):
    mesh = built_in_shape(name, 250.0)  # Mesh itself refuses open and inward surfaces
    assert len(mesh.faces) == 2048
    assert len(mesh.vertices) - len(mesh.faces) * 3 // 2 + len(mesh.faces) == 2  # a sphere: Euler
    assert mesh.brillouin_radius == pytest.approx(250.0, rel=1e-12)
    assert np.abs(mesh.centroid).max() < 1e-9 * 250.0
    middle = mesh.corners.mean(axis=1)
    within = polyhedron_gravity(mesh, np.vstack([0.98 * middle[::64], 1.02 * middle[::64]]), 1.0)
    assert list(within.inside) == [True] * 32 + [False] * 32


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_volume_converges_with_the_square_of_the_edges(name):
    share = [
        built_in_shape(name, 1.0, detail).volume / (4.0 * np.pi / 3.0) for detail in (8, 16, 32)
    ]
    # 4 for a smooth surface and 2 for first order; the ridge of the top and the farthest vertex,
    # to which the volume is scaled, disturb it
    assert (share[1] - share[0]) / (share[2] - share[1]) > 2.5
    assert abs(share[2] - share[1]) < 0.02 * share[2]


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_far_outside_the_polyhedron_is_its_own_harmonics(name):
    mesh, degree, r = built_in_shape(name, 1.0, 8), 24, 3.0
    x = r * directions(40)
    values = mesh_harmonics(mesh, degree, 1.0)
    c = np.array([values[k] for k in column_names(degree)])
    table = exterior_harmonics(x, degree + 1)
    series = np.stack([c @ derivative(table, i) for i in range(3)], axis=1)
    exact = polyhedron_gravity(mesh, x, 1.0).acceleration
    # A mass at distance 1 or less adds at most (n + 1) r^-(n + 2) of degree n.
    n = np.arange(degree + 1, 200)
    bound = np.sum((n + 1) * r ** -(n + 2.0))
    assert np.linalg.norm(series - exact, axis=1).max() < bound
    assert bound < 1e-10


@pytest.mark.parametrize("name", SHAPE_NAMES)
def test_axes_are_principal_from_longest_to_shortest(name):
    c = mesh_harmonics(built_in_shape(name), 2, 1.0)
    for key in ("C_1_0", "C_1_1", "S_1_1", "C_2_1", "S_2_1", "S_2_2"):
        assert abs(c[key]) < 1e-12
    assert c["C_2_2"] > 1e-3
    # the moment of inertia about z exceeds that about y
    assert -np.sqrt(5.0) * c["C_2_0"] > 2.0 * np.sqrt(5.0 / 12.0) * c["C_2_2"]


def test_shapes_are_like_their_namesakes():
    extent = {name: np.ptp(built_in_shape(name).vertices, axis=0) for name in SHAPE_NAMES}
    assert extent["eros_like"][1] / extent["eros_like"][0] < 0.36
    assert extent["bennu_like"][2] / extent["bennu_like"][0] == pytest.approx(0.9, abs=0.02)
    binary = built_in_shape("contact_binary").vertices
    waist = np.linalg.norm(binary[np.abs(binary[:, 0] + 0.1) < 0.1][:, 1:], axis=1).min()
    lobe = np.linalg.norm(binary[:, 1:], axis=1).max()
    assert waist < 0.6 * lobe


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("comet",), 'Did you mean "comet_like"'),
        (("comet_like", 0.0), "a length > 0"),
        (("comet_like", 1.0, 64), "2 to 32"),
    ],
)
def test_bad_requests_are_refused(arguments, words):
    with pytest.raises(ConfigError, match=words):
        built_in_shape(*arguments)
