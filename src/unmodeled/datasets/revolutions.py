"""Cut a measured trajectory into training revolutions and later ones.

The period is the Kepler period of the first sample, as for a simulated orbit ([Neamati2022] Eq. 1).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.elements import osculating_period
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["first_revolutions", "split_revolutions", "thin"]

#: Share of a trajectory that trains when no number of periods is asked for.
_TRAIN_SHARE = 0.7
# A sample this share of a sampling interval before a cut lies on it: times are rounded.
_ROUNDING = 1e-6


def thin(trajectory: Trajectory, spacing: float) -> Trajectory:
    """Keep samples that are at least ``spacing`` seconds apart (all, if sampling is coarser).

    A sample counts as due when it lies within 1 % of the spacing, so that rounded time tags do
    not shift the pattern.
    """
    keep = [0]
    last = trajectory.times[0]
    for k in range(1, len(trajectory)):
        if trajectory.times[k] - last >= 0.99 * spacing:
            keep.append(k)
            last = trajectory.times[k]
    return trajectory[np.array(keep)]


def first_revolutions(
    trajectory: Trajectory,
    gm: float,
    periods: float | None = None,
    samples_per_period: int | None = None,
) -> tuple[Trajectory, float]:
    """Return the first revolutions of a trajectory (all, if ``periods`` is None) and its period.

    Raises
    ------
    DataError
        If the trajectory is shorter than asked for, or keeps fewer than 4 samples.
    OrbitError
        If the orbit is not bound.
    """
    period = osculating_period(trajectory.states[:1], gm, trajectory.source)
    elapsed = trajectory.times - trajectory.times[0]
    slack = float(np.median(np.diff(trajectory.times)))
    if periods is not None and periods * period > elapsed[-1] + slack:
        raise DataError(
            f"{trajectory.source} covers {elapsed[-1] / period:.2f} periods of {period:.6g} s; "
            f"{periods:.2f} are asked for",
            do="lower the number of periods, or give more data",
        )
    if samples_per_period is not None:
        trajectory = thin(trajectory, period / samples_per_period)
    if periods is None:
        return trajectory, period
    keep = trajectory.times - trajectory.times[0] < periods * period - _ROUNDING * slack
    return _kept(trajectory, keep), period


def split_revolutions(
    trajectory: Trajectory,
    gm: float,
    *,
    train_periods: float | None = None,
    extrapolation_periods: float | None = None,
    samples_per_period: int | None = None,
) -> tuple[Trajectory, Trajectory, float]:
    """Return the first revolutions, the ones after them, and the Kepler period.

    Parameters
    ----------
    trajectory : Trajectory
        Inertial.
    gm : float
        Gravitational parameter of the body, m3/s2; with the states it gives the period.
    train_periods : float, optional
        Periods of the first part; 70 % of the trajectory if not given.
    extrapolation_periods : float, optional
        Periods of the second part; all the rest if not given.
    samples_per_period : int, optional
        Thins the samples; all are kept if not given.

    Raises
    ------
    DataError
        If the trajectory is shorter than what is asked for, or leaves fewer than 4 samples.
    OrbitError
        If the orbit is not bound.
    """
    period = osculating_period(trajectory.states[:1], gm, trajectory.source)
    start, end = trajectory.times[0], trajectory.times[-1]
    available = (end - start) / period
    for name, value in (("train", train_periods), ("extrapolation", extrapolation_periods)):
        if value is not None and not value > 0:
            raise ConfigError(f"{name}_periods is {value}", allowed="a number > 0")
    train = _TRAIN_SHARE * available if train_periods is None else train_periods
    rest = available - train if extrapolation_periods is None else extrapolation_periods
    # One sample less than a whole number of periods still is that many periods.
    slack = float(np.median(np.diff(trajectory.times))) / period
    if train + rest > available + slack or rest <= 0:
        raise DataError(
            f"{trajectory.source} covers {available:.2f} periods of {period:.6g} s; "
            f"{train:.2f} for training and {max(rest, 0):.2f} for extrapolation are asked for",
            do="lower data.train_periods and data.extrapolation_periods, or give more data",
        )
    if samples_per_period is not None:
        trajectory = thin(trajectory, period / samples_per_period)
    cut = start + train * period
    first = trajectory.times < cut - _ROUNDING * slack * period
    second = ~first & (trajectory.times <= cut + (rest + slack) * period)
    return (
        _kept(trajectory, first, " for training"),
        _kept(trajectory, second, " for extrapolation"),
        period,
    )


def _kept(trajectory: Trajectory, mask: npt.NDArray[np.bool_], purpose: str = "") -> Trajectory:
    """Return the samples of a mask, or say that they are too few."""
    if mask.sum() < 4:
        raise DataError(
            f"{trajectory.source}: {int(mask.sum())} samples are left{purpose}",
            allowed="at least 4",
            do="use more periods or a higher data.samples_per_period",
        )
    return trajectory[mask]
