"""A published field times a number is that field of coefficients."""

import heyoka as hy
import numpy as np
import pytest

from unmodeled.core.errors import ConfigError
from unmodeled.models.physics import (
    Dynamics,
    PointMass,
    ScaledField,
    SphericalHarmonics,
    Zonal,
    egm2008_values,
)

EPS = np.finfo(float).eps


def points(radius=7e6, n=20):
    x = np.random.default_rng(6).normal(size=(n, 3))
    return radius * x / np.linalg.norm(x, axis=1, keepdims=True)


def close(actual, expected, ulps=200):
    bound = ulps * EPS * np.abs(expected).max()
    np.testing.assert_allclose(actual, expected, rtol=0, atol=bound)


@pytest.mark.parametrize(("degree", "order", "least"), [(8, None, 2), (6, 3, 3)])
def test_it_is_the_field_of_the_same_coefficients(degree, order, least):
    field = Dynamics(
        [SphericalHarmonics(degree, order, least)], egm2008_values(degree, order, least)
    )
    scaled = Dynamics([ScaledField("egm2008", degree, order, min_degree=least)])
    close(scaled.acceleration(points()), field.acceleration(points()))
    name = f"egm2008_all_{least}_{degree}_scale"
    half = scaled.with_values({name: 0.5})
    close(half.acceleration(points()), 0.5 * field.acceleration(points()))
    assert not scaled.with_values({name: 0.0}).acceleration(points()).any()


def test_the_parts_add_up_and_meet_heyoka_s_own_field():
    x = hy.make_vars("x", "y", "z")
    whole = hy.cfunc(hy.model.egm2008_acc(x, 8, 8), x)(inputs=np.ascontiguousarray(points().T)).T
    parts = [PointMass(), *(ScaledField(degree=8, part=p) for p in ("zonals", "tesserals"))]
    gm = egm2008_values(2)["GM"]
    close(Dynamics(parts, {"GM": gm}).acceleration(points()), whole)


def test_size_of_its_zonals():
    # J2 = -sqrt(5) C20 = 1.08263e-3
    values = egm2008_values(2, 0)
    zonal = Dynamics(
        [Zonal((2,))],
        {"GM": values["GM"], "R_ref": values["R_ref"], "J2": -np.sqrt(5) * values["C_2_0"]},
    )
    part = Dynamics([ScaledField(degree=2, part="zonals")])
    close(part.acceleration(points()), zonal.acceleration(points()))
    assert -np.sqrt(5) * values["C_2_0"] == pytest.approx(1.08263e-3, rel=1e-5)

    def size(part, radius):
        a = Dynamics([ScaledField(degree=8, part=part)]).acceleration(points(radius, 4000))
        return np.sqrt(np.mean(np.sum(a**2, axis=1)))

    # the card
    assert size("zonals", 6.878e6) == pytest.approx(1.4e-2, rel=0.05)
    assert size("tesserals", 6.878e6) == pytest.approx(1.7e-4, rel=0.05)
    assert size("tesserals", 1.227e7) == pytest.approx(9.9e-6, rel=0.05)


def test_a_coefficient_comes_once():
    with pytest.raises(ConfigError, match=r'contains "gravity C\(2,1\)" twice'):
        Dynamics([SphericalHarmonics(2), ScaledField(degree=4, part="tesserals")])
    Dynamics([Zonal((2, 3, 4)), ScaledField(degree=4, part="tesserals")])
    Dynamics([ScaledField(degree=4), ScaledField(degree=8, min_degree=5)])


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: ScaledField("egm96"), 'published field "egm96". Allowed: egm2008.'),
        (
            lambda: ScaledField(part="sectorals"),
            'part "sectorals" of a field. Allowed: all, tesserals, zonals.',
        ),
        (
            lambda: ScaledField(degree=3, min_degree=1),
            "a published field from degree 1 to 3. Allowed: 2 <= min_degree <= degree.",
        ),
        (
            lambda: ScaledField(degree=3, order=4),
            "a published field of degree 3 and order 4. Allowed: 0 <= order <= degree.",
        ),
        (
            lambda: ScaledField(degree=3, order=0, part="tesserals"),
            "the tesserals of a published field of order 0. Allowed: order 1 or more.",
        ),
        (lambda: egm2008_values(2191), "degree 2191 of EGM2008. Allowed: up to 2190."),
    ],
)
def test_what_there_is_not(make, text):
    with pytest.raises(ConfigError) as caught:
        make()
    assert str(caught.value) == text
