import numpy as np
import pytest
from tests.models.learned.problem import GM, fractional_error, other_orbit, samples

from unmodeled.core.errors import ConfigError
from unmodeled.models.learned import (
    HarmonicGP,
    HarmonicKernelGP,
    NoiseLevel,
    ZonalOracle,
    _harmonic_evidence,
)
from unmodeled.models.learned._harmonic_kernels import LAWS


@pytest.fixture(scope="module")
def fitted():
    X, y, _, _ = samples(noise=0.1)
    return HarmonicGP().fit(X, y, NoiseLevel(acceleration=0.1))


def with_coefficients(learner, coefficients):
    arrays = learner._arrays() | {"coefficients": coefficients}
    other = HarmonicGP()
    other._restore(arrays)
    other.n_samples_ = learner.n_samples_
    return other


def test_covariances_are_those_of_drawn_coefficients(fitted):
    """Acceleration, potential and gravity gradient against Monte Carlo, 5 standard errors."""
    draws = 1000
    rng = np.random.default_rng(3)
    X = other_orbit()[0][:4]
    fields = []
    for _ in range(draws):
        unit = rng.normal(size=fitted.covariance_root_.shape[1])
        drawn = with_coefficients(fitted, fitted.coefficients_ + fitted.covariance_root_ @ unit)
        fields.append((drawn.predict(X), drawn.potential(X), drawn.jacobian(X).reshape(4, 9)))
    a, u, g = (np.stack(parts) for parts in zip(*fields, strict=True))
    for k in range(len(X)):
        for drawn, claimed in (
            (a[:, k], fitted.predict_covariance(X)[k]),
            (u[:, k, None], fitted.potential_variance(X)[k].reshape(1, 1)),
            (g[:, k], fitted.jacobian_covariance(X)[k]),
        ):
            variances = np.diag(claimed)
            # variance of a sample covariance of Gaussian draws: (C_ii C_jj + C_ij^2) / draws
            error = np.sqrt((np.outer(variances, variances) + claimed**2) / draws)
            found = np.cov(drawn, rowvar=False).reshape(claimed.shape)
            assert (np.abs(found - claimed) < 5 * error).all()


def test_gradient_covariance_keeps_laplace_and_symmetry(fitted):
    covariance = fitted.jacobian_covariance(other_orbit()[0][:5])
    size = np.abs(covariance).max()
    trace = covariance[:, [0, 4, 8]].sum(axis=1)
    assert np.abs(trace).max() < 1e-12 * size  # rounding of sums of 81 terms
    np.testing.assert_allclose(covariance[:, 1], covariance[:, 3], rtol=0, atol=1e-12 * size)


@pytest.mark.parametrize("law", LAWS)
def test_the_prior_is_the_closed_kernel(law, monkeypatch):
    """Under one prior, degree 20 is the process of the closed kernel to 0.3^20 of its band."""
    monkeypatch.setattr(_harmonic_evidence, "_average", lambda *a: a[-2:])
    X, y, _, _ = samples(noise=0.1)
    X, y = X[::3], y[::3]
    learner = HarmonicGP(20, 20, law=law).fit(X, y, NoiseLevel(acceleration=0.1))
    closed = HarmonicKernelGP(law)
    closed.n_samples_, closed.n_inputs_ = len(X), 3
    theta = (learner.attenuation_, learner.amplitude_, 0.1 * learner.noise_ / GM)
    closed._condition(X, y / GM, np.zeros_like(X), np.square(theta))
    other = other_orbit()[0]
    deviation = np.sqrt(np.trace(closed.predict_covariance(other), axis1=1, axis2=2))
    miss = np.linalg.norm(closed.predict(other) - learner.predict(other), axis=1)
    assert (miss < 1e-5 * deviation).all()
    wide = np.sqrt(np.trace(learner.predict_covariance(other), axis1=1, axis2=2))
    np.testing.assert_allclose(wide, deviation, rtol=1e-5)


def test_an_amplitude_that_data_do_not_show_is_not_taken_for_nothing():
    """Along the equator J2 and the mass are one thing: the band must say so."""
    angle = np.linspace(0.0, 40.0, 200)
    X = np.stack([1.5 * np.cos(angle), 1.5 * np.sin(angle), 0.02 * np.sin(3 * angle)], axis=1)
    noise = np.random.default_rng(1).normal(size=X.shape)
    pull = -GM * X / np.linalg.norm(X, axis=1)[:, None] ** 3
    learner = HarmonicGP().fit(X, pull + 0.1 * noise, NoiseLevel(acceleration=0.1))
    i = learner.coefficient_names().index("C_2_0")
    deviation = np.linalg.norm(learner.covariance_root_[i])
    # half of the least amplitude of the average, 4e-3; the best prior alone can give 1e-9
    assert deviation > 2e-3


def test_coarse_positions_do_not_run_away():
    """No worse than twice the least squares that know the family; linear steps made it 11 times."""
    X, y, _, _ = samples()
    other, truth = other_orbit()
    noise = NoiseLevel(position=1.0)
    errors = []
    for seed in range(7):
        places = X + np.random.default_rng(seed).normal(size=X.shape)
        pair = (HarmonicGP(), ZonalOracle())
        errors.append(
            [fractional_error(m.fit(places, y, noise).predict(other), truth) for m in pair]
        )
    ours, oracle = np.median(errors, axis=0)
    assert ours < 2 * oracle


@pytest.mark.parametrize("sigma", [0.05, 0.3])
def test_mass_and_centre_from_noisy_positions_err_as_they_say(sigma):
    """No prior takes part: the band is the stated noise alone, and that comes out as stated."""
    X = samples()[0]
    chi2, scale = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        places = X + sigma * rng.normal(size=X.shape)
        pull = -GM * places / np.linalg.norm(places, axis=1)[:, None] ** 3
        seen = X + sigma * rng.normal(size=X.shape)
        learner = HarmonicGP(1, 1).fit(seen, pull, NoiseLevel(position=sigma))
        error = np.linalg.solve(learner.covariance_root_, learner.coefficients_ - [1.0, 0, 0, 0])
        chi2.append(error @ error)
        scale.append(learner.noise_)
    # the mean of 40 has a deviation of 0.11
    assert np.mean(chi2) / 4 == pytest.approx(1.0, abs=0.33)
    assert np.mean(scale) == pytest.approx(1.0, abs=0.02)


def test_an_unknown_law_is_refused():
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match=r'harmonic_gp: kernel is "gauss". Allowed: reciprocal'):
        HarmonicGP(law="gauss").fit(X, y)
