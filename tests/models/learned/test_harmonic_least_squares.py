import math

import numpy as np
import pytest
import scipy.linalg
from tests.models.learned.problem import (
    GM,
    ZONALS,
    acceleration,
    finite_difference_jacobian,
    fractional_error,
    orbit,
    other_orbit,
    samples,
)

from unmodeled.core.errors import ConfigError, DataError, InputError
from unmodeled.models.learned import (
    FittedPointMass,
    HarmonicLeastSquares,
    ZonalOracle,
    load_learner,
)
from unmodeled.models.learned.learner import NoiseLevel

EPS = np.finfo(float).eps


def noisy_samples(sigma, seed):
    X = orbit(1.9, 0.3, 60.0, 0.0)
    return X, acceleration(X) + sigma * np.random.default_rng(seed).normal(size=X.shape)


def test_oracle_recovers_the_field():
    X, y, _, _ = samples()
    learner = ZonalOracle().fit(X, y)
    values = dict(zip(learner.coefficient_names(), learner.coefficients_, strict=True))
    assert list(values) == ["C_0_0", "C_2_0", "C_3_0", "C_4_0", "C_5_0"]
    # Coefficients of 1 and 1e-4 are found from the same numbers: rounding of the largest column
    # times the condition of the design, about 100 on this orbit.
    assert values["C_0_0"] == pytest.approx(1.0, abs=1e-14)
    for n, j in ZONALS.items():
        assert values[f"C_{n}_0"] == pytest.approx(-j / math.sqrt(2 * n + 1), rel=0, abs=1e-14)
    far, truth = other_orbit()
    # no noise: extrapolation is as good as the coefficients
    assert fractional_error(learner.predict(far), truth) < 1e-13


def test_full_field_recovers_a_zonal_one():
    X, y, _, _ = samples()
    learner = HarmonicLeastSquares(degree=5, ridge=0.0).fit(X, y)
    values = dict(zip(learner.coefficient_names(), learner.coefficients_, strict=True))
    design = learner._design(X)
    # backward stable least squares: relative error of eps times the condition
    bound = 10 * EPS * np.linalg.cond(design)
    for name, value in values.items():
        kind, n, m = name.split("_")
        zonal = -ZONALS[int(n)] / math.sqrt(2 * int(n) + 1) if int(n) in ZONALS else 0.0
        expected = (zonal if int(m) == 0 else 0.0) if name != "C_0_0" else 1.0
        assert value == pytest.approx(expected, rel=0, abs=bound), (kind, n, m)


def test_plain_least_squares_is_scipys():
    X, y = noisy_samples(0.1, seed=1)
    for learner in (HarmonicLeastSquares(degree=3, ridge=0.0), ZonalOracle(), FittedPointMass()):
        learner.fit(X, y)
        design = learner._design(X)
        expected = scipy.linalg.lstsq(design, y.ravel())[0]
        bound = 100 * EPS * np.linalg.cond(design)
        np.testing.assert_allclose(learner.coefficients_, expected, rtol=0, atol=bound)
        np.testing.assert_allclose(
            learner.predict(X), (design @ expected).reshape(-1, 3), rtol=0, atol=40 * bound
        )


def test_ridge_is_the_penalised_solution():
    """Against the stacked system [H; sqrt(rho) D] c = [y; 0], D = n^2 on degrees 2 and up."""
    X, y = noisy_samples(0.1, seed=1)
    learner = HarmonicLeastSquares(degree=4, ridge=0.37).fit(X, y)
    assert learner.ridge_ == 0.37
    degree = np.array([int(name.split("_")[1]) for name in learner.coefficient_names()])
    penalty = np.diag(math.sqrt(0.37) * np.where(degree < 2, 0.0, degree**2))
    stacked = np.vstack([learner._design(X), penalty])
    expected = scipy.linalg.lstsq(stacked, np.concatenate([y.ravel(), np.zeros(len(degree))]))[0]
    np.testing.assert_allclose(
        learner.coefficients_, expected, rtol=0, atol=100 * EPS * np.linalg.cond(stacked)
    )


def test_cross_validation_finds_the_minimum_of_its_score():
    """Golub, Heath and Wahba (1979) Eq. 1.4 from the dense influence matrix."""
    X, y = noisy_samples(0.1, seed=2)
    learner = HarmonicLeastSquares(degree=4).fit(X, y)
    H = learner._design(X)
    degree = np.array([int(name.split("_")[1]) for name in learner.coefficient_names()])
    weight = np.diag(np.where(degree < 2, 0.0, degree.astype(float) ** 4))

    def score(ridge):
        influence = H @ np.linalg.solve(H.T @ H + ridge * weight, H.T)
        residual = y.ravel() - influence @ y.ravel()
        n = len(residual)
        return n * (residual @ residual) / (n - np.trace(influence)) ** 2

    best = learner.ridge_
    step = 10 ** (20 / 80)  # of the grid
    assert score(best) <= score(best * step)
    assert score(best) <= score(best / step)
    assert score(best) < score(best * step**8)


def test_ridge_helps_on_noisy_data():
    """Median over ten noise draws: degree 8 from one orbit, tested on another."""
    far, truth = other_orbit()
    plain, ridged = [], []
    for seed in range(10):
        X, y = noisy_samples(0.1, seed)
        plain.append(HarmonicLeastSquares(ridge=0.0).fit(X, y).predict(far))
        ridged.append(HarmonicLeastSquares().fit(X, y).predict(far))
    errors = [np.median([fractional_error(p, truth) for p in ps]) for ps in (plain, ridged)]
    assert errors[1] < errors[0] / 2
    mass = FittedPointMass().fit(*noisy_samples(0.1, 0)).predict(far)
    assert errors[1] < fractional_error(mass, truth)


def test_fitted_mass_of_a_point_mass():
    X = orbit(1.9, 0.3, 60.0, 0.0)
    y = -1.25 * GM * X / np.linalg.norm(X, axis=1, keepdims=True) ** 3
    learner = FittedPointMass().fit(X, y)
    assert learner.coefficients_ == pytest.approx([1.25], rel=1e-14)
    assert learner.facts() == {
        "coefficients": 1,
        "ridge": 0.0,
        "fitted GM / reference GM": pytest.approx(1.25, rel=1e-14),
    }
    # noise: the estimate is unbiased with sigma / |H|, 6 of them
    noise = 0.5 * np.random.default_rng(0).normal(size=y.shape)
    error = FittedPointMass().fit(X, y + noise).coefficients_[0] - 1.25
    assert abs(error) < 6 * 0.5 / np.linalg.norm(learner._design(X))


def test_reference_values_scale_the_coefficients_only():
    X, y, _, _ = samples()
    one = HarmonicLeastSquares(degree=3, ridge=0.0).fit(X, y)
    two = HarmonicLeastSquares(degree=3, ridge=0.0, gm=2 * GM, radius=0.5).fit(X, y)
    np.testing.assert_allclose(two.predict(X), one.predict(X), rtol=0, atol=1e-11)
    degree = np.array([int(name.split("_")[1]) for name in one.coefficient_names()])
    np.testing.assert_allclose(
        two.coefficients_ * 2 * 0.5**degree, one.coefficients_, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize(
    "make", [FittedPointMass, ZonalOracle, lambda: HarmonicLeastSquares(4, order=2)]
)
def test_jacobian_and_file(make, tmp_path):
    X, y, held, _ = samples()
    learner = make().fit(X, y, NoiseLevel(acceleration=0.1))
    jacobian = learner.jacobian(held)
    slopes = finite_difference_jacobian(learner.predict, held, 1e-4)
    # truncation: step^2 / 6 times a third derivative of up to 60 |a| / r^3
    np.testing.assert_allclose(jacobian, slopes, rtol=0, atol=1e-8 * 20 * np.abs(slopes).max())
    # it is a gravity field: no curl, no divergence
    np.testing.assert_allclose(jacobian, np.swapaxes(jacobian, 1, 2), atol=1e-12 * GM)
    np.testing.assert_allclose(np.trace(jacobian, axis1=1, axis2=2), 0.0, atol=1e-12 * GM)
    path = tmp_path / "a.safetensors"
    learner.save(path)
    back = load_learner(path)
    assert type(back) is type(learner)
    assert back.get_params() == learner.get_params()
    assert np.array_equal(back.predict(held), learner.predict(held))
    assert np.array_equal(back.jacobian(held), jacobian)
    assert back.facts() == learner.facts()


def test_an_orbit_that_does_not_show_everything():
    """Four points on the equator: many coefficients are invisible."""
    X = np.array([[1.5, 0, 0], [0, 1.5, 0], [-1.5, 0, 0], [0, -1.5, 0]])
    y = acceleration(X)
    for ridge in (None, 0.0):
        learner = HarmonicLeastSquares(degree=8, ridge=ridge).fit(X, y)
        assert np.isfinite(learner.coefficients_).all()
        # what is seen is fitted
        np.testing.assert_allclose(learner.predict(X), y, rtol=0, atol=1e-8 * GM)


@pytest.mark.parametrize("ridge", [-1.0, math.nan, math.inf])
def test_bad_ridge(ridge):
    with pytest.raises(ConfigError) as caught:
        HarmonicLeastSquares(ridge=ridge).fit(*samples()[:2])
    assert str(caught.value) == f"ridge is {ridge}. Allowed: a number >= 0."


def test_bad_structure_and_use(tmp_path):
    X, y, _, _ = samples()
    with pytest.raises(ConfigError, match="spherical harmonics of degree 3 and order 4"):
        HarmonicLeastSquares(3, order=4).fit(X, y)
    with pytest.raises(ConfigError, match=r"parameter GM = -1\.0 m3 s-2\. Allowed: 0\.0 to inf"):
        HarmonicLeastSquares(3, gm=-1.0).fit(X, y)
    with pytest.raises(InputError) as caught:
        ZonalOracle().predict(X)
    assert str(caught.value) == "zonal_oracle is not fitted. Call fit(X, y) first."
    with pytest.raises(InputError) as caught:
        ZonalOracle().fit(X, y).predict_covariance(X)
    assert str(caught.value) == (
        "zonal_oracle gives no covariance. Use a Gaussian process, e.g. exact_gp."
    )
    with pytest.raises(DataError, match="fitted_point_mass was given 3 training samples"):
        FittedPointMass().fit(X[:3], y[:3])
    path = tmp_path / "a.safetensors"
    FittedPointMass().fit(X, y).save(path)
    with pytest.raises(DataError, match="holds a learner named fitted_point_mass"):
        ZonalOracle.load(path)


def test_position_noise_weights_each_sample_by_its_gravity_gradient():
    """The same as generalised least squares with the full covariance, written out densely."""
    X, y = noisy_samples(0.05, 1)
    sigma_s, sigma_a = 0.03, 0.1
    learner = ZonalOracle().fit(X, y, NoiseLevel(sigma_s, sigma_a))
    design = learner._design(X)
    covariance = np.zeros((3 * len(X), 3 * len(X)))
    for k, x in enumerate(X):
        r = np.linalg.norm(x)
        gradient = GM * (3 * np.outer(x, x) / r**5 - np.eye(3) / r**3)
        block = slice(3 * k, 3 * k + 3)
        covariance[block, block] = sigma_a**2 * np.eye(3) + sigma_s**2 * gradient @ gradient
    weight = np.linalg.inv(covariance)
    normal = design.T @ weight @ design
    expected = np.linalg.solve(normal, design.T @ weight @ y.ravel())
    # The normal equations square the condition of the design, a few hundred at most here.
    np.testing.assert_allclose(learner.coefficients_, expected, rtol=0, atol=1e-10)


def test_acceleration_noise_alone_changes_nothing():
    X, y = noisy_samples(0.1, 2)
    plain = ZonalOracle().fit(X, y).coefficients_
    assert np.array_equal(ZonalOracle().fit(X, y, NoiseLevel(0.0, 0.1)).coefficients_, plain)


def test_weights_help_under_position_noise():
    """Over 12 draws the weighted coefficients are nearer to the truth than the unweighted."""
    X = orbit(1.9, 0.4, 60.0, 0.0)
    truth = np.array([1.0, *(-ZONALS[n] / math.sqrt(2 * n + 1) for n in (2, 3, 4, 5))])
    errors = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        y = acceleration(X + 0.03 * rng.normal(size=X.shape))
        noise = NoiseLevel(position=0.03)
        both = (ZonalOracle().fit(X, y, n).coefficients_ for n in (noise, NoiseLevel()))
        errors.append([np.linalg.norm(c - truth) for c in both])
    weighted, plain = np.median(errors, axis=0)
    assert weighted < 0.8 * plain
