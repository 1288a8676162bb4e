"""A third body pulls on the spacecraft and on the centre; the difference is what is felt."""

import heyoka as hy
import mpmath
import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.physics import Dynamics, PointMass, ThirdBody
from unmodeled.models.physics.tracks import Tracks

EPS = np.finfo(float).eps


def test_no_digit_is_lost_however_far_the_body_is():
    mpmath.mp.dps = 50
    points = 7e6 * np.random.default_rng(4).normal(size=(6, 3))
    for distance in (1e7, 3.8e8, 1.5e11, 1e15):
        place = distance * np.array([0.36, -0.48, 0.8])
        tracks = Tracks(-1.0, 1.0, {"sun": place[None]})
        model = Dynamics([ThirdBody("sun")], {"GM_sun": 1.3e20}, tracks=tracks)
        for r, a in zip(points, model.acceleration(points), strict=True):
            s = mpmath.matrix(place.tolist())
            d = s - mpmath.matrix(r.tolist())
            exact = 1.3e20 * (d / mpmath.norm(d) ** 3 - s / mpmath.norm(s) ** 3)
            exact = np.array([float(x) for x in exact])
            assert np.abs(a - exact).max() < 40 * EPS * np.linalg.norm(exact)


def test_a_circular_moon_is_the_circular_restricted_problem():
    """Earth-centred inertial axes against heyoka's rotating barycentric ones, half a month."""
    gm, gm_moon, distance = 3.986004418e14, 4.9028e12, 3.844e8
    mu = gm_moon / (gm + gm_moon)
    n = np.sqrt((gm + gm_moon) / distance**3)
    times = np.linspace(0.0, 1.2e6, 60)

    def moon(t):
        return distance * np.stack([np.cos(n * t), np.sin(n * t), 0 * t], axis=1)

    model = Dynamics(
        [PointMass(), ThirdBody("moon")],
        {"GM": gm, "GM_moon": gm_moon},
        tracks=Tracks.fit({"moon": moon}, 0.0, 1.2e6, tolerance=1e-14),
    )
    start = np.array([1.1e8, 2e7, 3e7, -4e2, 1.7e3, 2e2])
    orbit = model.propagate(start, times)

    # heyoka's axes: x from the Moon to the Earth, which lies at +mu; momenta are inertial
    # velocities on these axes. Lengths in Earth-Moon distances, times in 1 / n.
    def rotating(state, t):
        c, s = np.cos(n * t), np.sin(n * t)
        turn = -np.array([[c, s, 0], [-s, c, 0], [0, 0, -1]])
        r = turn @ state[:3] / distance + [mu, 0, 0]
        v = turn @ state[3:] / (distance * n) + [0, mu, 0]
        return np.concatenate([r, v])

    x = np.array([rotating(s, t) for s, t in zip(orbit, times, strict=True)])
    other = hy.taylor_adaptive(hy.model.cr3bp(mu), x[0]).propagate_grid(n * times)[-1]
    # 1e-12 of the distance: rounding of starts and tracks, grown over five close revolutions
    np.testing.assert_allclose(x, other, rtol=0, atol=1e-10)
    jacobi = hy.cfunc([hy.model.cr3bp_jacobi(mu)], hy.make_vars("x", "y", "z", "px", "py", "pz"))
    values = jacobi(np.ascontiguousarray(x.T))[0]
    assert np.ptp(values) < 1e-12 * abs(values[0])
    two_body = x[:, 3:] ** 2 @ np.ones(3) / 2 - (1 - mu) / np.linalg.norm(x[:, :3] - [mu, 0, 0])
    assert np.ptp(two_body) > 1e-3  # the Moon matters here


def test_sizes_of_the_card():
    # the largest pull of the Moon on a satellite at 6,878 km, 2 GM r / s^3
    for body, gm, s, size in (
        ("moon", 4.9028e12, 3.844e8, 1.2e-6),
        ("sun", 1.327e20, 1.496e11, 5.5e-7),
    ):
        tracks = Tracks(-1.0, 1.0, {body: np.array([[s, 0.0, 0.0]])})
        model = Dynamics([ThirdBody(body)], {f"GM_{body}": gm}, tracks=tracks)
        towards, across = model.acceleration([[6.878e6, 0, 0], [0, 6.878e6, 0]])
        assert towards[0] == pytest.approx(size, rel=0.07)
        assert across[1] == pytest.approx(-towards[0] / 2, rel=0.06)


def test_what_is_missing_is_said():
    sun = Tracks(0.0, 10.0, {"sun": np.array([[5.0, 0, 0]])})
    for tracks in (None, sun):
        with pytest.raises(ConfigError) as caught:
            Dynamics([ThirdBody("moon")], tracks=tracks)
        assert str(caught.value) == (
            "the force model needs the position of moon. Give tracks with it."
        )
    model = Dynamics([PointMass(), ThirdBody("sun")], tracks=sun)
    with pytest.raises(DataError, match=r"^times from 0 s to 20 s\. Allowed: 0 s to 10 s, where"):
        model.propagate([1.0, 0, 0, 0, 1.0, 0], [0.0, 20.0])
