"""Harmonic fields from noisy positions: no bias, known mass and centre, an honest band."""

import numpy as np
import pytest
from tests.models.learned.problem import GM, acceleration, fractional_error, other_orbit, samples

from unmodeled.core.errors import ConfigError
from unmodeled.models.learned import HarmonicGP, NoiseLevel, PointMassOnly, Residual
from unmodeled.models.learned._harmonic_field import UncertainField
from unmodeled.models.learned._harmonic_places import NoisyPlaces, mass_of, noise_root

KNOWN = {"gm_sigma": 1e-3 * GM, "centre_sigma": 1e-3}


def drawn(seed, sigma, count=2000):
    """Independent draws of position and of the place of the acceleration; circle of radius 2."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, count)
    u = 2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    e = sigma * rng.normal(size=(2, count, 3))
    return u + e[0], -GM * (u + e[1]) / np.linalg.norm(u + e[1], axis=1)[:, None] ** 3


@pytest.mark.parametrize("sigma", [0.2, 0.6])
def test_mass_of_noisy_positions_has_no_bias(sigma):
    """Thirty sets of 2000: the mean is GM within 5 standard errors, the plain fit is not."""
    masses, plain = [], []
    for seed in range(30):
        X, y = drawn(seed, sigma)
        masses.append(mass_of(X, y) / GM)
        w = -y / np.linalg.norm(y, axis=1)[:, None] ** 1.5
        plain.append(((w * X).sum() / (w**2).sum()) ** 2 / GM)
    for found, unbiased in ((masses, True), (plain, False)):
        error = np.std(found) / np.sqrt(len(found))
        assert bool(abs(np.mean(found) - 1) < 5 * error) is unbiased


@pytest.mark.parametrize("sigma", [0.2, 0.6])
def test_equations_at_the_midpoint_have_no_bias(sigma):
    """The true field has no misfit to any coefficient, within 5 standard errors.

    Taken at the observed positions instead, or where the accelerations come from, it has.
    """
    truth = UncertainField(2, GM, 1.0, np.eye(9)[0], np.zeros((9, 9)))
    scores = {"midpoint": [], "observed": [], "source": []}
    for seed in range(30):
        X, y = drawn(seed, sigma)
        own = NoisyPlaces(X, y, NoiseLevel(position=sigma), GM, 1e-9)
        own.update(truth)
        source = own._refined(truth)
        np.testing.assert_allclose(truth.acceleration(source), y, rtol=1e-12)
        np.testing.assert_allclose(own.places, 0.5 * (X + source), rtol=0, atol=1e-9)
        for name, at in (("midpoint", own.places), ("observed", X), ("source", source)):
            # g by sqrt(GM): a place moves along itself; far from the origin, where it is smooth
            keep = np.linalg.norm(own.places, axis=1) > 0.3
            scores[name].append(((X - source) * at)[keep].sum(axis=1).mean())
    for name, found in scores.items():
        error = np.std(found) / np.sqrt(len(found))
        assert bool(abs(np.mean(found)) < 5 * error) is (name == "midpoint"), name


def test_accelerations_that_tell_no_place_leave_the_linear_step():
    X, y, _, _ = samples()
    noise = NoiseLevel(position=1e-4, acceleration=0.1)
    truth = UncertainField(1, GM, 1.0, np.array([1.0, 0, 0, 0]), np.zeros((4, 4)))
    own = NoisyPlaces(X, y, noise, GM, 1.0)
    data = own.update(truth)
    assert np.abs(own.places - X).max() < 1e-4
    assert np.abs(data - y).max() < 1e-3 * np.abs(y).max()
    assert noise_root(truth, X, noise).shape == (len(X), 3, 3)


@pytest.mark.parametrize("silent", [[3], slice(None)])
def test_samples_without_acceleration_are_no_accident(silent):
    X, y, _, _ = samples()
    y = y.copy()
    y[silent] = 0.0
    learner = HarmonicGP().fit(X, y, NoiseLevel(position=0.1))
    assert np.isfinite(learner.predict(X)).all()


def test_coarse_positions_do_not_hurt_where_mass_and_centre_are_known():
    """Positions as uncertain as the body is large: as good as a mass that is known as well."""
    X, y, _, _ = samples()
    other, truth = other_orbit()
    free, known = [], []
    for seed in range(3):
        e = np.random.default_rng(seed).normal(size=(2, *X.shape))
        places, pull = X + e[0], acceleration(X + e[1])
        keep = np.linalg.norm(X + e[1], axis=1) > 1.0
        noise = NoiseLevel(position=1.0)
        for errors, learner in ((free, HarmonicGP()), (known, HarmonicGP(**KNOWN))):
            learner.fit(places[keep], pull[keep], noise)
            errors.append(fractional_error(learner.predict(other), truth))
            assert learner.facts()["noise / stated noise (or noise)"] == pytest.approx(1, abs=0.15)
    bare = fractional_error(PointMassOnly().fit(X, y).predict(other), truth)
    assert np.median(known) < 3 * bare
    assert np.median(free) > 3 * bare  # or the prior would show nothing


def test_known_mass_and_centre_are_what_the_prior_says():
    """Data drowned in noise tell next to nothing: mean and deviation are those given."""
    X, y, _, _ = samples()
    noise = NoiseLevel(acceleration=100.0)
    y = y + 100.0 * np.random.default_rng(1).normal(size=y.shape)
    learner = HarmonicGP(gm_sigma=0.01 * GM, centre_sigma=0.02).fit(X, y, noise)
    deviation = np.linalg.norm(learner.covariance_root_, axis=1)
    # they know the mass to 100 / (15 sqrt(238)) = 0.4 of it, 40 times the prior
    assert learner.coefficients_[0] == pytest.approx(1.0, abs=1e-3)
    # the noise is known to 3 % from 711 data, and the prior goes with it
    assert deviation[0] == pytest.approx(0.01, rel=0.1)
    np.testing.assert_allclose(deviation[1:4], 0.02 / np.sqrt(3), rtol=0.1)


def test_the_prior_of_a_residual_is_about_no_mass():
    X, y, _, _ = samples(noise=0.1)
    noise = NoiseLevel(acceleration=0.1)
    whole = HarmonicGP(**KNOWN).fit(X, y, noise)
    rest = Residual(HarmonicGP(**KNOWN)).fit(X, y, noise)
    other = other_orbit()[0]
    miss = np.abs(whole.predict(other) - rest.predict(other)).max()
    assert miss < 1e-2 * np.sqrt(np.trace(whole.predict_covariance(other), 0, 1, 2)).min()


def test_the_prior_holds_where_noise_is_not_stated():
    X, y, _, _ = samples(noise=0.1)
    told = HarmonicGP(**KNOWN).fit(X, y, NoiseLevel(acceleration=0.1))
    found = HarmonicGP(**KNOWN).fit(X, y)
    np.testing.assert_allclose(found.coefficients_[0], told.coefficients_[0], atol=1e-3)
    spread = [np.linalg.norm(m.covariance_root_[0]) for m in (told, found)]
    assert spread[1] == pytest.approx(spread[0], rel=0.1)


def test_the_band_of_clean_data_is_that_of_rounding():
    X, y, _, _ = samples()
    other, truth = other_orbit()
    learner = HarmonicGP().fit(X, y)
    covariance = learner.predict_covariance(other)
    deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    size = np.linalg.norm(truth, axis=1)[:, None]
    eps = np.finfo(float).eps
    assert (deviation >= eps * size * (1 - 1e-9)).all()
    # and is of no more than rounding, where the orbit passes under the samples' height too
    assert np.median(deviation / size) < 100 * eps


@pytest.mark.parametrize("name", ["gm_sigma", "centre_sigma"])
def test_bad_priors_are_refused(name):
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match=rf"{name} is 0. Allowed: a number > 0, or none"):
        HarmonicGP(**{name: 0}).fit(X, y)


def test_degree_auto_goes_as_far_as_the_data():
    X, y, _, _ = samples()
    other, truth = other_orbit()
    learner = HarmonicGP(degree="auto").fit(X, y)
    assert 5 <= learner.degree_ <= 8  # the truth has 5
    assert fractional_error(learner.predict(other), truth) < 1e-12
    # two masses: no last degree
    d = np.array([0.0, 0.0, 0.6])

    def pull(x):
        apart = [x - d, x + d]
        return sum(-0.5 * GM * a / np.linalg.norm(a, axis=1)[:, None] ** 3 for a in apart)

    misses = {
        degree: fractional_error(HarmonicGP(degree).fit(X, pull(X)).predict(other), pull(other))
        for degree in (8, "auto")
    }
    assert misses["auto"] < 0.2 * misses[8]
    with pytest.raises(ConfigError, match=r'degree is "high". Allowed: a number, or "auto"'):
        HarmonicGP("high").fit(X, y)
