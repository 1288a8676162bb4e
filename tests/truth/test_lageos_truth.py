"""The real LAGEOS-2 orbit against independent physics: EGM2008, Sun and Moon.

Reader, Earth orientation, smoother and time scale are all in this one number. The field is
heyoka's copy of EGM2008, the Sun and the Moon are astropy's; neither is ours.
"""

import os
from pathlib import Path

import heyoka as hy
import numpy as np
import pytest
from astropy.coordinates import get_body
from astropy.time import Time, TimeDelta

from unmodeled.core.earth_orientation import icrf_from_itrf
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.readers import read_trajectory
from unmodeled.pipeline.characterize import characterize
from unmodeled.pipeline.config import load_config
from unmodeled.pipeline.prepare import prepare

FOLDER = Path(os.environ.get("UNMODELED_DATA", Path(__file__).parents[3] / "shared" / "real"))
FILE = FOLDER / "sp3-lageos2" / "ilrsa.orb.lageos2.160319.v35.sp3"
SCENARIO = Path(__file__).parents[2] / "scenarios" / "lageos2-phase.yaml"
#: GM of Sun and Moon, m3/s2, IAU 2015 nominal and DE421; good to far more digits than needed.
GM = {"sun": 1.32712440e20, "moon": 4.9028e12}

pytestmark = [
    pytest.mark.real,
    pytest.mark.skipif(not FILE.exists(), reason=f"no real measurements at {FOLDER}"),
]


@pytest.fixture(scope="module")
def orbit():
    whole = read_trajectory(FILE, satellite="L52")
    return whole[200:1640:4]  # two days, away from the ends of the arc


def earth_field(orbit, degree):
    x = hy.make_vars("x", "y", "z")
    field = hy.cfunc(hy.model.egm2008_acc(list(x), degree, degree), list(x))
    turn = icrf_from_itrf(orbit.epoch, orbit.times)
    fixed = np.einsum("nji,nj->ni", turn, orbit.positions)
    return np.einsum("nij,nj->ni", turn, field(inputs=np.ascontiguousarray(fixed.T)).T)


def third_body(orbit, name):
    day, scale = orbit.epoch.split()
    times = Time(day, scale=scale.lower()) + TimeDelta(orbit.times, format="sec")
    body = get_body(name, times, ephemeris="builtin").cartesian.xyz.to_value("m").T
    towards = body - orbit.positions

    def pull(d):
        return GM[name] * d / np.linalg.norm(d, axis=1, keepdims=True) ** 3

    return pull(towards) - pull(body)


def median_error(orbit, model):
    error = np.linalg.norm(orbit.accelerations - model, axis=1)
    return float(np.median(error / np.linalg.norm(orbit.accelerations, axis=1)))


def test_each_effect_brings_the_model_nearer_to_the_measured_accelerations(orbit):
    r = np.linalg.norm(orbit.positions, axis=1, keepdims=True)
    point_mass = -load_body("earth").gm * orbit.positions / r**3
    field = earth_field(orbit, 20)
    moon = field + third_body(orbit, "moon")
    both = moon + third_body(orbit, "sun")
    ladder = [median_error(orbit, m) for m in (point_mass, field, moon, both)]
    print("point mass, +EGM2008 20x20, +Moon, +Sun:", [f"{e:.2g}" for e in ladder])
    assert ladder == sorted(ladder, reverse=True)
    # J2 at 1.9 radii; Sun and Moon together are 6e-7 of the attraction.
    assert ladder[0] == pytest.approx(4.4e-4, rel=0.05)
    assert 1e-7 < ladder[1] < 1e-6
    # What is left: solid tide (1e-8 m/s2), radiation pressure (3.6e-9 m/s2) and the smoother's
    # stated error, together about 1.5e-8 m/s2 or 6e-9 of the acceleration.
    assert ladder[3] < 1.5e-8


def test_the_earth_must_turn(orbit):
    """The same ladder with the Earth's orientation an hour late fails: the test can fail."""
    late = orbit.times + 3600.0
    x = hy.make_vars("x", "y", "z")
    field = hy.cfunc(hy.model.egm2008_acc(list(x), 20, 20), list(x))
    turn = icrf_from_itrf(orbit.epoch, late)
    fixed = np.einsum("nji,nj->ni", turn, orbit.positions)
    wrong = np.einsum("nij,nj->ni", turn, field(inputs=np.ascontiguousarray(fixed.T)).T)
    wrong += third_body(orbit, "moon") + third_body(orbit, "sun")
    assert median_error(orbit, wrong) > 1e-7


def scenario(*learners):
    config = load_config(SCENARIO)
    data = config.as_dict()["data"] | {"train_periods": 15, "extrapolation_periods": 5}
    flight = {"periods": [1], "orbits": 1}
    return load_config(
        SCENARIO, learners=list(learners), data=data, flight=flight, training_check=False
    )


def test_the_phase_of_the_earth_explains_what_the_position_leaves_over():
    gp = {"kind": "sparse_gp"}
    phase = gp | {"inputs": ["position", "phase"], "phase_period": 86164.1}
    alone, aware = characterize(scenario(gp, phase), [FILE.parent]).learners
    median = [r.summaries["extrapolation"].median for r in (alone, aware)]
    # Tesserals make 3e-6 of the acceleration here; Moon and Sun, 3e-7, are in neither.
    assert 2e-6 < median[0] < 5e-6
    assert median[1] < 0.3 * median[0]
    flown = [r.flights[1].flight.position_error[-1] for r in (alone, aware)]
    assert flown[1] < 0.5 * flown[0]


def test_the_sun_stands_where_astropy_has_it():
    sunny = {"kind": "elm", "inputs": ["position", "sun_direction"]}
    data = prepare(scenario(sunny), [FILE.parent])
    s, orbit = data.extrapolation, data.orbits[1]
    day, scale = orbit.epoch.split()
    times = Time(day, scale=scale.lower()) + TimeDelta(orbit.times, format="sec")
    sun = get_body("sun", times, ephemeris="builtin").cartesian.xyz.to_value("m").T
    sun /= np.linalg.norm(sun, axis=1, keepdims=True)
    # Aberration, 1e-4, is in astropy's place and not in ours.
    assert s.sun_directions == pytest.approx(sun, abs=3e-4)
