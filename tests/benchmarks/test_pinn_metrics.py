"""Each metric on cases worked out by hand, among them the errors of published comparisons."""

import numpy as np
import pytest
from pinn.metrics import evaluation_times, fly_spinning, percent_error, trajectory_error

GENERATOR = np.random.default_rng(3)
FIELD = GENERATOR.standard_normal((50, 3)) * GENERATOR.uniform(0.1, 10.0, (50, 1))


def test_a_known_relative_error_comes_back() -> None:
    found = percent_error(true=FIELD, predicted=1.01 * FIELD)
    np.testing.assert_allclose([found.mean, found.median, found.worst], 1.0, rtol=1e-10)


def test_mean_and_median_differ_where_one_point_is_bad() -> None:
    predicted = 1.01 * FIELD
    predicted[0] = 3.0 * FIELD[0]
    found = percent_error(true=FIELD, predicted=predicted)
    assert found.median == pytest.approx(1.0)
    assert found.mean == pytest.approx((49 * 1.0 + 200.0) / 50)
    assert found.worst == pytest.approx(200.0)


def test_a_turned_field_of_the_right_length_is_wrong() -> None:
    """A difference of lengths, as "relative norm distance" elsewhere, would say 0."""
    along = np.cross(FIELD, [0.0, 0.0, 1.0])
    turned = along / np.linalg.norm(along, axis=1)[:, None]
    turned *= np.linalg.norm(FIELD, axis=1)[:, None]
    assert percent_error(true=FIELD, predicted=turned).median == pytest.approx(100 * np.sqrt(2))


def test_opposite_sign_is_200_percent() -> None:
    assert percent_error(true=FIELD, predicted=-FIELD).mean == pytest.approx(200.0)


def test_truth_and_prediction_cannot_be_swapped() -> None:
    """One peer's extrapolation error is relative to the prediction."""
    assert percent_error(true=2 * FIELD, predicted=FIELD).mean == pytest.approx(50.0)
    assert percent_error(true=FIELD, predicted=2 * FIELD).mean == pytest.approx(100.0)
    with pytest.raises(TypeError):
        percent_error(FIELD, FIELD)  # type: ignore[misc]


def test_each_point_counts_by_its_own_acceleration() -> None:
    """A norm of the whole matrix would let strong points hide weak ones."""
    true = np.array([[1000.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    predicted = np.array([[1000.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    assert percent_error(true=true, predicted=predicted).mean == pytest.approx(50.0)


def test_what_is_not_finite_is_infinite_not_dropped() -> None:
    predicted = FIELD.copy()
    predicted[3] = np.nan
    assert percent_error(true=FIELD, predicted=predicted).mean == np.inf


def test_cumulative_sum_grows_with_the_nodes_and_the_rms_does_not() -> None:
    for count in (10, 1000):
        true = GENERATOR.standard_normal((count, 3))
        found = trajectory_error(true=true, predicted=true + np.array([3.0, 0.0, 4.0]))
        np.testing.assert_allclose(
            [found.cumulative, found.rms, found.last], [5.0 * count, 5.0, 5.0], rtol=1e-12
        )


def test_distances_are_summed_not_signed_differences() -> None:
    true = np.zeros((2, 3))
    predicted = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert trajectory_error(true=true, predicted=predicted).cumulative == 2.0


def test_a_flight_that_ended_early_is_infinite() -> None:
    found = trajectory_error(true=np.zeros((5, 3)), predicted=np.zeros((4, 3)))
    assert found.cumulative == found.rms == found.last == np.inf


def kepler(x: np.ndarray) -> np.ndarray:
    return -x / np.linalg.norm(x, axis=1)[:, None] ** 3


def test_a_round_orbit_closes_whatever_the_spin() -> None:
    times = np.linspace(0.0, 2 * np.pi, 9)
    expected = np.stack([np.cos(times), np.sin(times), 0 * times], axis=1)
    for spin in (0.0, 1.7):
        flown = fly_spinning(kepler, np.array([1.0, 0, 0]), np.array([0.0, 1, 0]), times, spin)
        # RK45 at 1e-10, interpolated to fourth order between its steps
        np.testing.assert_allclose(flown, expected, atol=1e-7)


def test_the_field_turns_with_the_body() -> None:
    """A push along body x turns once in inertial space and cancels; without spin it does not."""

    def push(x: np.ndarray) -> np.ndarray:
        return np.tile([1.0, 0.0, 0.0], (len(x), 1))

    times, start = np.array([0.0, 2 * np.pi]), np.zeros(3)
    speed = np.array([0.0, -1.0, 0.0])
    # x'' = cos t, y'' = sin t with y'(0) = -1 comes back to the start
    turned = fly_spinning(push, start + 1.0, speed, times, 1.0)
    np.testing.assert_allclose(turned[-1], [1.0, 1.0, 1.0], atol=1e-7)
    straight = fly_spinning(push, start + 1.0, speed, times, 0.0)
    np.testing.assert_allclose(straight[-1, 0], 1.0 + 0.5 * (2 * np.pi) ** 2, rtol=1e-9)


def test_a_field_that_is_not_finite_ends_the_flight() -> None:
    flown = fly_spinning(
        lambda x: np.full_like(x, np.nan), np.ones(3), np.ones(3), np.linspace(0, 1, 5), 0.0
    )
    assert len(flown) == 1


def test_one_point_alone_is_timed_alone() -> None:
    """A peer's column of single points is the time of the batch."""
    calls: list[int] = []

    def predict(x: np.ndarray) -> np.ndarray:
        calls.append(len(x))
        return x

    single, whole = evaluation_times(predict, np.ones((1000, 3)))
    assert calls.count(1) == 20
    assert calls.count(1000) == 4
    assert single > 0
    assert whole > 0
