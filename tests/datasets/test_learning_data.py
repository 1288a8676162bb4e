import dataclasses
import math

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.seeds import Streams
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.learning_data import make_learning_data
from unmodeled.datasets.noise import Noise, observe
from unmodeled.datasets.trajectory import Trajectory

UNITS = NormalisedUnits.of_body(4.89, 290.0)


def field(x):
    return -4.89 * x / np.linalg.norm(x, axis=1, keepdims=True) ** 3


def orbit(n=250, seed=0, **changes):
    g = np.random.default_rng(seed)
    x = g.normal(size=(n, 3))
    x *= (g.uniform(300, 900, n) / np.linalg.norm(x, axis=1))[:, None]
    given = {
        "times": np.arange(n) * 60.0,
        "positions": x,
        "velocities": np.ones((n, 3)),
        "accelerations": field(x),
        "source": f"orbit {seed}",
    } | changes
    return Trajectory(**given)


def make(orbits=None, noise=None, seed=1, **options):
    orbits = orbits or [orbit(), orbit(75, 1), orbit(60, 2)]
    options = {"true_field": field} | options
    return make_learning_data(
        orbits, [1.0] * len(orbits), UNITS, noise or Noise(), Streams(seed), **options
    )


def rows(s):
    return {(int(o), float(t)) for o, t in zip(s.orbit, s.times, strict=True)}


def test_five_per_cent_of_250_are_13():
    data = make()
    assert (len(data.interpolation), len(data.train), len(data.extrapolation)) == (13, 237, 135)
    assert [s.name for s in data.sets] == ["train", "interpolation", "extrapolation"]


def test_split_is_disjoint_and_complete():
    data = make()
    train, held = rows(data.train), rows(data.interpolation)
    assert not train & held
    assert train | held == {(0, 60.0 * k) for k in range(250)}
    assert rows(data.extrapolation) == {(1, 60.0 * k) for k in range(75)} | {
        (2, 60.0 * k) for k in range(60)
    }


def test_split_is_shuffled_and_depends_on_the_seed_only():
    data, again, other = make(), make(noise=Noise(0.1, 0.1)), make(seed=2)
    assert np.array_equal(data.train.times, again.train.times)
    assert rows(data.interpolation) != rows(other.interpolation)
    assert not np.all(np.diff(data.train.times) > 0)
    # the held-out samples are spread: not one block
    assert np.ptp(data.interpolation.times) > 125 * 60.0
    # the extrapolation orbits keep their order
    assert np.all(np.diff(data.extrapolation.times[:75]) > 0)


@pytest.mark.parametrize(
    ("n", "share", "held"),
    [(100, 0.07, 7), (100, 0.05, 5), (101, 0.05, 6), (4, 0.5, 2), (4, 0.01, 1)],
)
def test_share_is_rounded_up(n, share, held):
    data = make([orbit(n), orbit(10, 1)], interpolation_share=share)
    assert len(data.interpolation) == held
    assert len(data.train) == n - held


def test_rows_stay_together_and_are_normalised():
    data, orbits = make(), [orbit(), orbit(75, 1), orbit(60, 2)]
    for s in data.sets:
        for k in range(len(s)):
            source, index = orbits[s.orbit[k]], round(s.times[k] / 60)
            np.testing.assert_allclose(s.positions[k], source.positions[index] / 290.0, rtol=1e-15)
            np.testing.assert_allclose(
                s.accelerations[k], source.accelerations[index] / UNITS.acceleration, rtol=1e-15
            )
    # in normalised units gm is 4 pi^2
    r = np.linalg.norm(data.train.positions, axis=1)
    a = np.linalg.norm(data.train.accelerations, axis=1)
    np.testing.assert_allclose(a * r**2, 4 * math.pi**2, rtol=1e-13)


def test_without_noise_the_truth_is_observed():
    for s in make().sets:
        assert np.array_equal(s.observed_positions, s.positions)
        assert np.array_equal(s.observed_accelerations, s.accelerations)


def test_noise_is_that_of_eq_4_on_every_orbit():
    noise = Noise(0.05, 0.1)
    data = make(noise=noise)
    second = data.extrapolation.orbit == 1
    x, a = orbit(75, 1).positions / 290.0, orbit(75, 1).accelerations / UNITS.acceleration

    def normal(x):
        return field(x * 290.0) / UNITS.acceleration

    expected = observe(x, a, noise, normal, Streams(1), "orbit-1")
    np.testing.assert_allclose(data.extrapolation.observed_positions[second], expected[0])
    np.testing.assert_allclose(data.extrapolation.observed_accelerations[second], expected[1])
    assert np.array_equal(data.extrapolation.positions[second], x)
    # another orbit draws other noise
    first = data.extrapolation.observed_positions[:60] - data.extrapolation.positions[:60]
    third = data.extrapolation.observed_positions[75:] - data.extrapolation.positions[75:]
    assert not np.any(first == third)


def test_facts():
    data = make(noise=Noise(0.05, 0.1), facts={"truth": "x"})
    x = orbit().positions / 290.0
    r, a = np.linalg.norm(x, axis=1), 4 * math.pi**2 / np.sum(x**2, axis=1)
    facts = data.facts
    assert facts["truth"] == "x"
    assert facts["median acceleration, normalised"] == pytest.approx(np.median(a), rel=1e-13)
    assert facts["median acceleration, m/s2"] == pytest.approx(
        np.median(a) * UNITS.acceleration, rel=1e-13
    )
    assert facts["sigma_s, m"] == pytest.approx(14.5)
    assert facts["sigma_s as share of median radius"] == pytest.approx(0.05 / np.median(r))
    assert facts["sigma_a, m/s2"] == pytest.approx(0.1 * UNITS.acceleration)
    assert facts["sigma_a as share of median acceleration"] == pytest.approx(0.1 / np.median(a))
    observed = np.concatenate(
        [data.train.observed_positions, data.interpolation.observed_positions]
    )
    inside = (np.linalg.norm(observed, axis=1) < 1).sum()
    assert facts["samples of the training orbit observed inside the Brillouin sphere"] == inside


@pytest.mark.parametrize("share", [0.0, -0.1, 0.51, math.nan])
def test_bad_share(share):
    with pytest.raises(ConfigError) as caught:
        make(interpolation_share=share)
    assert str(caught.value) == (
        f"interpolation_share is {share}. Allowed: more than 0, at most 0.5."
    )


def test_bad_orbits():
    with pytest.raises(DataError) as caught:
        make([orbit()])
    assert str(caught.value) == "no orbit to extrapolate to. Give at least one other orbit."
    bare = dataclasses.replace(orbit(), accelerations=None)
    with pytest.raises(DataError) as caught:
        make([bare, orbit()])
    assert str(caught.value) == "orbit 0: no accelerations. Let the smoother make them."
    with pytest.raises(DataError) as caught:
        make([orbit(), orbit(seed=1, frame="body_fixed")])
    assert str(caught.value) == (
        "orbit 1 is given in body_fixed axes. Allowed: inertial axes. "
        "Rotate it to inertial axes first."
    )


def test_state_noise_on_measured_data():
    with pytest.raises(ConfigError, match=r"noise\.state is 0\.1 for a measured trajectory"):
        make(noise=Noise(state=0.1), true_field=None)
    data = make(noise=Noise(acceleration=0.1), true_field=None)
    assert np.array_equal(data.train.observed_positions, data.train.positions)
