"""Formations: linear motion about the target's true orbit, periodic accelerations as states."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.interpolate import make_interp_spline

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

#: What a mission would assume of surfaces before it flies; the true ones may be others.
REFLECTIVITY, DRAG_COEFFICIENT = 1.3, 2.2

__all__ = ["DRAG_COEFFICIENT", "REFLECTIVITY", "periodic_accelerations", "pushed_filter"]


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


def _periodic(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    harmonics = int(n["harmonics"])
    if harmonics < 0:
        raise ConfigError(f"harmonics is {harmonics}", allowed="an integer >= 0")
    reference = _physics(flight, "periodic").reference

    def push(times: Array) -> Array:
        return periodic_accelerations(reference.at(times)[:, 4], harmonics)

    sigma = np.full(3 * (2 * harmonics + 1), n["sigma"])
    return pushed_filter(flight, starts, push, sigma, n)


def _effects(flight: Flight, starts: Array, n: Mapping[str, float]) -> Contestant:
    _physics(flight, "effects")
    if not flight.suspects:
        raise ConfigError(
            f"{flight.name} has no effect beyond the target's orbit",
            do="leave effects out of the filters",
        )
    light, air = (flight.suspects[name] for name in ("light", "air"))
    pushes = np.stack([REFLECTIVITY * light + DRAG_COEFFICIENT * air, air], axis=2)
    sigma = n["sigma"] * np.array([1.0, n["apart"] * DRAG_COEFFICIENT])
    # linear between epochs: the edge of the shadow is sharp, and a cubic would ring there
    between = make_interp_spline(flight.times, pushes, k=1)
    return pushed_filter(flight, starts, between, sigma, n)


def _physics(flight: Flight, name: str) -> XuWang:
    if not isinstance(flight.nonlinear, XuWang):
        raise ConfigError(
            f"{flight.title} has no known orbit of a target",
            do=f"leave {name} out of the filters",
        )
    return flight.nonlinear


def pushed_filter(
    flight: Flight,
    starts: Array,
    push: Callable[[Array], Array],
    sigma: Array,
    n: Mapping[str, float],
) -> Contestant:
    """Return the filter of linear motion about the target's orbit with accelerations as states.

    What the target's orbit does to relative motion (eccentricity, J2) is linear and known before;
    what differs between the spacecraft (air, light) is a sum of known functions of time with
    unknown weights. All coefficients are functions of time: one covariance and one gain serve all
    runs.

    Parameters
    ----------
    flight : Flight
        Of a formation.
    starts : ndarray (b, 6)
    push : callable
        Accelerations (k, 3, weights) of unit weights at times (k,), m/s2.
    sigma : ndarray (weights,)
        Standard deviations before the flight.
    n : mapping of str to float
        ``noise`` and ``drift``, the random walk of each weight in a root second.
    """
    weights = len(sigma)
    physics = _physics(flight, "such filters")

    def matrices(times: Array) -> Array:
        A = np.zeros((len(times), 6 + weights, 6 + weights))
        A[:, :6, :6] = physics.linear(times)
        A[:, 3:6, 6:] = push(times)
        return A

    def believed(run: FilterRun) -> Array:
        known = physics.linear(run.times)[:, 3:]
        own = flight.base.rates(run.mean[0, :1, :6], 0.0)[1][:, 3:]
        residual = np.concatenate([known - own, push(run.times)], axis=2)
        found: Array = np.einsum("kij,kbj->kbi", residual, run.mean)
        return found

    noise = WithWeightsNoise(WhiteAcceleration(n["noise"] ** 2), weights, n["drift"] ** 2)
    model = flight.flown(PlannedModel.of(matrices, flight.times))
    return Contestant(
        ExtendedKalmanFilter(model, more_states(flight.measurement, 6 + weights), noise),
        begin(flight, starts, weights, sigma),
        believed,
    )


_NAN = float("nan")
register(
    Entry(
        "periodic",
        "linear about the target's orbit, periodic accelerations as states",
        {"noise": _NAN, "sigma": _NAN, "harmonics": 1.0, "drift": 0.0},
        _periodic,
        "learned",
    )
)
register(
    Entry(
        "effects",
        "linear about the target's orbit, area (light, air) as states",
        {"noise": _NAN, "sigma": _NAN, "apart": 0.3, "drift": 0.0},
        _effects,
        "learned",
    )
)
