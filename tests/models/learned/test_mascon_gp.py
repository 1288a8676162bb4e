"""Masses inside a known body: dense algebra, below the Brillouin sphere, what is refused."""

import numpy as np
import pytest
from tests.models.learned.problem import GM

from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.models.learned import HarmonicGP, MasconGP, NoiseLevel
from unmodeled.models.physics import built_in_shape, polyhedron_gravity
from unmodeled.models.physics.interior_lattice import ellipsoid_lattice, shape_lattice

MESH = built_in_shape("comet_like", 1.0, 8)


def directions(n, seed):
    u = np.random.default_rng(seed).normal(size=(n, 3))
    return u / np.linalg.norm(u, axis=1)[:, None]


def samples(n=150, seed=1, sigma=0.0):
    """Positions from 1.1 to 2.5 radii, and the field of a two-lobed body with an extra mass."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(1.1, 2.5, size=(n, 1)) * directions(n, seed)
    return x, truth(x) + sigma * rng.normal(size=x.shape)


def truth(x):
    d = x - np.array([0.45, 0.05, 0.03])
    extra = -0.05 * GM * d / np.linalg.norm(d, axis=1)[:, None] ** 3
    return polyhedron_gravity(MESH, x, GM).acceleration + extra


def pulls(x, places):
    d = x[:, None] - places
    return -GM * (d / np.linalg.norm(d, axis=2)[:, :, None] ** 3).transpose(0, 2, 1)


def test_posterior_and_evidence_are_those_of_dense_algebra():
    x, y = samples(40, sigma=0.05)
    model = MasconGP(shape="comet_like", count=60).fit(x, y, NoiseLevel(acceleration=0.05))
    places, m, flat = model.places_, 3 * len(x), 4
    W = pulls(x, places).reshape(m, -1)
    away = np.column_stack([np.ones(len(places)), places - places.mean(axis=0)]) / len(places)
    H, t = W @ away, y.ravel()
    # The noise factor stands beside the stated noise.
    S = model.amplitude_**2 * W @ W.T + (model.noise_ * 0.05) ** 2 * np.eye(m)
    inverse = np.linalg.inv(S)
    normal = H.T @ inverse @ H
    c = np.linalg.solve(normal, H.T @ inverse @ t)
    at = 0.9 * directions(5, 9)
    D, prior = pulls(at, places).reshape(15, -1), model.amplitude_**2
    mean = D @ away @ c + prior * D @ W.T @ inverse @ (t - H @ c)
    assert model.predict(at).ravel() == pytest.approx(mean, rel=1e-6)
    gap = D @ away - prior * D @ W.T @ inverse @ H
    dense = prior * D @ D.T - prior**2 * D @ W.T @ inverse @ W @ D.T
    dense += gap @ np.linalg.inv(normal) @ gap.T
    found = model.predict_covariance(at)
    for k in range(5):
        block = dense[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
        assert found[k] == pytest.approx(block, rel=1e-4, abs=1e-6 * block.max())
    # Error contrasts: the free weights integrated out. The weighting by 1 / 0.05 is its Jacobian.
    value = (m - flat) * np.log(2 * np.pi) + np.linalg.slogdet(S)[1]
    value += np.linalg.slogdet(normal)[1] + (t - H @ c) @ inverse @ t
    assert model.log_evidence_ == pytest.approx(-0.5 * value, abs=1e-3)


def test_the_amplitude_has_a_bound_and_clean_data_do_not_break_it():
    x, y = samples(100)
    model = MasconGP(shape="comet_like", count=400).fit(x, y)  # more weights than equations
    assert model.amplitude_ <= 1.0 / len(model.places_)
    assert model.facts()["fitted GM / reference GM"] == pytest.approx(1.05, abs=2e-3)
    assert model.masses_.sum() == pytest.approx(model.facts()["fitted GM / reference GM"])


def test_below_the_brillouin_sphere_harmonics_diverge_and_masses_do_not():
    x, y = samples(250)
    middle = MESH.corners.mean(axis=1)
    near = middle[np.linalg.norm(middle, axis=1) < 0.5] * 1.08
    near = near[~polyhedron_gravity(MESH, near, 1.0).inside]
    size = np.linalg.norm(truth(near), axis=1)
    error = {}
    for model in (MasconGP(shape="comet_like"), HarmonicGP(degree=12)):
        off = model.fit(x, y).predict(near) - truth(near)
        error[model.name] = np.median(np.linalg.norm(off, axis=1) / size)
    assert error["mascon_gp"] < 0.1
    assert error["harmonic_gp"] > 1.0


def test_the_field_is_harmonic_outside_the_body():
    x, y = samples()
    model = MasconGP(shape="comet_like", count=200).fit(x, y)
    J = model.jacobian(1.02 * MESH.vertices)
    size = np.abs(J).max()
    assert np.abs(np.trace(J, axis1=1, axis2=2)).max() < 1e-12 * size
    assert np.abs(J - J.mT).max() < 1e-12 * size


def test_doubtful_samples_are_as_good_as_left_out():
    x, y = samples(120, sigma=0.02)
    y[:10] += 2.0
    sigma = np.full(x.shape, 0.02)
    at, model = 1.5 * directions(50, 4), MasconGP(shape="comet_like", count=100)
    trusted = model.fit(x, y, NoiseLevel(samples=sigma)).predict(at)
    sigma[:10] = 1e4
    doubted = model.fit(x, y, NoiseLevel(samples=sigma)).predict(at)
    without = model.fit(x[10:], y[10:], NoiseLevel(acceleration=0.02)).predict(at)
    # The estimated noise factor counts ten samples more, which hardly matter.
    assert np.abs(doubted - without).max() < 0.05 * np.abs(trusted - without).max()


def test_lattices_lie_inside_and_have_about_the_wanted_number():
    for count in (100, 400):
        places = shape_lattice("comet_like", 2.0, count)
        assert polyhedron_gravity(built_in_shape("comet_like", 2.0, 8), places, 1.0).inside.all()
        assert len(places) == pytest.approx(count, rel=0.15)
    places = ellipsoid_lattice((0.9, 0.5, 0.3), 300)
    assert ((places / [0.9, 0.5, 0.3]) ** 2).sum(axis=1).max() < 1.0
    assert np.abs(places.mean(axis=0)).max() < 1e-12


@pytest.mark.parametrize(
    ("params", "words"),
    [
        ({"count": 4}, "8 or more"),
        ({"axes": (0.5, 0.0, 0.5)}, "three lengths > 0"),
        ({"shape": "comet"}, "there is no built-in shape"),
        ({"places": ((0.0, 0.0, 0.0),)}, "4 or more"),
        ({"gm": -1.0}, "a number > 0"),
    ],
)
def test_bad_settings_are_refused(params, words):
    with pytest.raises(ConfigError, match=words):
        MasconGP(**params).fit(*samples(20))


def test_a_place_of_a_mass_has_no_field():
    model = MasconGP(count=50).fit(*samples(40))
    with pytest.raises(DataError, match="positions outside the body"):
        model.predict(model.places_[:1])


def test_one_direction_does_not_give_mass_and_centre():
    x = np.array([[2.0, 0.0, 0.0]] * 6)
    with pytest.raises(NumericalError, match="more than one direction"):
        MasconGP(count=50).fit(x, -x)
