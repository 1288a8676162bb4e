"""Test point B: an orbit propagated with the learned model, compared with the true orbit."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy.integrate

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rotation_about_z
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["Flight", "Force", "fly", "fly_force"]

#: Positions and velocities (n, 3), normalised, and times (n,), s, to accelerations (n, 3).
Force: TypeAlias = Callable[[Array, Array, Array], Array]

# Eighth-order steps in each period, shorter near the body (time step proportional to r^1.5).
# The steps are fixed in advance: a network with kinks or a piecewise constant field costs the
# same as a smooth one, where step-size control would grind to a halt. What this leaves on the
# true field is measured and reported.
_STEPS_PER_PERIOD = 100
#: A flight ends where the predicted orbit leaves this many times its true largest radius.
_FAR = 10.0
#: ... or falls below this share of the Brillouin radius.
_DEEP = 0.2
# With such tolerances the solver accepts every step, so that its step is the one asked for.
_ACCEPT = 1e6
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Flight:
    """A predicted orbit beside the true one.

    Parameters
    ----------
    times : ndarray (n,)
        Seconds since the start; as far as the prediction went.
    position_error : ndarray (n,)
        Distance between predicted and true position, m.
    status : str
        ``"complete"``, or why it ended: ``"left the region"``, ``"fell into the body"``,
        ``"field not finite"``, ``"step too small"``.
    evaluations : int
        Evaluations of the learned field.
    """

    times: Array
    position_error: Array
    status: str
    evaluations: int

    def largest_error(self, until: float) -> float:
        """Return the largest position error (m) up to a time (s); infinite if it ended before."""
        # A sample at the very end counts, whatever rounding says.
        if self.status != "complete" and self.times[-1] < until * (1 - _ROUNDING):
            return float("inf")
        return float(self.position_error[self.times <= until * (1 + _ROUNDING)].max())


class _StopFlight(Exception):  # noqa: N818  (a signal, not an error)
    pass


def fly(
    acceleration: Callable[[Array], Array],
    truth: Trajectory,
    units: NormalisedUnits,
    period: float,
    duration: float,
    spin_rate: float = 0.0,
) -> Flight:
    """Propagate from the true initial state with a learned field.

    Parameters
    ----------
    acceleration : callable
        Normalised positions (n, 3) to normalised accelerations (n, 3).
    truth : Trajectory
        True orbit, SI; the flight starts at its first sample and is compared at its samples.
    units : NormalisedUnits
        Units of the learned field.
    period : float
        Kepler period of the orbit, s; sets the step.
    duration : float
        How long, s; the flight ends earlier where the true orbit does.
    spin_rate : float
        With which the learned field turns about z, rad/s; its axes are the inertial ones at time
        zero of ``truth``.
    """
    return fly_force(lambda x, v, t: acceleration(x), truth, units, period, duration, spin_rate)


def fly_force(
    force: Force,
    truth: Trajectory,
    units: NormalisedUnits,
    period: float,
    duration: float,
    spin_rate: float = 0.0,
) -> Flight:
    """Do what `fly` does, with what may depend on velocity and time too.

    Parameters
    ----------
    force : callable
        Normalised positions and velocities (n, 3) and times (n,), s, to normalised accelerations
        (n, 3). Velocities are relative to inertial axes, components along those of the positions.
    truth, units, period, duration, spin_rate
        As for `fly`.
    """
    elapsed = truth.times - truth.times[0]
    keep = elapsed <= duration * (1 + _ROUNDING)
    t = elapsed[keep] / units.time
    true = truth.positions[keep] / units.length
    y = np.concatenate([true[0], truth.velocities[0] / units.velocity])
    far = _FAR * float(truth.radii.max()) / units.length
    steps = _steps_between_samples(t, np.linalg.norm(true, axis=1), period / units.time)
    status = "complete"
    evaluations = 0

    def rate(now: float, y: Array) -> Array:
        nonlocal status, evaluations
        evaluations += 1
        r = math.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
        if not _DEEP < r < far:
            a = np.full(3, np.nan)
        else:
            time = float(truth.times[0]) + now * units.time
            at = np.array([time])
            if spin_rate == 0.0:
                a = force(y[None, :3], y[None, 3:], at)[0]
            else:
                turn = rotation_about_z(spin_rate * time)
                a = turn.T @ force((turn @ y[:3])[None], (turn @ y[3:])[None], at)[0]
        if not np.all(np.isfinite(a)):
            status = (
                "left the region"
                if r >= far
                else "fell into the body"
                if r <= _DEEP
                else "field not finite"
            )
            raise _StopFlight
        return np.concatenate([y[3:], a])

    positions = [y[:3]]
    # A wild field may overflow within a step; the flight then ends with a reason.
    with suppress(_StopFlight), np.errstate(over="ignore", invalid="ignore"):
        for k, count in enumerate(steps):
            h = (t[k + 1] - t[k]) / count
            solver = scipy.integrate.DOP853(
                rate, t[k], y, t[k + 1], first_step=h, max_step=h, rtol=_ACCEPT, atol=_ACCEPT
            )
            while solver.status == "running":
                solver.step()
            if solver.status == "failed":
                status = "step too small"
                break
            y = solver.y
            positions.append(y[:3])
    reached = len(positions)
    error = np.linalg.norm(np.array(positions) - true[:reached], axis=1) * units.length
    return Flight(elapsed[:reached], error, status, evaluations)


def _steps_between_samples(t: Array, radius: Array, period: float) -> list[int]:
    """Return how many steps to take between neighbouring samples."""
    # Lowest radius of each interval, and of its neighbours: the orbit may dip between samples.
    low = np.minimum(radius[:-1], radius[1:])
    padded = np.concatenate([low[:1], low, low[-1:]])
    low = np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    mean = (radius.min() + radius.max()) / 2
    share = np.diff(t) / period * (mean / low) ** 1.5
    return [max(1, math.ceil(_STEPS_PER_PERIOD * s)) for s in share]
