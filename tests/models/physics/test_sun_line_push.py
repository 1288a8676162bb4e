"""A push along the Sun line knows neither distance nor shadow."""

import numpy as np

from unmodeled.models.physics import Dynamics, SolarRadiationPressure, SunLinePush
from unmodeled.models.physics.tracks import Tracks

SUN = np.array([3.0, -2.0, 2.5])
STILL = Tracks(-1.0, 1.0, {"sun": SUN[None]})


def test_it_has_one_size_and_points_away_from_the_sun():
    x = np.random.default_rng(7).normal(size=(20, 3))
    x = np.vstack([x, -2.0 * SUN])  # behind the body too
    a = Dynamics([SunLinePush()], {"sun_line_a": -0.3}, tracks=STILL).acceleration(x)
    np.testing.assert_allclose(np.linalg.norm(a, axis=1), 0.3, rtol=1e-14)
    np.testing.assert_allclose(np.cross(a, SUN - x), 0.0, atol=1e-14)
    assert np.all(np.sum(a * (SUN - x), axis=1) > 0)  # towards the Sun: the sign is negative
    light = Dynamics([SolarRadiationPressure(shadow=False)], {"srp_CrA_m": 1.0}, tracks=STILL)
    assert np.all(np.sum(a * light.acceleration(x), axis=1) < 0)
