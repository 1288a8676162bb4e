"""Regions and sums of the published protocol, against values worked by hand."""

import numpy as np
import pytest

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.seeds import Streams
from unmodeled.pipeline.field_metrics import (
    cumulative_position_error,
    plane_points,
    shell_points,
)
from unmodeled.pipeline.metrics import fractional_error


def test_three_planes_of_two_points():
    signs = [(-3, -3), (-3, 3), (3, -3), (3, 3)]
    assert plane_points(3.0, 2).tolist() == [
        *([a, b, 0] for a, b in signs),
        *([a, 0, b] for a, b in signs),
        *([0, a, b] for a, b in signs),
    ]


def test_shells_are_isotropic_with_uniform_radii():
    points = shell_points(1.0, 10.0, 20000, Streams(1), "exterior")
    radius = np.linalg.norm(points, axis=1)
    assert radius.min() >= 1.0 - 1e-12
    assert radius.max() <= 10.0 + 1e-12
    # means of 20,000 draws, five standard errors: 9 / sqrt(12 n) and 1 / sqrt(3 n)
    assert radius.mean() == pytest.approx(5.5, abs=5 * 9 / np.sqrt(12 * 20000))
    assert np.abs((points / radius[:, None]).mean(axis=0)).max() < 5 / np.sqrt(3 * 20000)
    again = shell_points(1.0, 10.0, 20000, Streams(1), "exterior")
    assert np.array_equal(points, again)


def test_distances_are_summed():
    true = np.zeros((3, 3))
    predicted = np.array([[0.0, 0, 0], [3, 4, 0], [0, 0, -2]])
    assert cumulative_position_error(true, predicted) == 7.0
    assert cumulative_position_error(true, predicted[:2]) == np.inf
    assert cumulative_position_error(true, predicted * np.nan) == np.inf


def test_errors_are_relative_to_the_truth_and_see_the_direction():
    """Peers' code divides by the prediction, or compares lengths only."""
    true, predicted = np.array([[0.0, 0.0, 2.0]]), np.array([[0.0, 0.0, 1.0]])
    assert fractional_error(true, predicted) == [0.5]  # by the prediction it would be 1
    assert fractional_error(true, -true) == [2.0]  # by lengths it would be 0
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    slanted = np.array([[1.0, 2, 3]])
    assert fractional_error(true @ turn.T, slanted @ turn.T) == pytest.approx(
        fractional_error(true, slanted), rel=1e-15
    )


def test_refusals():
    with pytest.raises(ConfigError, match="2 points or more"):
        plane_points(3.0, 1)
    with pytest.raises(ConfigError, match="inner < outer"):
        shell_points(2.0, 1.0, 5, Streams(1), "x")
    with pytest.raises(DataError, match="predicted positions"):
        cumulative_position_error(np.zeros((2, 3)), np.zeros((3, 3)))
