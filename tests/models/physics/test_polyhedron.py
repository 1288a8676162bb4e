"""Meshes, the closed sum over their faces, and the series that flies."""

import numpy as np
import pytest
from tests.models.physics.shapes import cube, ellipsoid_mesh

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.physics import (
    Dynamics,
    Ellipsoid,
    Mesh,
    PointMass,
    Polyhedron,
    Zonal,
    polyhedron_gravity,
)
from unmodeled.models.physics.shape_harmonics import mesh_harmonics

EPS = np.finfo(float).eps
SHIFT = np.array([0.2, -0.1, 0.3])


def test_a_cube_is_measured():
    m = cube(0.5)
    assert m.volume == pytest.approx(1.0, rel=4 * EPS)
    assert m.brillouin_radius == pytest.approx(np.sqrt(0.75), rel=4 * EPS)
    moved = Mesh(m.vertices + SHIFT, m.faces, "another name")
    np.testing.assert_allclose(moved.centroid, SHIFT, atol=4 * EPS)
    assert len(m.edges) == 18  # Euler: 8 - 18 + 12 = 2
    assert moved != m
    assert Mesh(m.vertices, m.faces, "again") == m


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        (cube().faces[:-1], "not closed"),
        (cube().faces[:, ::-1], r"the volume is -8 m3.*turn the order|the volume is -8 m3"),
        (np.vstack([cube().faces[:1, ::-1], cube().faces[1:]]), "run opposite ways"),
        (np.vstack([cube().faces, [[0, 0, 1]]]), "a vertex twice"),
        (cube().faces + 1, "of vertices that exist"),
        (cube().faces.astype(float), "whole numbers"),
    ],
)
def test_what_is_no_closed_surface_is_refused(faces, message):
    with pytest.raises(DataError, match=message):
        Mesh(cube().vertices, faces)


def places(seed=1, n=20, size=3.0):
    return np.random.default_rng(seed).normal(size=(n, 3)) * size


def test_the_sums_are_a_potential_and_its_derivatives_inside_and_outside():
    m, x, h = cube(), places(size=1.5), 1e-4
    g = polyhedron_gravity(m, x, 2.0)
    for k in range(3):
        step = h * np.eye(3)[k]
        up, down = (polyhedron_gravity(m, x + s * step, 2.0) for s in (1, -1))
        # h^2 times the third derivative of a field of order one, doubled near edges
        np.testing.assert_allclose(
            g.acceleration[:, k], (up.potential - down.potential) / (2 * h), atol=1e-6
        )
        np.testing.assert_allclose(
            g.gradient[:, :, k], (up.acceleration - down.acceleration) / (2 * h), atol=1e-5
        )
    truly = np.all(np.abs(x) < 1.0, axis=1)
    assert truly.any()
    assert not truly.all()
    assert np.array_equal(g.inside, truly)
    np.testing.assert_allclose(g.solid_angle, np.where(truly, 4 * np.pi, 0.0), atol=1e-13)
    # Poisson: - 4 pi G density inside, 0 outside; G density = gm / volume
    np.testing.assert_allclose(
        np.trace(g.gradient, axis1=1, axis2=2), -g.solid_angle * 2.0 / m.volume, atol=1e-13
    )


def test_far_away_a_body_is_a_point_and_the_centre_of_a_cube_feels_nothing():
    far = places(size=1e3)
    r = np.linalg.norm(far, axis=1)
    got = polyhedron_gravity(cube(), far, 2.0)
    # a cube has no harmonic below degree 4; the sums lose digits as (r / size)^2
    np.testing.assert_allclose(got.potential, 2.0 / r, rtol=1e3 * EPS * (r.max()) ** 2)
    centre = polyhedron_gravity(cube(), [[0.0, 0.0, 0.0]], 2.0)
    np.testing.assert_allclose(centre.acceleration, 0.0, atol=1e-15)


def test_the_series_converges_to_the_sums():
    m = Mesh(cube(0.5).vertices * [1.0, 0.8, 0.6] + SHIFT, cube().faces)
    x = places(2)
    x *= (2.5 * m.brillouin_radius / np.linalg.norm(x, axis=1))[:, None]
    sums = polyhedron_gravity(m, x, 2.0)
    size = np.linalg.norm(sums.acceleration, axis=1)
    errors = []
    for degree in (4, 8, 12):
        model = Dynamics([PointMass(), Polyhedron(m, degree)], {"GM": 2.0})
        off = np.linalg.norm(model.acceleration(x) - sums.acceleration, axis=1) / size
        errors.append(off.max())
        # coefficients are at most of order one: (n + 2) (R / r)^(n + 1), summed from there on
        assert errors[-1] < 2 * (degree + 3) * 0.4 ** (degree + 1)
    np.testing.assert_allclose(model.potential(x), sums.potential, rtol=errors[-1])
    assert errors[2] < errors[1] < errors[0]


def test_degree_one_is_the_offset_of_the_centroid():
    m = Mesh(cube().vertices + SHIFT, cube().faces)
    c = mesh_harmonics(m, 2, 3.0)
    got = [c["C_1_1"], c["S_1_1"], c["C_1_0"]]
    np.testing.assert_allclose(np.array(got) * 3.0 * np.sqrt(3.0), SHIFT, atol=1e-14)
    assert c["C_0_0"] == pytest.approx(1.0, rel=10 * EPS)


def test_an_ellipsoid_of_revolution_is_its_zonals():
    axes = {"ellipsoid_a": 2.0, "ellipsoid_b": 2.0, "ellipsoid_c": 1.5}
    # J2 of a homogeneous spheroid, (a^2 - c^2) / (5 a^2), and J4 = -15/7 J2^2
    j2 = (4.0 - 2.25) / 20.0
    zonals = {"J2": j2, "J4": -15.0 / 7.0 * j2**2, "R_ref": 2.0}
    x = places(3) + 3.0
    one = Dynamics([Ellipsoid(4)], {"GM": 1.3} | axes)
    two = Dynamics([Zonal((2, 4))], {"GM": 1.3} | zonals)
    np.testing.assert_allclose(one.acceleration(x), two.acceleration(x), atol=1e-15)


def test_an_ellipsoid_is_the_limit_of_its_meshes():
    axes, errors = (1.5, 1.2, 0.9), []
    x = places(4)
    x *= (4.0 / np.linalg.norm(x, axis=1))[:, None]
    values = dict(zip(("ellipsoid_a", "ellipsoid_b", "ellipsoid_c"), axes, strict=True))
    smooth = Dynamics([Ellipsoid(12)], {"GM": 1.0} | values).acceleration(x)
    for rounds in (2, 3):
        m = ellipsoid_mesh(axes, rounds)
        flat = polyhedron_gravity(m, x, 1.0).acceleration
        flat += x / np.linalg.norm(x, axis=1)[:, None] ** 3  # less the point mass
        errors.append(np.abs(flat - smooth).max())
    # edges halved: a quarter of the error, but for the next order
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Polyhedron(cube(), 25), r"to degree 25. Allowed: 1 to 24.*polyhedron_gravity"),
        (lambda: Ellipsoid(1), "ellipsoid to degree 1. Allowed: 2 to 24"),
        (lambda: Ellipsoid(2.5), "a whole number"),
        (lambda: Dynamics([Polyhedron(cube()), Zonal((2,))]), "twice"),
    ],
)
def test_degrees_that_cannot_be_are_refused(make, message):
    with pytest.raises(ConfigError, match=message):
        make()
