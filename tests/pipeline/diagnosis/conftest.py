"""Small cases about the Earth, with orientation and known truth."""

import numpy as np
import pytest

from unmodeled.core.earth_orientation import icrf_from_itrf
from unmodeled.core.ephemeris import load_ephemeris
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics, PointMass, Tesseral, Zonal
from unmodeled.models.physics.orientation import Orientation
from unmodeled.models.physics.tracks import Tracks
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.cases.catalogue import default_candidates
from unmodeled.pipeline.fit_problem import Arc

EPOCH = "2015-03-01T00:00:00 UTC"
DAY = 86400.0
EARTH = load_body("earth")
VALUES = {
    "GM": EARTH.gm,
    "R_ref": 6378136.3,
    "J2": 1.0826e-3,
    "C_2_2": 2.44e-6,
    "S_2_2": -1.4e-6,
}


@pytest.fixture(scope="session")
def surroundings():
    """Sun, Moon and the Earth's orientation over a day and a margin."""
    ephemeris = load_ephemeris()
    start, end = -200.0, DAY + 200.0
    places = {
        name: (lambda t, name=name: ephemeris.position(name, "earth", EPOCH, t))
        for name in ("sun", "moon")
    }
    orientation = Orientation.fit(
        lambda t: np.swapaxes(icrf_from_itrf(EPOCH, t), 1, 2), 7.292115e-5, start, end
    )
    return {"tracks": Tracks.fit(places, start, end), "orientation": orientation}


def model(surroundings, effects=(), values=None):
    """Return point mass, J2 and C22 with more effects."""
    known = (PointMass(), Zonal((2,)), Tesseral(2, 2))
    return Dynamics((*known, *effects), VALUES | dict(values or {}), **surroundings)


def state_of(a, eccentricity, inclination):
    """Return a state at periapsis."""
    r = a * (1 - eccentricity)
    v = np.sqrt(EARTH.gm / r * (1 + eccentricity))
    return np.array([r, 0, 0, 0, v * np.cos(inclination), v * np.sin(inclination)])


def positions(truth, state, sigma, seed=1, step=120.0, **more):
    """Return noisy positions over a day."""
    times = np.arange(step, DAY, step)
    states = truth.propagate(state, np.concatenate([[0.0], times]))[1:]
    noise = sigma * np.random.default_rng(seed).standard_normal((len(times), 3))
    return Measurements("position", times, states[:, :3] + noise, sigma, "positions", **more)


def case_of(known, state, measurements, candidates=None, **more):
    """Return a case with one arc."""
    arc = Arc(0.0, state, tuple(measurements), "day")
    found = default_candidates(EARTH, known, [arc])
    if candidates is not None:
        found = tuple(c for c in found if c.name in candidates)
    return Case("test", EARTH, EPOCH, known, (arc,), candidates=found, **more)
