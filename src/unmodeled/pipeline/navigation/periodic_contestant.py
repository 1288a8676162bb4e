"""Formations: linear motion about the target's true orbit, periodic accelerations as states."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.models.physics.motion import XuWang
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.planned import PlannedModel
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration
from unmodeled.pipeline.filters.run import FilterRun
from unmodeled.pipeline.filters.with_weights import WithWeightsNoise
from unmodeled.pipeline.navigation.contestants import (
    Contestant,
    Entry,
    begin,
    more_states,
    register,
)
from unmodeled.pipeline.navigation.flight import Flight

__all__ = ["periodic_accelerations", "periodic_filter"]


def periodic_accelerations(latitude: Array, harmonics: int) -> Array:
    """Return what unit weights push, (k, 3, 3 (2 h + 1)): 1, cos j u, sin j u on each axis.

    Parameters
    ----------
    latitude : ndarray (k,)
        Argument of latitude u, rad.
    harmonics : int
        h; 0 leaves the constants.
    """
    angles = latitude[:, None] * np.arange(1.0, harmonics + 1.0)
    series = np.hstack([np.ones((len(latitude), 1)), np.cos(angles), np.sin(angles)])
    return np.kron(series[:, None, :], np.eye(3))


def periodic_filter(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    """Return the filter whose weights of constant and periodic accelerations are states.

    What the target's orbit does to relative motion (eccentricity, J2) is linear and known before;
    what differs between two spacecraft (air, light) repeats from one revolution to the next. Both
    have coefficients of time alone: one covariance and one gain serve all runs.
    """
    physics = flight.nonlinear
    if not isinstance(physics, XuWang):
        raise ConfigError(
            f"{flight.title} has no known orbit of a target", do="leave periodic out of the filters"
        )
    harmonics = int(n["harmonics"])
    if harmonics < 0:
        raise ConfigError(f"harmonics is {harmonics}", allowed="an integer >= 0")
    more = 3 * (2 * harmonics + 1)

    def push(times: Array) -> Array:
        return periodic_accelerations(physics.reference.at(times)[:, 4], harmonics)

    def matrices(times: Array) -> Array:
        A = np.zeros((len(times), 6 + more, 6 + more))
        A[:, :6, :6] = physics.linear(times)
        A[:, 3:6, 6:] = push(times)
        return A

    def believed(run: FilterRun) -> Array:
        known = physics.linear(run.times)[:, 3:]
        own = flight.base.rates(run.mean[0, :1, :6], 0.0)[1][:, 3:]
        residual = np.concatenate([known - own, push(run.times)], axis=2)
        return np.einsum("kij,kbj->kbi", residual, run.mean)

    noise = WithWeightsNoise(WhiteAcceleration(n["noise"] ** 2), more, n["drift"] ** 2)
    model = flight.flown(PlannedModel.of(matrices, flight.times))
    return Contestant(
        ExtendedKalmanFilter(model, more_states(flight.measurement, 6 + more), noise),
        begin(flight, starts, more, n["sigma"]),
        believed,
    )


_NAN = float("nan")
register(
    Entry(
        "periodic",
        "linear about the target's orbit, periodic accelerations as states",
        {"noise": _NAN, "sigma": _NAN, "harmonics": 1.0, "drift": 0.0},
        periodic_filter,
        "learned",
    )
)
