"""The exported field of the harmonic Gaussian process against an independent program."""

import numpy as np
import pytest
from tests.models.learned.problem import GM, other_orbit, samples

from unmodeled.core.units import NormalisedUnits
from unmodeled.models.learned import HarmonicGP
from unmodeled.models.physics.gravity_file import read_gravity_field, write_gravity_field

UNITS = NormalisedUnits.of_body(gm=4.89, radius=290.0)


def exported(tmp_path):
    X, y, _, _ = samples(noise=0.1)
    learner = HarmonicGP(degree=6, least_degree=6).fit(X, y)
    path = tmp_path / "field.gfc"
    write_gravity_field(learner.gravity_field(UNITS), path)
    return learner, path


@pytest.mark.slow
def test_pyshtools_reads_the_same_field(tmp_path):
    pyshtools = pytest.importorskip("pyshtools", reason="install the extra `truth`")
    learner, path = exported(tmp_path)
    field = pyshtools.SHGravCoeffs.from_file(str(path), format="icgem", errors="formal")
    X = other_orbit()[0]
    r = np.linalg.norm(X, axis=1)
    lat, lon = np.arcsin(X[:, 2] / r), np.arctan2(X[:, 1], X[:, 0])
    up, south, east = field.expand(
        lat=lat, lon=lon, r=r * UNITS.length, degrees=False, normal_gravity=False
    ).T
    c, s, cl, sl = np.cos(lat), np.sin(lat), np.cos(lon), np.sin(lon)
    expected = (
        up[:, None] * X / r[:, None]
        + south[:, None] * np.stack([s * cl, s * sl, -c], axis=1)
        + east[:, None] * np.stack([-sl, cl, 0 * sl], axis=1)
    )
    ours = learner.predict(X) * UNITS.length / UNITS.time**2
    error = np.linalg.norm(ours - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert error.max() < 1e-10  # the bound that the project promises; rounding is 1e-13


def test_a_file_gives_field_and_errors_back(tmp_path):
    learner, path = exported(tmp_path)
    field = read_gravity_field(path)
    assert field == learner.gravity_field(UNITS)
    back = HarmonicGP.from_gravity_field(field, UNITS)
    X = other_orbit()[0]
    # units there and back: a few roundings of numbers up to 40
    np.testing.assert_allclose(back.predict(X), learner.predict(X), rtol=0, atol=1e-13 * GM)
    again = back.gravity_field(UNITS)
    # errors of ratios become errors of coefficients that are the ratios
    assert again.errors["C_4_2"] == pytest.approx(field.errors["C_4_2"], rel=1e-2)
