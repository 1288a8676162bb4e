"""Validation of the gravity field and its orbits: published values and independent programs."""

import math

import heyoka as hy
import numpy as np
import pytest

from unmodeled.datasets.elements import state_from_elements
from unmodeled.models.physics import Dynamics, PointMass, SphericalHarmonics, Zonal

DEGREE = 8


def random_field():
    generator = np.random.default_rng(8)
    values = {"GM": 4.89, "R_ref": 290.0, "C_0_0": 1.0}
    for n in range(1, DEGREE + 1):
        for m in range(n + 1):
            values[f"C_{n}_{m}"] = 0.1 / n**2 * generator.normal()
            if m:
                values[f"S_{n}_{m}"] = 0.1 / n**2 * generator.normal()
    return values


def spherical_points(n=50):
    generator = np.random.default_rng(9)
    latitude = np.arcsin(generator.uniform(-0.999, 0.999, n))
    longitude = generator.uniform(-np.pi, np.pi, n)
    return latitude, longitude, generator.uniform(1.05, 4.0, n) * 290.0


@pytest.mark.slow
def test_pyshtools_agrees():
    pyshtools = pytest.importorskip(
        "pyshtools", reason="an independent program; install the extra `truth`"
    )
    values = random_field()
    coefficients = np.zeros((2, DEGREE + 1, DEGREE + 1))
    for name, value in values.items():
        if name[:2] in ("C_", "S_"):
            kind, n, m = name.split("_")
            coefficients["CS".index(kind), int(n), int(m)] = value
    field = pyshtools.SHGravCoeffs.from_array(
        coefficients, gm=4.89, r0=290.0, normalization="4pi", csphase=1, errors=None
    )
    latitude, longitude, radius = spherical_points()
    # Components along r (up), colatitude (south) and longitude (east); no rotation, no normal
    # gravity taken off.
    up, south, east = field.expand(
        lat=latitude, lon=longitude, r=radius, degrees=False, normal_gravity=False
    ).T
    c, s = np.cos(latitude), np.sin(latitude)
    cl, sl = np.cos(longitude), np.sin(longitude)
    r_axis = np.stack([c * cl, c * sl, s], axis=1)
    south_axis = np.stack([s * cl, s * sl, -c], axis=1)
    east_axis = np.stack([-sl, cl, 0 * sl], axis=1)
    expected = up[:, None] * r_axis + south[:, None] * south_axis + east[:, None] * east_axis
    ours = Dynamics([SphericalHarmonics(DEGREE, min_degree=0)], values).acceleration(
        radius[:, None] * r_axis
    )
    error = np.linalg.norm(ours - expected, axis=1) / np.linalg.norm(expected, axis=1)
    # pyshtools divides by the cosine of the latitude, at least 0.04 here: 25 eps and some sums
    assert error.max() < 1e-12


def egm2008(degree):
    values = {"GM": hy.model.get_egm2008_mu(), "R_ref": hy.model.get_egm2008_a(), "C_0_0": 1.0}
    rows = iter(hy.model.get_egm2008_CS())
    for n in range(2, degree + 1):
        for m in range(n + 1):
            c, s = next(rows)
            values[f"C_{n}_{m}"] = c
            if m:
                values[f"S_{n}_{m}"] = s
    return values


def test_egm2008_as_heyoka_ships_it():
    """Checks our naming and ordering of coefficients, with Earth's published numbers."""
    values = egm2008(6)
    # NGA's file of EGM2008: C(2,0), C(2,2), S(2,2), fully normalised, tide free
    assert values["C_2_0"] == pytest.approx(-0.484165143790815e-3, rel=1e-12)
    assert values["C_2_2"] == pytest.approx(0.243938357328313e-5, rel=1e-12)
    assert values["S_2_2"] == pytest.approx(-0.140027370385934e-5, rel=1e-12)
    latitude, longitude, _ = spherical_points()
    x = 7.0e6 * np.stack(
        [
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ],
        axis=1,
    )
    symbols = hy.make_vars("x", "y", "z")
    theirs = hy.cfunc(hy.model.egm2008_acc(symbols, 6, 6), symbols)(
        inputs=np.ascontiguousarray(x.T)
    ).T
    ours = Dynamics([SphericalHarmonics(6, min_degree=0)], values).acceleration(x)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-14 * 9.8)


def test_gravity_at_the_equator_of_the_earth():
    """Normal gravity of GRS80 is its field and spin: Moritz, J. Geodesy 74 (2000) 128-133.

    J2, J4 and J6 are those of the same table. J8 = -1.43e-11 is left out: 9 J8 P8 of g, 3.4e-10
    at the equator (P8(0) = 35/128) and 1.3e-9 at the pole.
    """
    gm, a, rate = 3986005e8, 6378137.0, 7292115e-11
    zonals = {2: 108263e-8, 4: -0.00000237091222, 6: 0.00000000608347}
    model = Dynamics(
        [PointMass(), Zonal(tuple(zonals))],
        {"GM": gm, "R_ref": a} | {f"J{n}": j for n, j in zonals.items()},
    )
    pull = -model.acceleration([[a, 0.0, 0.0]])[0, 0]
    assert pull - rate**2 * a == pytest.approx(9.7803267715, abs=5e-10)
    # at the pole, with b = 6356752.3141 m: 9.8321863685 m/s2
    pole = -model.acceleration([[0.0, 0.0, 6356752.3141]])[0, 2]
    assert pole == pytest.approx(9.8321863685, abs=2e-9)


def node_rate(model, state, revolutions, period):
    """Mean rate of the ascending node: from the longitudes of successive crossings."""
    times = np.linspace(0, revolutions * period, revolutions * 400 + 1)
    orbit = model.propagate(state, times)
    up = np.flatnonzero((orbit[:-1, 2] < 0) & (orbit[1:, 2] >= 0))
    crossings, angles = [], []
    for k in up:
        low, high = times[k], times[k + 1]
        t, s = low, orbit[k]
        for _ in range(3):  # Newton on z(t) = 0
            t -= s[2] / s[5]
            s = model.propagate(orbit[k], [low, t])[-1]
        assert low <= t <= high
        crossings.append(t)
        angles.append(math.atan2(s[1], s[0]))
    return np.polyfit(crossings, np.unwrap(angles), 1)[0]


@pytest.mark.parametrize(
    ("altitude", "inclination"), [(700e3, 98.19), (400e3, 51.64), (800e3, 63.4349), (600e3, 30.0)]
)
def test_nodal_precession(altitude, inclination):
    """-3/2 n J2 (R/p)^2 cos i, Curtis, Orbital Mechanics, Eq. 4.52; first Sun-synchronous."""
    gm, radius, j2 = 398600.4418e9, 6378137.0, 1.08263e-3
    a, e, i = radius + altitude, 0.001, math.radians(inclination)
    model = Dynamics([PointMass(), Zonal((2,))], {"GM": gm, "R_ref": radius, "J2": j2})
    state = state_from_elements([[a, e, i, 0.3, 1.0, 2.0]], gm)[0]
    n = math.sqrt(gm / a**3)
    measured = node_rate(model, state, 15, 2 * math.pi / n)
    formula = -1.5 * n * j2 * (radius / (a * (1 - e**2))) ** 2 * math.cos(i)
    # First-order theory in mean elements: osculating a and i differ from the mean ones by
    # O(J2), and the theory itself is O(J2) wrong, with coefficients of a few units
    # (Kozai 1959): 10 J2 relative.
    assert measured == pytest.approx(formula, rel=10 * j2)
    if altitude == 700e3:  # the textbook's requirement: 360 degrees a year
        assert measured == pytest.approx(2 * math.pi / (365.2422 * 86400), rel=10 * j2)


def test_nodal_precession_error_is_of_second_order():
    """Ten times smaller J2: the formula's relative error falls about ten times."""
    gm, a, i = 1.0, 1.2, 0.9
    state = state_from_elements([[a, 0.001, i, 0.3, 1.0, 2.0]], gm)[0]
    n, errors = math.sqrt(gm / a**3), []
    for j2 in (1e-3, 1e-4):
        model = Dynamics([PointMass(), Zonal((2,))], {"GM": gm, "R_ref": 1.0, "J2": j2})
        formula = -1.5 * n * j2 * (1 / (a * (1 - 1e-6))) ** 2 * math.cos(i)
        errors.append(abs(node_rate(model, state, 15, 2 * math.pi / n) / formula - 1))
    assert 5 < errors[0] / errors[1] < 20
