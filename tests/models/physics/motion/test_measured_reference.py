"""The target's orbit from positions: as good as its difference, causal, carried through gaps."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.physics.motion import MeasuredReference, ReferenceOrbit, XuWang
from unmodeled.models.physics.motion.reference_orbit import Oblate

EARTH = Oblate(3.986004418e14, 1.0826e-3, 6378137.0)
TIMES = np.arange(0.0, 9001.0, 30.0)
#: Radius, rate, angular momentum, inclination, argument of latitude at the perigee of [Pesce2020].
START = np.array([7003.1e3, 1.73e-3, 56411.2e6, np.radians(98.2), np.radians(85.9)])


@pytest.fixture(scope="module")
def orbit():
    return ReferenceOrbit.integrated(START, TIMES, EARTH)


def positions(orbit):
    """Inertial positions with the node where it is, carried along by J2."""
    c = orbit.values
    # the node turns at -2 k cos i sin^2 u / (h r^3); enough here: an orbit whose node is fixed
    r, i, u = c[:, 0], c[:, 3], c[:, 4]
    node = np.concatenate(
        [
            [0.0],
            np.cumsum(
                0.5
                * 30.0
                * (lambda f: f[1:] + f[:-1])(
                    -2.0 * EARTH.k * np.cos(i) * np.sin(u) ** 2 / (c[:, 2] * r**3)
                )
            ),
        ]
    )
    x = np.cos(node) * np.cos(u) - np.sin(node) * np.sin(u) * np.cos(i)
    y = np.sin(node) * np.cos(u) + np.cos(node) * np.sin(u) * np.cos(i)
    return r[:, None] * np.stack([x, y, np.sin(u) * np.sin(i)], axis=1)


def test_second_order_is_a_hundred_times_better_than_the_printed_difference(orbit):
    """Truncation: r'' dt / 2 against r''' dt^2 / 3, along the radius."""
    r = positions(orbit)
    error = {
        order: np.abs(
            MeasuredReference.from_positions(TIMES, r, EARTH, order=order).error(orbit)[3:, 1]
        ).max()
        for order in (1, 2)
    }
    pull = EARTH.gm / orbit.values[:, 0].min() ** 2
    assert error[1] == pytest.approx(0.5 * 30.0 * pull, rel=0.1)
    assert error[2] < 0.03 * error[1]


def test_variables_but_the_rate_are_good_with_noise(orbit):
    rng = np.random.default_rng(1)
    noisy = positions(orbit) + 0.1 * rng.normal(size=(len(TIMES), 3))
    found = MeasuredReference.from_positions(TIMES, noisy, EARTH).error(orbit)[3:]
    # six sigma of 0.1 m in radius and angle; the momentum by the truncation of its velocity
    assert np.abs(found[:, 0]).max() < 0.6
    assert np.abs(found[:, 4]).max() < 0.6 / 7e6 + 1e-6
    assert np.abs(found[:, 2]).max() < 1e-3 * 5.6e10


def test_a_gap_is_integrated_and_nothing_is_taken_from_the_future(orbit):
    r = positions(orbit)
    seen = np.ones(len(TIMES), dtype=bool)
    seen[100:200] = False
    other = r.copy()
    other[100:200] = np.nan
    found = MeasuredReference.from_positions(TIMES, other, EARTH, seen)
    assert np.isfinite(found.values).all()
    # at the end of 50 minutes: 2 m/s of radial rate at its start, grown
    assert np.abs(found.error(orbit)[199, 0]) < 2.0 * 3000.0 * 2
    half = MeasuredReference.from_positions(TIMES[:150], other[:150], EARTH, seen[:150])
    np.testing.assert_array_equal(half.values, found.values[:150])
    # between epochs: the equations, from the epoch before
    np.testing.assert_allclose(found.at(90.0 + 29.999), found.at(120.0), rtol=1e-3, atol=3.0)
    np.testing.assert_array_equal(found.at(90.0), found.values[3])


def test_xu_wang_about_it_is_that_about_the_known_orbit(orbit):
    x = np.array([[0.0, -12.2, 0.0, -1.7e-3, 0.0, 0.0]])
    about = MeasuredReference.from_positions(TIMES, positions(orbit), EARTH)
    known, _ = XuWang(orbit).rates(x, 3000.0)
    found, _ = XuWang(about).rates(x, 3000.0)
    # 2 m/s of radial rate: 2 h dr' / r^3 times 12 m
    np.testing.assert_allclose(found, known, atol=1.2e-8)


def test_bad_input(orbit):
    r = positions(orbit)
    with pytest.raises(ConfigError, match=r"order 3 of the difference\. Allowed: 1 or 2"):
        MeasuredReference.from_positions(TIMES, r, EARTH, order=3)
    with pytest.raises(DataError, match="2 of the first 3 positions measured"):
        MeasuredReference.from_positions(TIMES, r, EARTH, np.arange(len(TIMES)) != 1)
    with pytest.raises(DataError, match="unequal distances"):
        MeasuredReference.from_positions(TIMES**1.1, r, EARTH)
    with pytest.raises(DataError, match="time -1 s"):
        MeasuredReference.from_positions(TIMES, r, EARTH).at(-1.0)


def test_many_times_at_once_are_each_time_alone(orbit):
    found = MeasuredReference.from_positions(TIMES, positions(orbit), EARTH)
    asked = np.array([0.0, 30.0, 47.5, 4000.0, 9000.0])
    alone = np.stack([found.at(float(t)) for t in asked])
    np.testing.assert_allclose(found.at(asked), alone, rtol=1e-14)
