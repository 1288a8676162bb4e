"""Smooth curves through the samples of an orbit, for drawing only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BPoly, CubicSpline

from unmodeled.core.arrays import Array
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.trajectory import Trajectory
from unmodeled.models.learned import PointMassOnly

__all__ = ["SmoothOrbit", "smooth_orbit"]

_STEPS = 6


@dataclass(frozen=True)
class SmoothOrbit:
    """Positions, velocities and true accelerations, dense in time.

    Parameters
    ----------
    positions, velocities, accelerations : ndarray (n, 3)
        Normalised units, axes of the orbit.
    times : ndarray (n,)
        Seconds since the epoch of the orbit.
    """

    positions: Array
    velocities: Array
    accelerations: Array
    times: Array


def smooth_orbit(orbit: Trajectory, units: NormalisedUnits, seconds: float = np.inf) -> SmoothOrbit:
    """Return points between the samples of an orbit.

    Positions follow the quintic through positions, velocities and accelerations. Accelerations
    are those of the point mass there plus a spline of the small rest, so that the steep part is
    exact; 25 samples a period then suffice for a smooth curve. No number of a report uses them.

    Parameters
    ----------
    orbit : Trajectory
        SI, with accelerations.
    units : NormalisedUnits
        Units of the result.
    seconds : float
        Only the first part of the orbit, to the last sample within this time.
    """
    part = orbit[orbit.times - orbit.times[0] <= seconds * (1 + 1e-9)]
    if part.accelerations is None:
        raise AssertionError("learning data always has accelerations")
    t = part.times / units.time
    x = part.positions / units.length
    v = part.velocities / units.velocity
    a = part.accelerations / units.acceleration
    dense = np.interp(np.arange(_STEPS * (len(t) - 1) + 1) / _STEPS, np.arange(len(t)), t)
    curve = BPoly.from_derivatives(t, np.stack([x, v, a], axis=1))
    positions: Array = curve(dense)
    velocities: Array = curve.derivative()(dense)
    mass = PointMassOnly().fit(x, a)
    rest = CubicSpline(t, a - mass.predict(x))(dense)
    return SmoothOrbit(positions, velocities, mass.predict(positions) + rest, dense * units.time)
