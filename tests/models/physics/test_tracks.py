"""Chebyshev series of other bodies' positions: as exact as asked, the same in compiled code."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.models.physics import Dynamics, ThirdBody
from unmodeled.models.physics.tracks import Tracks


def moon(t, rate=0.4):
    return 5.0 * np.stack([np.cos(rate * t), np.sin(rate * t), 0.1 * np.sin(3 * rate * t)], axis=1)


def test_the_series_is_as_exact_as_asked_and_no_longer_than_needed():
    times = np.linspace(-3.0, 4.0, 999)
    degrees = []
    for tolerance in (1e-4, 1e-8, 1e-13):
        tracks = Tracks.fit({"moon": moon}, -3.0, 4.0, tolerance)
        error = np.abs(tracks.position("moon", times) - moon(times)).max()
        assert error < 1.5 * tolerance * 5.03
        degrees.append(tracks.degree)
    assert degrees == sorted(set(degrees))


def test_compiled_code_sees_the_same_positions():
    times = np.linspace(-3.0, 4.0, 50)
    tracks = Tracks.fit({"moon": moon, "sun": lambda t: 7.0 + moon(t, 0.1)}, -3.0, 4.0)
    model = Dynamics([ThirdBody("moon"), ThirdBody("sun")], {"GM_moon": 1.0}, tracks=tracks)
    points = np.tile([[0.3, -0.2, 0.1]], (50, 1))
    s = moon(times)
    d = s - points
    expected = (
        d / np.linalg.norm(d, axis=1)[:, None] ** 3 - s / np.linalg.norm(s, axis=1)[:, None] ** 3
    )
    # the tolerance of the fit is 1e-11 of the distance
    np.testing.assert_allclose(model.acceleration(points, times), expected, rtol=0, atol=1e-11)


def test_another_epoch_compiles_nothing():
    from unmodeled.models.physics import compiled

    early, late = (Tracks.fit({"moon": moon}, t, t + 7.0) for t in (0.0, 100.0))
    assert early.degree == late.degree
    values = {"GM_moon": 1.0}
    Dynamics([ThirdBody("moon")], values, tracks=early).acceleration([[1.0, 0, 0]], 1.0)
    misses = compiled.acceleration_function.cache_info().misses
    Dynamics([ThirdBody("moon")], values, tracks=late).acceleration([[1.0, 0, 0]], 101.0)
    assert compiled.acceleration_function.cache_info().misses == misses


def test_what_cannot_be():
    with pytest.raises(
        ConfigError, match=r"^tracks from 2\.0 s to 1\.0 s\. Allowed: start < end\.$"
    ):
        Tracks(2.0, 1.0)
    with pytest.raises(ConfigError, match=r"^tracks of different degrees\. Fit them together\.$"):
        Tracks(0.0, 1.0, {"sun": np.ones((1, 3)), "moon": np.ones((2, 3))})
    with pytest.raises(NumericalError, match=r"^positions over 7000 s need more than degree 91 \("):
        Tracks.fit({"moon": moon}, 0.0, 7000.0)
    tracks = Tracks.fit({"moon": moon}, 0.0, 7.0)
    with pytest.raises(ConfigError) as caught:
        tracks.position("mon", [1.0])
    assert str(caught.value) == ('there is no track of "mon". Allowed: moon. Did you mean "moon"?')
    with pytest.raises(DataError, match=r"^times from 1 s to 8 s\. Allowed: 0 s to 7 s, where Sun"):
        tracks.position("moon", [1.0, 8.0])
    assert Tracks(0.0, 1.0).degree == 0
