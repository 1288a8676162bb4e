"""Tests of whiteness on noise whose colour is known."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from unmodeled.pipeline.comparison.whiteness import autocorrelation, is_coloured, whiteness


def with_residuals(lin, residuals):
    changed = copy.copy(lin)
    changed.residuals = lin.project(residuals)
    return changed


def coloured(n, memory, seed):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=n)
    for k in range(3, n):  # three components of one epoch are independent
        x[k] = memory * x[k - 3] + np.sqrt(1 - memory**2) * x[k]
    return x


def test_autocorrelation_is_the_textbook_sum_within_passes():
    rng = np.random.default_rng(0)
    times = np.concatenate([np.arange(40.0), 100.0 + np.arange(30.0)])
    x = rng.normal(size=70)
    found = autocorrelation(times, x, 5.0)
    for k in range(1, 6):
        pairs = [x[i] * x[i + k] for i in range(70 - k) if times[i + k] - times[i] == k]
        assert found.pairs[k - 1] == len(pairs)
        assert found.values[k - 1] == pytest.approx(np.mean(pairs) / np.mean(x**2))


def test_lags_span_a_revolution(noise_lin, noise):
    tests = whiteness(noise_lin)
    lags = tests.loc[tests["test"] == "ljung-box", "lags"]
    assert (lags * 600.0 >= noise.period).all()


def test_noise_is_white_and_correlated_noise_is_not(noise_lin):
    assert not is_coloured(whiteness(noise_lin))
    n = len(noise_lin.residuals)
    tests = whiteness(with_residuals(noise_lin, coloured(n, 0.5, 1)))
    by_test = tests.groupby("test")["verdict"].unique()
    assert list(by_test["ljung-box"]) == ["coloured"]
    assert list(by_test["runs"]) == ["coloured"]


def test_size_and_shape_are_judged(noise_lin):
    rng = np.random.default_rng(2)
    n = len(noise_lin.residuals)
    tests = whiteness(with_residuals(noise_lin, 2.0 * rng.normal(size=n)))
    assert set(tests.loc[tests["test"] == "chi-square", "verdict"]) == {"larger than stated"}
    tests = whiteness(with_residuals(noise_lin, rng.standard_t(3, size=n)))
    assert set(tests.loc[tests["test"] == "normality", "verdict"]) == {"not normal"}


def test_false_alarms_are_as_rare_as_stated(noise_lin):
    rng = np.random.default_rng(5)
    n = len(noise_lin.residuals)
    tables = [whiteness(with_residuals(noise_lin, rng.normal(size=n))) for _ in range(20)]
    for test in ("ljung-box", "runs", "chi-square", "normality"):
        p = np.concatenate([t.loc[t["test"] == test, "p"] for t in tables])
        # Of 60 tests at 5 %: 3 +- 1.7, at 50 %: 30 +- 3.9; four sigmas.
        assert np.sum(p < 0.05) <= 9, test
        assert np.sum(p > 0.5) >= 15, test
