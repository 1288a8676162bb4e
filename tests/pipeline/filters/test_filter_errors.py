"""Bad input and divergence of filters: what was found, what is allowed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError, InputError, NumericalError
from unmodeled.pipeline.filters.adaptive import ForgettingNoise, MatchedNoise
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.linear import LinearMeasurement, LinearModel
from unmodeled.pipeline.filters.process_noise import ConstantNoise, WhiteAcceleration
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.filters.smoother import smooth
from unmodeled.pipeline.filters.state import FilterState


def _ok():
    model = LinearModel(np.zeros((2, 2)))
    measurement = LinearMeasurement.of_sigma([0], [1.0], 2)
    return ExtendedKalmanFilter(model, measurement, ConstantNoise(np.eye(2)))


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: FilterState.of([0.0, 0], np.diag([1.0, -1.0]), 0.0), DataError, "negative eig"),
        (lambda: FilterState.of([0.0, 0], [[1, 0.5], [0, 1]], 0.0), DataError, "not symmetric"),
        (
            lambda: FilterState.of(np.zeros((3, 2)), np.ones((2, 1, 1)) * np.eye(2), 0.0),
            DataError,
            "covariance has 2 runs and mean has 3",
        ),
        (lambda: FilterState.of([0.0, np.nan], np.eye(2), 0.0), DataError, "not finite"),
        (lambda: _ok().start(FilterState.of([0.0], [[1.0]], 0.0)), InputError, "has 1 states"),
        (
            lambda: run_filter(
                _ok(), FilterState.of([0.0, 0], np.eye(2), 5.0), np.array([1.0]), np.ones((1, 1, 1))
            ),
            DataError,
            r"first measurement is at 1\.0 s, the start at 5\.0 s",
        ),
        (
            lambda: run_filter(
                _ok(), FilterState.of([0.0, 0], np.eye(2), 0.0), np.array([1.0]), np.ones((1, 1))
            ),
            DataError,
            r"z has shape \(1, 1\)",
        ),
        (
            lambda: run_filter(
                _ok(), FilterState.of([0.0, 0], np.eye(2), 0.0), np.ones(1), np.ones((1, 1, 2))
            ),
            DataError,
            "2 components",
        ),
        (
            lambda: run_filter(
                _ok(),
                FilterState.of([0.0, 0], np.eye(2), 0.0),
                np.ones(1),
                np.full((1, 1, 1), np.inf),
            ),
            DataError,
            "infinite",
        ),
        (
            lambda: run_filter(
                _ok(),
                FilterState.of([0.0, 0], np.eye(2), 0.0),
                np.ones(1),
                np.ones((1, 1, 1)),
                truth=np.ones((1, 3)),
            ),
            DataError,
            "truth has shape",
        ),
        (lambda: LinearMeasurement(np.eye(2), -np.eye(2)), ConfigError, "positive definite"),
        (lambda: ForgettingNoise(np.eye(2), 1.5), ConfigError, r"alpha is 1\.5"),
        (lambda: MatchedNoise(WhiteAcceleration(1.0), window=1), ConfigError, "at least 20"),
        (
            lambda: smooth(
                run_filter(
                    _ok(), FilterState.of([0.0, 0], np.eye(2), 0.0), np.ones(1), np.ones((1, 1, 1))
                )
            ),
            InputError,
            'keep="all"',
        ),
    ],
)
def test_errors_say_what_was_found_and_what_is_allowed(make, error, text):
    with pytest.raises(error, match=text):
        make()


def test_divergence_is_an_error_that_names_epoch_and_run():
    @dataclass(frozen=True)
    class Growing:
        size: int = 2

        def propagate(self, x, t, dt):
            return x * np.array([[1.0], [1e200]]), np.eye(2)[None]

    filter_ = ExtendedKalmanFilter(
        Growing(), LinearMeasurement.of_sigma([0], [1.0], 2), ConstantNoise(np.eye(2))
    )
    start = FilterState.of(np.ones((2, 2)), np.eye(2), 0.0)
    gaps = np.full((3, 2, 1), np.nan)
    with (
        np.errstate(over="ignore"),
        pytest.raises(NumericalError, match="run 1 is not finite at epoch 1"),
    ):
        run_filter(filter_, start, np.arange(1.0, 4.0), gaps)
