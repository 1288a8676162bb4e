"""The smoother against orbits whose accelerations are known."""

import numpy as np
import pytest

from unmodeled.core.errors import DataError, UnmodeledWarning
from unmodeled.datasets.smoother import smooth, with_accelerations
from unmodeled.datasets.trajectory import Trajectory

# name, semi-major axis (m), eccentricity, step (s), samples
ORBITS = [
    ("lageos", 12.164e6, 0.0136, 120.0, 600),
    ("low", 7.2e6, 0.001, 60.0, 600),
    ("gps", 26.56e6, 0.01, 900.0, 192),
    ("eccentric", 12.0e6, 0.4, 60.0, 400),
]
POSITION, VELOCITY = 1e-3 / 12**0.5, 1e-7 / 12**0.5


def rms(values):
    return np.sqrt(np.mean(values**2))


@pytest.mark.parametrize("with_velocity", [True, False])
@pytest.mark.parametrize(("name", "a", "e", "step", "n"), ORBITS)
def test_error_estimate_brackets_the_true_error(j2_orbit, name, a, e, step, n, with_velocity):
    t = np.arange(n) * step
    r, v, acc = j2_orbit(a, e, t)
    made = smooth(
        t,
        np.round(r, 3),  # as SP3 prints them: 1 mm and 1e-7 m/s
        np.round(v, 7) if with_velocity else None,
        position_noise=POSITION,
        velocity_noise=VELOCITY,
    )
    error = np.sqrt(np.mean((made.accelerations - acc) ** 2, axis=1))
    for part in (slice(12, -12), np.r_[0:12, n - 12 : n]):
        assert 1 / 3 < rms(error[part]) / rms(made.sigma[part]) < 3
    speed = np.sqrt(np.mean((made.velocities - v) ** 2, axis=1))[12:-12]
    assert 1 / 3 < rms(speed) / rms(made.velocity_sigma[12:-12]) < 3


def test_lageos_as_printed_in_sp3_gives_a_tenth_of_a_nanometre(j2_orbit):
    # Regression value: 6.4e-11 m/s2 rms inside the arc, 2.3e-9 from positions alone.
    t = np.arange(600) * 120.0
    r, v, acc = j2_orbit(12.164e6, 0.0136, t)
    both = smooth(t, np.round(r, 3), np.round(v, 7))
    assert rms((both.accelerations - acc)[12:-12]) < 1e-10
    alone = smooth(t, np.round(r, 3))
    assert 1e-9 < rms((alone.accelerations - acc)[12:-12]) < 4e-9


def test_noise_is_found_in_the_data(j2_orbit):
    t = np.arange(400) * 120.0
    r, v, acc = j2_orbit(12.164e6, 0.0136, t)
    rng = np.random.default_rng(1)
    noisy = r + rng.normal(0, 0.5, r.shape), v + rng.normal(0, 1e-3, v.shape)
    told = smooth(t, *noisy, position_noise=0.5, velocity_noise=1e-3)
    found = smooth(t, *noisy)
    assert np.median(found.sigma) == pytest.approx(np.median(told.sigma), rel=0.15)
    assert 1 / 3 < rms((found.accelerations - acc)[12:-12]) / np.median(found.sigma) < 3


def test_a_polynomial_is_differentiated_exactly():
    rng = np.random.default_rng(2)
    t = np.sort(rng.uniform(0, 10, 60))
    c = rng.normal(size=(5, 3))
    powers = np.arange(5)
    r = (t[:, None] ** powers) @ c
    v = (powers[1:] * t[:, None] ** (powers[1:] - 1)) @ c[1:]
    acc = (powers[2:] * (powers[2:] - 1) * t[:, None] ** (powers[2:] - 2)) @ c[2:]
    made = smooth(t, r, v, position_noise=1e-9, velocity_noise=1e-9, gap=100.0)
    np.testing.assert_allclose(made.accelerations, acc, atol=1e-6)
    np.testing.assert_allclose(made.velocities, v, atol=1e-7)


def test_windows_never_cross_a_gap(j2_orbit):
    t = np.arange(200) * 60.0
    t[100:] += 5400.0
    r, v, acc = j2_orbit(7.2e6, 0.001, t)
    # A manoeuvre hidden in the gap: each side must be what it is when read alone.
    r[100:] += [100.0, 0, 0]
    whole = smooth(t, r, v, position_noise=1e-3, velocity_noise=1e-6)
    for part in (slice(0, 100), slice(100, 200)):
        alone = smooth(t[part], r[part], v[part], position_noise=1e-3, velocity_noise=1e-6)
        np.testing.assert_array_equal(whole.accelerations[part], alone.accelerations)
        assert rms((whole.accelerations - acc)[part]) < 1e-5


def test_short_pieces_and_bad_noise_are_refused():
    t = np.r_[np.arange(30.0), 100.0, 101.0, 102.0]
    r = np.stack([np.cos(t), np.sin(t), t], axis=1)
    with pytest.raises(DataError, match=r"3 samples from 100.000 s to 102.000 s between gaps"):
        smooth(t, r)
    with pytest.raises(DataError, match=r"position_noise is -1.0\. Allowed: a number > 0"):
        smooth(t[:30], r[:30], position_noise=-1.0)


def test_a_trajectory_keeps_its_states_and_says_what_was_done(j2_orbit):
    t = np.arange(100) * 120.0
    r, v, acc = j2_orbit(12.164e6, 0.0136, t)
    bare = Trajectory(t, r, v, notes={"kept": 1})
    made = with_accelerations(bare)
    np.testing.assert_array_equal(made.states, bare.states)
    assert made.notes["kept"] == 1
    assert made.acceleration_sigma == made.notes["accelerations"]["median_sigma_m_s2"] > 0
    assert np.abs(made.accelerations - acc).max() < 1e-6
    with pytest.raises(DataError, match="cannot be smoothed in the body_fixed frame"):
        with_accelerations(Trajectory(t, r, v, frame="body_fixed"))


def test_a_coarse_table_of_an_eccentric_orbit_warns(j2_orbit):
    # 25 samples a revolution at e = 0.75: nothing can follow the periapsis.
    a, e = 30e6, 0.75
    period = 2 * np.pi * np.sqrt(a**3 / 3.986004415e14)
    t = np.arange(251) * period / 25
    r, v, _ = j2_orbit(a, e, t)
    with pytest.warns(UnmodeledWarning, match=r"of 251 smoothed accelerations are uncertain"):
        with_accelerations(Trajectory(t, r, v))
