"""An orbit out of noise as large as the body: found, within its stated errors, or refused."""

import numpy as np
import pytest

from unmodeled.core.errors import DataError, NumericalError
from unmodeled.models.learned import PointMassOnly
from unmodeled.models.physics.exterior_harmonics import column, column_degrees, derivative
from unmodeled.models.physics.exterior_harmonics import exterior_harmonics as harmonics
from unmodeled.pipeline.element_steps import step_in_elements
from unmodeled.pipeline.orbit_data import OrbitData, kepler_acceleration, kepler_place
from unmodeled.pipeline.orbit_guess import ellipse_through, first_guess
from unmodeled.pipeline.orbit_search import search_orbit
from unmodeled.pipeline.orbit_shooting import HarmonicField, shoot

GM = 4 * np.pi**2
NO_HARMONICS = np.zeros(9)


MASS = PointMassOnly(GM).fit(np.ones((4, 3)), np.ones((4, 3)))


def point_mass(x):
    return MASS.predict(x), MASS.jacobian(x)


def kepler(t, axis=2.0, e=0.3):
    """Positions on an inclined ellipse, by a series written here."""
    mean = 2 * np.pi * t / axis**1.5 + 1.0
    E = mean.copy()
    for _ in range(80):
        E -= (E - e * np.sin(E) - mean) / (1 - e * np.cos(E))
    x = axis * np.column_stack([np.cos(E) - e, np.sqrt(1 - e * e) * np.sin(E), 0 * E])
    c, s = np.cos(0.9), np.sin(0.9)
    return x @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])


def observed(t, x, sigma, seed):
    """Samples as `datasets.noise` draws them about a point mass: two draws of the place."""
    first, second = sigma * np.random.default_rng(seed).normal(size=(2, *x.shape))
    return OrbitData(t, x + first, kepler_acceleration(x + second, GM), sigma, 0.0, GM)


def times(kind, revolutions=10, count=240):
    t = np.linspace(0.0, revolutions * 2.0**1.5, count)
    if kind == "even":
        return t
    if kind == "gap":  # three revolutions without a sample
        return t[(t < 3 * 2.0**1.5) | (t > 6 * 2.0**1.5)]
    return np.sort(np.random.default_rng(7).uniform(t[0], t[-1], count))


@pytest.mark.parametrize("kind", ["even", "gap", "random"])
def test_noise_of_a_brillouin_radius_leaves_an_orbit_as_good_as_it_says(kind):
    t, squares = times(kind), []
    for seed in range(4):
        data = observed(t, kepler(t), 1.0, seed)
        orbit = search_orbit(data, point_mass, 2, NO_HARMONICS)
        away = orbit.states[:, :3] - kepler(t)
        squares.append(np.mean((away / orbit.position_sigmas) ** 2))
        assert np.median(orbit.position_sigmas) < 0.12  # the noise over sqrt(480 / 6)
        assert abs(orbit.reduced_square - 1.0) < 5 * np.sqrt(2 / (3 * len(t)))
    # six unknowns an orbit: a mean of 24 squares
    assert abs(np.mean(squares) - 1.0) < 5 * np.sqrt(2 / 24)


def test_accelerations_are_a_second_look_at_the_places():
    t = times("even")
    data = observed(t, kepler(t), 1.0, 0)
    mean, spread = data.averaged()
    np.testing.assert_allclose(spread, np.sqrt(0.5))
    assert np.std(mean - kepler(t)) == pytest.approx(np.sqrt(0.5), rel=0.1)
    # no use where their own noise hides them; and less use the farther off
    blind = OrbitData(t, data.positions, data.accelerations, 1.0, 1e3, GM)
    np.testing.assert_array_equal(blind.averaged()[0], data.positions)
    places = kepler_place(data.accelerations, GM)
    poor = OrbitData(t, data.positions, data.accelerations, 1.0, 0.2, GM).place_spread(places)
    far = np.linalg.norm(places, axis=1)
    usable = np.isfinite(poor)
    assert np.array_equal(np.argsort(poor[usable]), np.argsort(far[usable]))
    assert not usable.all()  # the farthest are not read


def test_a_place_is_where_the_mass_pulls_like_this():
    x = np.random.default_rng(0).normal(size=(9, 3))
    np.testing.assert_allclose(kepler_place(kepler_acceleration(x, GM), GM), x, rtol=1e-12)
    assert np.isfinite(kepler_place(np.zeros((1, 3)), GM)).all()


def test_an_ellipse_goes_on_from_one_of_its_states():
    t = times("even")
    states = first_guess(t, kepler(t), GM)
    np.testing.assert_allclose(states[:, :3], kepler(t), atol=1e-6)
    np.testing.assert_allclose(ellipse_through(states[70], t - t[70], GM), states, atol=1e-8)
    assert ellipse_through(states[70] * [1, 1, 1, 3, 3, 3], t, GM) is None


def test_steps_in_elements_are_steps_to_first_order_and_keep_the_mean_motion():
    rng = np.random.default_rng(0)
    states = np.hstack([2 * rng.normal(size=(20, 3)), 2 * rng.normal(size=(20, 3))])
    steps = rng.normal(size=(20, 6))
    off = [
        np.abs(step_in_elements(states, size * steps, GM) - states - size * steps).max()
        for size in (1e-3, 1e-4)
    ]
    assert off[0] / off[1] == pytest.approx(100.0, rel=0.1)  # second order
    # around a circle: straight ahead would raise the energy

    def energy(of):
        return 0.5 * (of[:, 3:] ** 2).sum(axis=1) - GM / np.linalg.norm(of[:, :3], axis=1)

    speed = np.sqrt(GM)
    circle = np.array([[1.0, 0, 0, 0, speed, 0]])
    ahead = np.array([[0, 0.3, 0, -0.3 * speed, 0, 0]])
    moved = step_in_elements(circle, ahead, GM)
    np.testing.assert_allclose(energy(moved), energy(circle), rtol=1e-6)
    turned = [np.cos(0.3), np.sin(0.3), 0, -speed * np.sin(0.3), speed * np.cos(0.3), 0]
    np.testing.assert_allclose(moved[0], turned, atol=1e-5)
    # what has no elements moves straight
    out = np.array([[1.0, 0, 0, 0, 3 * speed, 0]])
    np.testing.assert_array_equal(step_in_elements(out, ahead, GM), out + ahead)


def oblate(x):
    """A point mass with the J2 of Bennu, twice."""
    table = harmonics(x, 4)
    k, size = column(2, 0), -2 * 1.93e-2 / np.sqrt(5.0)
    value, slope = point_mass(x)
    first = [derivative(table, i) for i in range(3)]
    value = value + size * GM * np.stack([f[k] for f in first], axis=1)
    second = [[derivative(f, j)[k] for j in range(3)] for f in first]
    return value, slope + size * GM * np.moveaxis(np.array(second), 2, 0)


def test_a_long_orbit_that_turns_is_found_over_growing_spans():
    t = times("even", 20, 240)
    start = first_guess(t, kepler(t), GM)
    model = HarmonicField(oblate, -1, np.array([], dtype=int), GM)
    truth = start.copy()
    for k in range(0, 239, 6):  # half a revolution after the other
        rows = slice(k, min(k + 7, 240))
        guess = ellipse_through(truth[k], t[rows] - t[k], GM)
        truth[rows] = shoot(model, t[rows], guess, np.array([]), 1e-9, 0).states
    # the plane turns by more than a radian, so that one ellipse is far off
    poles = np.cross(truth[:, :3], truth[:, 3:])
    poles /= np.linalg.norm(poles, axis=1)[:, None]
    assert np.arccos(poles[0] @ poles[-1]) > 0.8
    data = observed(t, truth[:, :3], 0.3, 0)
    degrees = column_degrees(2)
    prior = np.where(degrees == 2, 0.025, 0.0)
    orbit = search_orbit(data, point_mass, 2, prior)
    away = (orbit.states[:, :3] - truth[:, :3]) / orbit.position_sigmas
    assert np.sqrt(np.mean(away**2)) < 2.0
    assert orbit.coefficients[column(2, 0)] == pytest.approx(-2 * 1.93e-2 / np.sqrt(5), rel=0.1)
    assert orbit.reduced_square == pytest.approx(1.0, abs=5 * np.sqrt(2 / 720))


def test_too_few_samples_are_refused():
    t = times("even")[:11]
    with pytest.raises(DataError, match=r"11 positions for an orbit\. Allowed: at least 12"):
        search_orbit(observed(t, kepler(t), 0.1, 0), point_mass, 2, NO_HARMONICS)


def test_orbits_that_cannot_be_told_apart_are_refused_with_what_was_tried():
    t = times("even")[::8]
    data = observed(t, kepler(t), 6.0, 0)
    with pytest.raises(
        NumericalError,
        match=r"30 positions with noise of 4.24 fit orbits of .* a revolution alike: squared "
        r"residuals .* apart \(allowed: 20\); \d+ mean motions tried, .* to .* a revolution\. "
        r"Give a longer or less noisy trajectory\.",
    ):
        search_orbit(data, point_mass, 2, NO_HARMONICS)


def test_samples_of_no_orbit_are_refused():
    t = times("even")
    x = 3.0 * np.random.default_rng(0).normal(size=(240, 3))
    data = OrbitData(t, x, kepler_acceleration(x, GM), 1e-3, 0.0, GM)
    with pytest.raises(
        NumericalError, match=r"no ellipse about the mass meets 240 samples: .* Check the times"
    ):
        search_orbit(data, point_mass, 2, NO_HARMONICS)
