"""First entry into a sphere, against a dense propagation and against its own neighbours."""

import math

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.physics import Dynamics, PointMass, Zonal

GM = 4 * math.pi**2


def bennu():
    values = {"GM": GM, "R_ref": 1.0, "J2": 1.93e-2, "J3": -1.22e-3, "J4": -6.5e-3, "J5": 6.73e-5}
    return Dynamics([PointMass(), Zonal((2, 3, 4, 5))], values)


def orbits(n=24):
    """States about the peri- or apoapsis, some of which come down; durations of 2-12 periods."""
    generator = np.random.default_rng(21)
    radius = generator.uniform(1.15, 2.5, n)
    x = generator.normal(size=(n, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    across = np.cross(x, generator.normal(size=(n, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    speed = np.sqrt(GM / radius) * generator.uniform(0.75, 1.1, n)
    return np.hstack([x * radius[:, None], across * speed[:, None]]), generator.uniform(3, 12, n)


def brute_force(model, state, duration):
    """Bracket the first sample below r = 1 and bisect; periods are 1 or more."""
    times = np.linspace(0.0, duration, int(duration * 2000) + 1)
    radius = np.linalg.norm(model.propagate(state, times)[:, :3], axis=1)
    below = np.flatnonzero(radius < 1.0)
    if not len(below):
        return math.nan
    low, high = times[below[0] - 1], times[below[0]]
    for _ in range(60):
        middle = (low + high) / 2
        if middle in (0.0, low, high):
            break
        r = np.linalg.norm(model.propagate(state, [0.0, middle])[-1, :3])
        low, high = (middle, high) if r >= 1.0 else (low, middle)
    return (low + high) / 2


def test_against_brute_force():
    model = bennu()
    states, durations = orbits()
    entry = model.first_collision(states, durations, 1.0)
    expected = [brute_force(model, s, d) for s, d in zip(states, durations, strict=True)]
    hits = ~np.isnan(expected)
    assert 4 < hits.sum() < 20  # the case has both kinds
    # Screened at 1e-12 a step for up to 12 revolutions: 1e-9 in position at worst, over a radial
    # speed of about 1.
    np.testing.assert_allclose(entry, expected, rtol=0, atol=1e-9)


def test_neighbours_do_not_matter_to_the_last_bit():
    model = bennu()
    states, durations = orbits()
    together = model.first_collision(states, durations, 1.0)
    backwards = model.first_collision(states[::-1], durations[::-1], 1.0)[::-1]
    alone = [
        model.first_collision(states[k : k + 1], durations[k : k + 1], 1.0)[0]
        for k in range(len(states))
    ]
    assert np.array_equal(together, backwards, equal_nan=True)
    assert np.array_equal(together, alone, equal_nan=True)
    copies = model.first_collision(np.tile(states[:1], (5, 1)), np.tile(durations[:1], 5), 1.0)
    assert len(set(map(str, copies))) == 1


def test_radial_fall_by_hand():
    # From rest at r = 2 with GM = 1: r = 1 + cos(E), t = E + sin(E); r = 1 at E = pi / 2.
    model = Dynamics([PointMass()])
    entry = model.first_collision([[2.0, 0, 0, 0, 0, 0]], [3.0], 1.0)
    assert entry[0] == pytest.approx(math.pi / 2 + 1, abs=1e-11)


def test_inside_is_zero_and_free_is_nan():
    model = bennu()
    circle = [1.5, 0, 0, 0, 2 * math.pi / math.sqrt(1.5), 0]
    inside, surface = [0.5, 0, 0, 0, 9.0, 0], [1.0, 0, 0, 0, 9.0, 0]
    entry = model.first_collision([circle, inside, surface, circle], [5.0] * 4, 1.0)
    assert np.isnan(entry[[0, 3]]).all()
    assert not entry[[1, 2]].any()
    assert model.first_collision([inside], [5.0], 1.0)[0] == 0.0


def test_a_collision_after_the_end_does_not_count():
    model = Dynamics([PointMass()])
    state, when = [[2.0, 0, 0, 0, 0, 0]], math.pi / 2 + 1
    assert np.isnan(model.first_collision(state, [when - 1e-6], 1.0)[0])
    assert model.first_collision(state, [when + 1e-6], 1.0)[0] == pytest.approx(when, abs=1e-11)


def test_passing_the_centre_outside_any_sphere_is_never_silent():
    # A radius so small that the fall reaches the singularity's neighbourhood first.
    model = Dynamics([PointMass()])
    entry = model.first_collision([[2.0, 0, 0, 0, 0, 0]], [4.0], 1e-3)
    assert entry[0] == pytest.approx(math.pi, abs=1e-3)


def test_no_orbits():
    assert bennu().first_collision(np.empty((0, 6)), [], 1.0).shape == (0,)


@pytest.mark.parametrize(
    ("states", "durations", "radius", "kind", "text"),
    [
        (
            np.ones((2, 5)),
            [1, 1],
            1.0,
            DataError,
            "states has shape (2, 5). Allowed: shape (b, 6).",
        ),
        (np.ones((2, 6)), [1], 1.0, DataError, "durations has shape (1,). Allowed: shape (2,)."),
        (np.ones((2, 6)), [1, 0], 1.0, ConfigError, "duration is 0.0. Allowed: numbers > 0."),
        (np.ones((1, 6)), [1], 0.0, ConfigError, "collision radius is 0.0. Allowed: a number > 0."),
        (np.ones((1, 6)), [1], -2, ConfigError, "collision radius is -2. Allowed: a number > 0."),
        (
            np.ones((1, 6)),
            [1],
            math.nan,
            ConfigError,
            "collision radius is nan. Allowed: a number > 0.",
        ),
    ],
)
def test_refusals(states, durations, radius, kind, text):
    with pytest.raises(kind) as caught:
        bennu().first_collision(states, durations, radius)
    assert str(caught.value) == text
