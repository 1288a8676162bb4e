import json
import math

import numpy as np
import pytest

from unmodeled.core.errors import DataError
from unmodeled.pipeline.metrics import calibrate, fractional_error, summarize


def test_fractional_error_by_hand():
    true = np.array([[3.0, 0, 4.0], [0, -2.0, 0], [1.0, 2.0, 2.0]])
    predicted = np.array([[3.0, 0, 1.0], [0, 2.0, 0], [1.0, 2.0, 2.0]])
    assert fractional_error(true, predicted).tolist() == [3 / 5, 2.0, 0.0]


def test_the_trivial_predictor_gets_one():
    true = np.random.default_rng(0).normal(size=(20, 3))
    assert fractional_error(true, 0 * true).tolist() == [1.0] * 20


def test_failures_are_infinite_and_counted():
    true = np.ones((6, 3))
    predicted = true.copy()
    predicted[0, 0], predicted[1, 1], predicted[2, 2] = np.nan, np.inf, -np.inf
    predicted[3, 0] = 1e300  # its square overflows
    error = fractional_error(true, predicted)
    assert error.tolist() == [math.inf] * 4 + [0.0] * 2
    summary = summarize(error)
    assert (summary.count, summary.failures) == (6, 4)
    assert summary.median == summary.worst == summary.mean == math.inf
    assert summary.quartile_1 == 0.0


def test_failures_below_a_quantile_leave_it_finite():
    summary = summarize(np.array([0.1] * 95 + [math.inf] * 5))
    assert summary.median == summary.quartile_3 == 0.1
    assert summary.worst == math.inf
    assert summary.failures == 5


def test_summary_by_hand():
    # 0.0, 0.1 ... 1.0: quantiles fall on samples or, for 95 %, half way between the last two
    summary = summarize(np.random.default_rng(0).permutation(np.arange(11) / 10))
    assert summary.as_dict() == pytest.approx(
        {
            "count": 11,
            "failures": 0,
            "median": 0.5,
            "quartile_1": 0.25,
            "quartile_3": 0.75,
            "percentile_95": 0.95,
            "worst": 1.0,
            "mean": 0.5,
        },
        rel=1e-14,
    )
    one = summarize(np.array([0.3]))
    assert one.median == one.percentile_95 == one.worst == one.mean == 0.3
    assert json.loads(json.dumps(summary.as_dict())) == summary.as_dict()


def test_bad_accelerations():
    ones = np.ones((2, 3))
    with pytest.raises(DataError) as caught:
        fractional_error(ones, ones[:1])
    assert str(caught.value) == "prediction has shape (1, 3). Allowed: (2, 3)."
    with pytest.raises(DataError) as caught:
        fractional_error(np.array([[1.0, 0, 0], [0, 0, 0]]), ones)
    assert str(caught.value) == "true acceleration 1 is zero. Allowed: accelerations > 0."
    with pytest.raises(DataError, match="true acceleration has 3 value"):
        fractional_error(np.array([[1.0, 0, 0], [np.nan] * 3]), ones)


def test_calibration_by_hand():
    # One sample, covariance diag(1, 4, 9), errors 1, 4 and 0: Mahalanobis 1 + 4 + 0.
    c = calibrate(np.array([[1.0, 4.0, 0.0]]), np.zeros((1, 3)), np.diag([1.0, 4.0, 9.0])[None])
    assert c.negative_log_likelihood == pytest.approx(
        0.5 * (5 + math.log(36) + 3 * math.log(2 * math.pi)), rel=1e-15
    )
    assert c.coverage_68 == pytest.approx(2 / 3)
    assert c.coverage_95 == pytest.approx(2 / 3)
    assert c.median_sigma == 2.0
    assert set(c.as_dict()) == {
        "negative_log_likelihood",
        "coverage_68",
        "coverage_95",
        "median_sigma",
    }


def draws(n=4000):
    g = np.random.default_rng(5)
    root = g.normal(size=(n, 3, 3)) * 0.3 + np.eye(3)
    covariance = root @ np.swapaxes(root, 1, 2)
    mean = g.normal(size=(n, 3))
    true = mean + np.einsum("nij,nj->ni", root, g.normal(size=(n, 3)))
    return true, mean, covariance


def test_gaussian_draws_are_calibrated():
    """Coverages and likelihood within 6 standard errors of what they must be."""
    true, mean, covariance = draws()
    n = len(true)
    c = calibrate(true, mean, covariance)
    # the three components of one sample are correlated: count one of them
    for got, want in ((c.coverage_68, 0.682689), (c.coverage_95, 0.95)):
        assert abs(got - want) < 6 * math.sqrt(want * (1 - want) / n)
    logdet = np.linalg.slogdet(covariance)[1].mean()
    # Mahalanobis^2 is chi^2 with 3 degrees of freedom: mean 3, variance 6
    expected = 0.5 * (3 + logdet + 3 * math.log(2 * math.pi))
    assert abs(c.negative_log_likelihood - expected) < 6 * 0.5 * math.sqrt(6 / n)


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_a_wrong_covariance_shows(factor):
    true, mean, covariance = draws()
    right, wrong = calibrate(true, mean, covariance), calibrate(true, mean, factor * covariance)
    assert wrong.negative_log_likelihood > right.negative_log_likelihood + 0.3
    assert (wrong.coverage_68 > 0.9) == (factor > 1)
    assert (wrong.coverage_68 < 0.5) == (factor < 1)


def test_covariances_that_are_none():
    true, mean = np.zeros((2, 3)), np.zeros((2, 3))
    good = np.stack([np.eye(3)] * 2)
    bad = good.copy()
    bad[1, 2, 2] = -1e-3
    with pytest.raises(DataError) as caught:
        calibrate(true, mean, bad)
    assert str(caught.value) == "predicted variance -0.001. Allowed: variances > 0."
    bad = good.copy()
    bad[1, 0, 1] = bad[1, 1, 0] = 2.0  # variances positive, determinant 1 - 4
    with pytest.raises(DataError) as caught:
        calibrate(true, mean, bad)
    assert str(caught.value) == (
        "predicted covariance 1 is not positive definite. Allowed: positive definite matrices."
    )
    bad[1] = 1.0  # singular
    with pytest.raises(DataError, match="predicted covariance 1 is not positive definite"):
        calibrate(true, mean, bad)
    bad[1] = np.nan
    with pytest.raises(DataError, match="predicted variance nan"):
        calibrate(true, mean, bad)
