import math

import numpy as np
import pandas as pd
import pytest
from tests.models.physics.orbits import kepler_orbit

from unmodeled.core.units import NORMALISED_GM, NormalisedUnits
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import ELEMENT_NAMES
from unmodeled.datasets.initial_conditions import states_of
from unmodeled.datasets.simulation import gravity_of, simulate_orbits
from unmodeled.datasets.trajectory import Trajectory
from unmodeled.pipeline.flight import Flight, fly

BODY = load_body("bennu")
UNITS = NormalisedUnits.of_body(BODY.gm, BODY.brillouin_radius)


@pytest.fixture(scope="module")
def truth():
    table = pd.DataFrame([[1.9, 0.3, 60, 10, 20, 30]], columns=list(ELEMENT_NAMES))
    states = states_of(table, BODY.gm, BODY.brillouin_radius)
    out = simulate_orbits(gravity_of(BODY), table, states, BODY.brillouin_radius, periods=[3.0])
    return out.orbits[0], out.periods[0]


def field(x):
    return gravity_of(BODY).acceleration(x * UNITS.length) / UNITS.acceleration


def mass(x):
    return -NORMALISED_GM * x / np.linalg.norm(x, axis=1, keepdims=True) ** 3


def counted(function):
    def call(x):
        call.count += 1
        return function(x)

    call.count = 0
    return call


def test_the_true_field_leaves_the_solvers_error_only(truth):
    orbit, period = truth
    acceleration = counted(field)
    flight = fly(acceleration, orbit, UNITS, period, 3 * period)
    assert flight.status == "complete"
    assert np.array_equal(flight.times, orbit.times)
    assert flight.position_error[0] == 0.0
    # Eighth order, some 150 steps a period: (2 pi / 150)^8 / 8! is 2e-16 a step; the smallest
    # structure, near the body, costs some digits more.
    assert flight.position_error.max() < 1e-9 * orbit.radii.max()
    assert flight.evaluations == acceleration.count


def test_a_point_mass_drifts_away(truth):
    """The missing J2 is a share J2 (R/a)^2 of the attraction; three periods add it up."""
    orbit, period = truth
    flight = fly(mass, orbit, UNITS, period, 3 * period)
    assert flight.status == "complete"
    size = 1.93e-2 / 1.9**2 * orbit.radii.max()
    assert size < flight.largest_error(3 * period) < 100 * size
    # it grows from period to period
    errors = [flight.largest_error(k * period) for k in (1, 2, 2.95)]
    assert errors == sorted(errors)


def test_independent_reference(truth):
    """A Kepler orbit of the same start by another solver gives the same distance."""
    orbit, period = truth
    flight = fly(mass, orbit, UNITS, period, 3 * period)
    kepler = kepler_orbit(orbit.states[0], BODY.gm, orbit.times)[:, :3]
    expected = np.linalg.norm(kepler - orbit.positions, axis=1)
    np.testing.assert_allclose(
        flight.position_error, expected, rtol=0, atol=1e-8 * orbit.radii.max()
    )


def test_duration(truth):
    orbit, period = truth
    flight = fly(field, orbit, UNITS, period, period)
    assert flight.times[-1] == pytest.approx(period, rel=1e-12)
    assert len(flight.times) == 26
    assert len(fly(field, orbit, UNITS, period, 0.5 * period / 25).times) == 1
    whole = fly(field, orbit, UNITS, period, 99 * period)
    assert len(whole.times) == len(orbit)


def test_epoch_of_the_truth_does_not_matter(truth):
    orbit, period = truth
    late = Trajectory(orbit.times + 1e5, orbit.positions, orbit.velocities)
    a, b = fly(field, orbit, UNITS, period, period), fly(field, late, UNITS, period, period)
    np.testing.assert_allclose(b.times, a.times, rtol=0, atol=1e-9)
    np.testing.assert_allclose(b.position_error, a.position_error, atol=1e-8 * 1000)


def ends(acceleration, truth, status):
    orbit, period = truth
    flight = fly(acceleration, orbit, UNITS, period, 3 * period)
    assert flight.status == status
    assert 1 <= len(flight.times) == len(flight.position_error) <= len(orbit)
    assert np.isfinite(flight.position_error).all()
    assert flight.largest_error(3 * period) == math.inf
    return flight


def test_fell_into_the_body(truth):
    flight = ends(lambda x: 8 * mass(x), truth, "fell into the body")
    # until then it counts
    assert flight.largest_error(flight.times[-1]) < math.inf


def test_left_the_region(truth):
    ends(lambda x: -mass(x), truth, "left the region")
    ends(lambda x: 1e6 * x, truth, "left the region")


@pytest.mark.parametrize("size", [1e100, 1e200, 1e300])
def test_a_field_that_overflows(truth, size):
    flight = ends(lambda x: np.full_like(x, size), truth, "left the region")
    assert len(flight.times) == 1


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_field_not_finite_at_once(truth, value):
    flight = ends(lambda x: np.full_like(x, value), truth, "field not finite")
    assert len(flight.times) == 1
    assert flight.evaluations == 1


def test_field_not_finite_later(truth):
    high = truth[0].radii.max() / UNITS.length * 0.99

    def holed(x):
        return field(x) if np.linalg.norm(x) < high else np.full_like(x, np.nan)

    assert len(ends(holed, truth, "field not finite").times) > 1


def test_cost_does_not_depend_on_the_field(truth):
    """Steps are fixed in advance: a field that is partly noise costs what a smooth one costs."""
    orbit, period = truth
    generator = np.random.default_rng(0)

    def noisy(x):
        return field(x) * (1 + 1e-3 * generator.normal(size=x.shape))

    rough, smooth = (fly(a, orbit, UNITS, period, 3 * period) for a in (noisy, field))
    assert rough.status == "complete"
    assert rough.evaluations == smooth.evaluations
    # 12 stages (and 2 more evaluations at a restart) for each of some 100-200 steps a period
    assert 3 * 100 * 12 <= smooth.evaluations <= 3 * 300 * 14


def test_a_lone_spike_ends_the_flight_or_is_stepped_over(truth):
    orbit, period = truth
    for nth in range(300, 312):  # every stage of a step
        calls = iter(range(10**9))

        def spiked(x, calls=calls, nth=nth):
            return field(x) * (1e14 if next(calls) == nth else 1.0)

        flight = fly(spiked, orbit, UNITS, period, period)
        assert flight.status in ("complete", "left the region", "step too small")
        assert np.isfinite(flight.position_error).all()


def test_largest_error_up_to_a_time(truth):
    orbit, period = truth
    flight = fly(mass, orbit, UNITS, period, 3 * period)
    assert flight.largest_error(0.0) == 0.0
    until = flight.times[10]
    assert flight.largest_error(until) == flight.position_error[:11].max()
    for slip in (1 - 1e-15, 1 + 1e-15):  # 10 * (period / 25) is not period * 0.4 to the last bit
        assert flight.largest_error(until * slip) == flight.position_error[:11].max()
    short = Flight(flight.times[:11], flight.position_error[:11], "left the region", 7)
    assert short.largest_error(until * (1 + 1e-15)) == flight.position_error[:11].max()
    assert short.largest_error(until * 1.001) == math.inf
