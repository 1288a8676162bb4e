"""Training on one orbit that the positions agree with, instead of on noisy positions one by one.

Noisy positions of one orbit are not independent: a few numbers say where all of them are. An orbit
is fitted to them by batch least squares in the current model, the learner is trained on the states
and accelerations of that orbit, and the orbit is fitted again in what was learned, until it stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, NumericalError
from unmodeled.core.threads import one_thread
from unmodeled.core.units import NORMALISED_GM
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.learned import Learner, NoiseLevel, PointMassOnly
from unmodeled.models.physics.exterior_harmonics import column_degrees
from unmodeled.pipeline.orbit_data import OrbitData
from unmodeled.pipeline.orbit_search import search_orbit
from unmodeled.pipeline.orbit_shooting import Field
from unmodeled.pipeline.orbit_smoothing import smooth_orbit

__all__ = ["ConsistentFit", "train_consistently", "trajectory_consistent_fit"]

#: Settled: the median state moves by less than this share of the position noise, ...
_MOVED = 0.5
#: ... and the squared residuals are as stated to this many of their standard deviations.
_SIGMAS = 4.0


@dataclass(frozen=True)
class ConsistentFit:
    """A learner and the orbit that it was trained on.

    Parameters
    ----------
    learner : Learner
        Fitted.
    positions : ndarray (n, 3)
        Smoothed, in the order of the samples given.
    position_sigmas : ndarray (n, 3)
        Their standard deviations.
    rounds : int
        Orbits that a learner was trained on.
    moved : tuple of float
        After each round: median distance between that orbit and the one flown with the learner
        alone, over the position noise; infinite where no such orbit was found.
    reduced_square : float
        Of the orbit flown with the learner alone: squared position residuals over their number
        and noise; 1 if all is as stated.
    settled : bool
        Whether the learner alone flies through the positions, and along the same orbit.
    reason : str
        Why not; empty if it does.
    """

    learner: Learner
    positions: Array
    position_sigmas: Array
    rounds: int
    moved: tuple[float, ...]
    reduced_square: float
    settled: bool
    reason: str


def trajectory_consistent_fit(
    times: Array,
    X: Array,
    y: Array,
    learner: Learner,
    noise: NoiseLevel,
    *,
    gm: float = NORMALISED_GM,
    degree: int = 4,
    prior: float = 0.1,
    rounds: int = 3,
) -> ConsistentFit:
    """Train a learner on the orbit that noisy samples of one trajectory agree with.

    The first orbit is fitted in a point mass with harmonics of degree 2 to ``degree``, whose
    coefficients have standard deviations ``prior / n^2`` times a factor found by evidence; later
    ones in the learner with such harmonics. Mass and centre of mass are known.

    Parameters
    ----------
    times : ndarray (n,)
        Of the samples, in any order, normalised; inertial axes, no two the same.
    X, y : ndarray (n, 3)
        Observed positions and accelerations, normalised.
    learner : Learner
        Is fitted.
    noise : NoiseLevel
        Its position noise must be more than zero.
    gm : float
        Of the body, in the units of the samples.
    degree : int
        Highest degree of the harmonics, 2 or more.
    prior : float
        Standard deviation of normalised coefficients times the square of their degree.
    rounds : int
        At most.

    Returns
    -------
    ConsistentFit
        Also where it does not settle: see ``settled`` and ``reason``.

    Raises
    ------
    ConfigError
        Without position noise, or for options out of range.
    DataError
        For data that are no trajectory.
    NumericalError
        If no first orbit is found.
    """
    if not noise.position > 0:
        raise ConfigError(
            f"position noise is {noise.position}: there is nothing to smooth",
            allowed="more than 0",
            do="train on the samples as they are",
        )
    if degree < 2 or rounds < 1 or not prior > 0:
        raise ConfigError(
            f"degree {degree}, rounds {rounds}, prior {prior}",
            allowed="degree 2 or more, rounds 1 or more, prior more than 0",
        )
    times = as_array(times, ("n",), "times")
    X, y = as_array(X, ("n", 3), "X"), as_array(y, ("n", 3), "y")
    if not len(times) == len(X) == len(y):
        raise DataError(
            f"{len(times)} times, {len(X)} positions and {len(y)} accelerations",
            allowed="one of each for every sample",
        )
    order = np.argsort(times)
    t = times[order]
    if (np.diff(t) <= 0).any():
        raise DataError("two samples have the same time", do="give samples of one trajectory")
    degrees = column_degrees(degree)
    sizes = np.where(degrees >= 2, prior / np.maximum(degrees, 1) ** 2, 0.0)
    field: Field = _flown(PointMassOnly(gm).fit(X, y))
    moved: list[float] = []
    square, reason = float("inf"), ""
    data = OrbitData(t, X[order], y[order], noise.position, noise.acceleration, gm)
    with one_thread():
        orbit = search_orbit(data, field, degree, sizes)
        for k in range(rounds):
            if k:
                try:
                    orbit = smooth_orbit(data, field, orbit.states, degree, sizes)
                except NumericalError as error:
                    reason += f"; and no orbit near it: {error}"
                    break
            states = orbit.states
            learner.fit(
                states[:, :3], orbit.accelerations, NoiseLevel(samples=orbit.acceleration_sigmas)
            )
            field = _flown(learner)
            try:
                alone = smooth_orbit(data, field, states, degree, 0.0 * sizes)
            except NumericalError as error:
                moved.append(float("inf"))
                reason = f"no orbit in what was learned: {error}"
                continue
            away = np.linalg.norm(alone.states[:, :3] - states[:, :3], axis=1)
            moved.append(float(np.median(away)) / noise.position)
            square = alone.reduced_square
            reason = _why_not(moved[-1], square, X.size)
            if not reason:
                break
    back = np.argsort(order)
    return ConsistentFit(
        learner,
        states[back, :3],
        orbit.position_sigmas[back],
        len(moved),
        tuple(moved),
        square,
        not reason,
        reason,
    )


def train_consistently(data: LearningData, learner: Learner) -> ConsistentFit:
    """Apply `trajectory_consistent_fit` to the training samples of learning data.

    Raises
    ------
    ConfigError
        Where the samples turn with the body, besides its own reasons.
    """
    if data.learned_spin_rate != 0.0:
        raise ConfigError(
            f"training on an orbit with samples in {data.frame} axes",
            allowed="inertial axes",
            do="train on the samples as they are",
        )
    train = data.train
    return trajectory_consistent_fit(
        train.times / data.units.time,
        train.observed_positions,
        train.observed_accelerations,
        learner,
        NoiseLevel(data.noise.state, data.noise.acceleration),
    )


def _flown(learner: Learner) -> Field:
    return lambda x: (learner.predict(x), learner.jacobian(x))


def _why_not(moved: float, square: float, count: int) -> str:
    most = 1.0 + _SIGMAS * float(np.sqrt(2.0 / count))
    if square > most:
        return (
            f"the orbit flown with the learner misses the positions: squared residuals are "
            f"{square:.3g} of the stated noise (allowed: {most:.3g})"
        )
    if moved > _MOVED:
        return f"the orbit moves by {moved:.2g} of the position noise (allowed: {_MOVED})"
    return ""
