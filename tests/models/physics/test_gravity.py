"""Special cases of the gravity effects equal the general ones."""

import math

import numpy as np
import pytest

from unmodeled.models.physics import (
    Dynamics,
    PointMass,
    SphericalHarmonics,
    Zonal,
    coefficient_names,
)

EPS = np.finfo(float).eps
MASS = {"GM": 4.89, "R_ref": 0.9}


def points(n=200):
    generator = np.random.default_rng(3)
    x = generator.normal(size=(n, 3))
    x *= (generator.uniform(1.0, 4.0, n) / np.linalg.norm(x, axis=1))[:, None]
    return np.concatenate([x, [[0, 0, 1.2], [0, 0, -1.2], [1.2, 0, 0], [0, 1.2, 0]]])


def assert_same_field(a, b, relative):
    scale = np.linalg.norm(b, axis=1, keepdims=True)
    assert (np.abs(a - b) / scale).max() < relative


def test_zonals_are_the_order_zero_harmonics():
    # [MontenbruckGill2000] section 3.2: J_n = -sqrt(2 n + 1) Cbar_n0
    zonals = {2: 1.93e-2, 3: -1.22e-3, 4: -6.5e-3, 5: 6.73e-5}
    special = Dynamics(
        [PointMass(), Zonal(tuple(zonals))], MASS | {f"J{n}": j for n, j in zonals.items()}
    )
    general = {f"C_{n}_0": -j / math.sqrt(2 * n + 1) for n, j in zonals.items()}
    for harmonics in (
        [PointMass(), SphericalHarmonics(5, order=0)],
        [PointMass(), SphericalHarmonics(5)],
        [SphericalHarmonics(5, min_degree=0)],
    ):
        field = Dynamics(harmonics, MASS | general)
        assert_same_field(special.acceleration(points()), field.acceleration(points()), 1e-14)
        np.testing.assert_allclose(
            special.potential(points()), field.potential(points()), rtol=1e-14
        )


def test_degree_zero_is_the_point_mass():
    mass = Dynamics([PointMass()], {"GM": 4.89})
    field = Dynamics([SphericalHarmonics(0, min_degree=0)], MASS)
    assert_same_field(field.acceleration(points()), mass.acceleration(points()), 10 * EPS)
    x = points()
    by_hand = -4.89 * x / np.linalg.norm(x, axis=1, keepdims=True) ** 3
    assert_same_field(mass.acceleration(x), by_hand, 10 * EPS)


def test_degree_one_is_a_shifted_mass():
    # C_10, C_11, S_11 times sqrt(3) R are the centre of mass; what is left is of second order
    # in the shift: (3 / 2 * shift / r)^2 and a little more.
    shift = np.array([2e-5, -3e-5, 1e-5])
    names = ("C_1_1", "S_1_1", "C_1_0")
    values = {n: s / (math.sqrt(3) * 0.9) for n, s in zip(names, shift, strict=True)}
    field = Dynamics([SphericalHarmonics(1, min_degree=0)], MASS | values)
    moved = Dynamics([PointMass()], {"GM": 4.89}).acceleration(points() - shift)
    assert_same_field(field.acceleration(points()), moved, 10 * (shift @ shift))


def test_quarter_turn_maps_cosine_to_sine():
    # Turning the body by +90 degrees: longitude becomes longitude - 90 degrees, so that
    # cos(m (lambda - 90)) with m = 2 changes sign, and m = 1 cosine becomes sine.
    x = points()
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])

    def field(values):
        return Dynamics([PointMass(), SphericalHarmonics(2)], MASS | values)

    for before, after in (
        ({"C_2_2": 0.01}, {"C_2_2": -0.01}),
        ({"S_2_2": 0.01}, {"S_2_2": -0.01}),
        ({"C_2_1": 0.01}, {"S_2_1": 0.01}),
        ({"S_2_1": 0.01}, {"C_2_1": -0.01}),
        ({"C_2_0": 0.01}, {"C_2_0": 0.01}),
    ):
        turned = field(before).acceleration(x @ turn) @ turn.T
        assert_same_field(turned, field(after).acceleration(x), 1e-14)


def test_eighth_turn_maps_c22_to_s22():
    x, c = points(), math.sqrt(0.5)
    turn = np.array([[c, -c, 0], [c, c, 0], [0, 0, 1]])
    before = Dynamics([PointMass(), SphericalHarmonics(2)], MASS | {"C_2_2": 0.01})
    after = Dynamics([PointMass(), SphericalHarmonics(2)], MASS | {"S_2_2": 0.01})
    assert_same_field(before.acceleration(x @ turn) @ turn.T, after.acceleration(x), 1e-14)


def test_a_spinning_field_is_the_still_field_turned():
    values = MASS | {"C_2_2": 0.01, "S_3_1": 0.004, "C_2_0": -0.02}
    still = Dynamics([PointMass(), SphericalHarmonics(3)], values)
    spin = {"spin_rate": 0.4, "prime_meridian": -0.3}
    model = Dynamics([PointMass(), SphericalHarmonics(3)], values | spin, spinning=True)
    x = points()
    times = np.linspace(0, 50, len(x))
    angle = -0.3 + 0.4 * times
    c, s, zero, one = np.cos(angle), np.sin(angle), 0 * angle, 1 + 0 * angle
    turn = np.array([[c, s, zero], [-s, c, zero], [zero, zero, one]]).transpose(2, 0, 1)
    fixed = still.acceleration(np.einsum("nij,nj->ni", turn, x))
    expected = np.einsum("nji,nj->ni", turn, fixed)
    # the angle, 20 rad, is rounded to 20 eps
    assert_same_field(model.acceleration(x, times), expected, 100 * EPS)


def test_zonal_fields_do_not_notice_the_spin():
    values = MASS | {"J2": 0.02}
    still = Dynamics([PointMass(), Zonal((2,))], values)
    model = Dynamics([PointMass(), Zonal((2,))], values | {"spin_rate": 0.4}, spinning=True)
    assert_same_field(model.acceleration(points(), 7.0), still.acceleration(points()), 100 * EPS)


def test_flattening_pulls_towards_the_equator():
    # J2 > 0 is an oblate body: weaker pull over the pole, stronger at the equator.
    plain = Dynamics([PointMass()], {"GM": 4.89})
    oblate = Dynamics([PointMass(), Zonal((2,))], MASS | {"J2": 0.02})
    poles, equator = [[0, 0, 1.5]], [[1.5, 0, 0]]
    assert abs(oblate.acceleration(poles)[0, 2]) < abs(plain.acceleration(poles)[0, 2])
    assert abs(oblate.acceleration(equator)[0, 0]) > abs(plain.acceleration(equator)[0, 0])
    # by hand, [MontenbruckGill2000] Eq. 3.29ff: -3/2 J2 (R/r)^2 of the attraction at the equator
    extra = oblate.acceleration(equator)[0, 0] / plain.acceleration(equator)[0, 0] - 1
    assert extra == pytest.approx(1.5 * 0.02 * (0.9 / 1.5) ** 2, rel=1e-13)


def test_coefficient_names():
    assert coefficient_names(0) == ["C_0_0"]
    assert coefficient_names(3, order=1, min_degree=2) == [
        "C_2_0",
        "C_2_1",
        "S_2_1",
        "C_3_0",
        "C_3_1",
        "S_3_1",
    ]
    assert len(coefficient_names(8)) == 81
