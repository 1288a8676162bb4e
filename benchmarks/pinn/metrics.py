"""The numbers of the protocol, each with a test that would catch the known ways to get it wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.integrate

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, UnmodeledError
from unmodeled.core.frames import rotation_about_z
from unmodeled.pipeline.cost import time_evaluation
from unmodeled.pipeline.field_metrics import cumulative_position_error
from unmodeled.pipeline.metrics import fractional_error

__all__ = [
    "PercentError",
    "TrajectoryError",
    "evaluation_times",
    "fly_spinning",
    "percent_error",
    "trajectory_error",
]

#: A flight that takes more evaluations than this is given up.
_MOST_EVALUATIONS = 60_000


@dataclass(frozen=True)
class PercentError:
    """Of a set of points, percent of the length of the true acceleration.

    Parameters
    ----------
    mean, median, worst : float
        Of ``|a_true - a_predicted| / |a_true| * 100`` over the points; infinite where a
        prediction is not finite.
    """

    mean: float
    median: float
    worst: float


def percent_error(*, true: Array, predicted: Array) -> PercentError:
    """Return the percent error; by name only, because true and predicted are easily swapped.

    It is relative to the truth, and of the difference of the vectors: not of their lengths, which
    would be blind to a wrong direction.

    Parameters
    ----------
    true, predicted : ndarray (n, 3)
    """
    errors = 100.0 * fractional_error(true, predicted)
    return PercentError(float(errors.mean()), float(np.median(errors)), float(errors.max()))


@dataclass(frozen=True)
class TrajectoryError:
    """A flight beside the true one, at the same nodes.

    Parameters
    ----------
    cumulative : float
        Sum of the distances over the nodes, m: the protocol's number; grows with the nodes.
    rms : float
        Root mean square distance, m: does not.
    last : float
        Distance at the last node, m.
    """

    cumulative: float
    rms: float
    last: float


def trajectory_error(*, true: Array, predicted: Array) -> TrajectoryError:
    """Return the errors of a flight; all infinite if it ended early.

    Parameters
    ----------
    true : ndarray (n, 3)
        Positions, m.
    predicted : ndarray (m, 3)
    """
    total = cumulative_position_error(true, predicted)
    if not np.isfinite(total):
        return TrajectoryError(np.inf, np.inf, np.inf)
    distance = np.linalg.norm(predicted - true, axis=1)
    return TrajectoryError(total, float(np.sqrt(np.mean(distance**2))), float(distance[-1]))


def fly_spinning(
    acceleration: Callable[[Array], Array],
    position: Array,
    velocity: Array,
    times: Array,
    spin_rate: float,
    tolerance: float = 1e-10,
) -> Array:
    """Return inertial positions (m, 3) at ``times``, fewer if the flight broke down.

    Parameters
    ----------
    acceleration : callable
        Body-fixed positions (n, 3), m, to body-fixed accelerations (n, 3), m/s2.
    position, velocity : ndarray (3,)
        At the first time, inertial; body axes are the inertial ones at time zero.
    times : ndarray (n,)
        Nodes, s.
    spin_rate : float
        About z, rad/s.
    tolerance : float
        Relative and, in units of the start, absolute, of scipy's RK45.
    """
    calls = 0

    def rate(t: float, y: Array) -> Array:
        nonlocal calls
        calls += 1
        if calls > _MOST_EVALUATIONS:
            raise DataError(f"a flight of more than {_MOST_EVALUATIONS} evaluations")
        turn = rotation_about_z(spin_rate * t)
        a = turn.T @ acceleration((turn @ y[:3])[None])[0]
        if not np.all(np.isfinite(a)):
            raise DataError("the field is not finite")
        return np.concatenate([y[3:], a])

    start = np.concatenate([position, velocity])
    scale = np.repeat([np.linalg.norm(position), np.linalg.norm(velocity)], 3)
    reached, node = [start[:3]], 1
    try:
        solver = scipy.integrate.RK45(
            rate, times[0], start, times[-1], rtol=tolerance, atol=tolerance * scale
        )
        while solver.status == "running" and node < len(times):
            solver.step()
            inside = solver.dense_output()
            while node < len(times) and times[node] <= solver.t:
                reached.append(inside(times[node])[:3])
                node += 1
    except UnmodeledError:  # not finite, too long, or where a learner refuses to predict
        pass
    return np.array(reached)


def evaluation_times(predict: Callable[[Array], Array], points: Array) -> tuple[float, float]:
    """Return seconds of one point alone and of all points in one call, measured separately.

    Median of 20 single calls, best of 3 whole calls, after one call to warm up.
    """
    single, point = time_evaluation(predict, points)
    return single, point * len(points)
