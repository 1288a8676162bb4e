import math

import numpy as np
import pandas as pd
import pytest
from tests.models.physics.orbits import kepler_orbit

from unmodeled.core.errors import ConfigError
from unmodeled.datasets.bodies import Body, load_body
from unmodeled.datasets.elements import ELEMENT_NAMES, kepler_period
from unmodeled.datasets.initial_conditions import states_of
from unmodeled.datasets.simulation import gravity_of, simulate_orbits

BODY = load_body("bennu")
R = BODY.brillouin_radius
TABLE = pd.DataFrame(
    [[1.8, 0.2, 60, 10, 20, 30], [2.5, 0.4, 120, 50, 70, 100]], columns=list(ELEMENT_NAMES)
)


def simulate(dynamics=None, periods=(10.0, 3.0), **options):
    states = states_of(TABLE, BODY.gm, R)
    return simulate_orbits(
        dynamics or gravity_of(BODY), TABLE, states, R, periods=list(periods), **options
    )


def test_sampling():
    out = simulate()
    assert [len(o) for o in out.orbits] == [250, 75]
    for k, orbit in enumerate(out.orbits):
        period = float(kepler_period(TABLE["semi_major_axis"][k] * R, BODY.gm))
        assert out.periods[k] == period
        np.testing.assert_allclose(orbit.times, period / 25 * np.arange(len(orbit)), rtol=1e-15)
        assert orbit.frame == "inertial"
        assert orbit.source == f"simulated orbit {k}"
        assert np.array_equal(orbit.states[0], states_of(TABLE, BODY.gm, R)[k])
        assert out.lowest_radius[k] == orbit.radii.min()


def test_samples_obey_the_field():
    dynamics = gravity_of(BODY)
    for orbit in simulate().orbits:
        assert np.array_equal(orbit.accelerations, dynamics.acceleration(orbit.positions))
        energy = 0.5 * np.sum(orbit.velocities**2, axis=1) - dynamics.potential(orbit.positions)
        # rounding over 10 revolutions of about 20 steps
        assert np.ptp(energy) < 1e-13 * np.abs(energy).max() * 10


def test_point_mass_orbit():
    plain = Body("ball", "Ball", gm=4.89, brillouin_radius=R, reference_radius=R)
    dynamics = gravity_of(plain)
    assert [e.name for e in dynamics.effects] == ["point_mass"]
    for orbit in simulate(dynamics).orbits:
        expected = kepler_orbit(orbit.states[0], 4.89, orbit.times)
        assert np.abs(orbit.positions - expected[:, :3]).max() < 1e-11 * 4 * R


def test_rk4_converges_to_the_heyoka_orbit():
    steps = [800, 1600, 3200]  # with 200 the slope is still 4.4
    errors = [simulate(periods=(0.5, 0.5), rk4_steps_per_period=n).rk4_difference for n in steps]
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    np.testing.assert_allclose(slope, 4.0, atol=0.3)


def test_integrator_is_a_choice():
    a, b = simulate(), simulate(integrator="rk4")
    assert np.array_equal(a.rk4_difference, b.rk4_difference)
    for k in range(2):
        distance = np.linalg.norm(a.orbits[k].positions - b.orbits[k].positions, axis=1)
        assert distance.max() == pytest.approx(a.rk4_difference[k], rel=1e-12)
        exact = gravity_of(BODY).acceleration(b.orbits[k].positions)
        assert np.array_equal(b.orbits[k].accelerations, exact)


def test_an_orbit_does_not_depend_on_the_others():
    dynamics, states = gravity_of(BODY), states_of(TABLE, BODY.gm, R)
    alone = simulate_orbits(dynamics, TABLE.iloc[1:], states[1:], R, periods=[3.0])
    assert np.array_equal(alone.orbits[0].states, simulate().orbits[1].states)


def test_gravity_of_a_card():
    dynamics = gravity_of(BODY)
    assert [e.name for e in dynamics.effects] == ["point_mass", "zonal"]
    # [Neamati2022] Table 2
    assert dynamics.values == {
        "GM": 4.89,
        "R_ref": 290.0,
        "J2": 1.93e-2,
        "J3": -1.22e-3,
        "J4": -6.5e-3,
        "J5": 6.73e-5,
    }
    normalised = Body("b", "B", 4.89, R, R, {2: 0.01}, zonal_convention="fully_normalised")
    assert gravity_of(normalised).values["J2"] == pytest.approx(0.01 * math.sqrt(5), rel=1e-15)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"samples_per_period": 3}, "samples_per_period is 3. Allowed: 4 or more."),
        (
            {"samples_per_period": 30},
            "rk4_steps_per_period is 200. Allowed: a multiple of samples_per_period (30).",
        ),
        (
            {"rk4_steps_per_period": 0},
            "rk4_steps_per_period is 0. Allowed: a multiple of samples_per_period (25).",
        ),
        (
            {"periods": (0.01, 3.0)},
            "0.01 periods with 25 samples each give 0 samples. Allowed: at least 4. "
            "Use more periods or a higher data.samples_per_period.",
        ),
    ],
)
def test_refusals(options, text):
    with pytest.raises(ConfigError) as caught:
        simulate(**options)
    assert str(caught.value) == text
