"""What no filter can beat: the covariance of a filter that knows everything but the noise."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.process_noise import WhiteAcceleration
from unmodeled.pipeline.filters.run import run_filter
from unmodeled.pipeline.filters.runge_kutta import RungeKutta
from unmodeled.pipeline.filters.state import FilterState
from unmodeled.pipeline.navigation.flight import Flight

__all__ = ["riccati_floor"]


def riccati_floor(flight: Flight, noise: float) -> Array:
    """Return standard deviations (k, 6) of the Riccati recursion along the true flight.

    Parameters
    ----------
    flight : Flight
    noise : float
        Root of the density of white acceleration that even the true model is taken to miss,
        m s-3/2; 0 makes the floor fall without end while measurements come.

    Notes
    -----
    The recursion is that of an extended Kalman filter that is fed its own true states: gains and
    covariances do not depend on measurements. Where it settles, it is the solution of the
    discrete algebraic Riccati equation. A root-mean-square error far below it cheats.
    """
    model = flight.flown(RungeKutta(flight.exact, flight.longest))
    blind = ExtendedKalmanFilter(model, flight.measurement, WhiteAcceleration(noise**2))
    start = FilterState.of(flight.truth[:1], np.diag(flight.start_sigma**2), flight.times[0])
    clean, _ = flight.measurement.h(flight.truth, 0.0)
    run = run_filter(blind, start, flight.times, clean[:, None, :], flight.used)
    floor: Array = run.sigma[:, 0, :6]
    return floor
