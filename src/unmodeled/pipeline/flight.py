"""Test point B: an orbit propagated with the learned model, compared with the true orbit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.integrate

from unmodeled.core.arrays import Array
from unmodeled.core.units import NORMALISED_GM, NormalisedUnits
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["Flight", "fly"]

# The solver's own error; the report states what it leaves on the true field.
_RTOL, _ATOL = 1e-11, 1e-12
#: Evaluations of the field allowed for each period; smooth fields need 1,000-2,000.
_BUDGET = 20_000
#: A flight ends where the predicted orbit leaves this many times its true largest radius.
_FAR = 10.0
#: ... or falls below this share of the Brillouin radius.
_DEEP = 0.2


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
        ``"too many evaluations"``, ``"field not finite"``.
    evaluations : int
        Evaluations of the learned field.
    """

    times: Array
    position_error: Array
    status: str
    evaluations: int

    def largest_error(self, until: float) -> float:
        """Return the largest position error (m) up to a time (s); infinite if it ended before."""
        if self.status != "complete" and (not len(self.times) or self.times[-1] < until):
            return float("inf")
        return float(self.position_error[self.times <= until].max())


class _StopFlight(Exception):  # noqa: N818  (a signal, not an error)
    pass


def fly(
    acceleration: Callable[[Array], Array],
    truth: Trajectory,
    units: NormalisedUnits,
    duration: float,
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
    duration : float
        How long, s; at most as long as the true orbit.
    """
    elapsed = truth.times - truth.times[0]
    keep = elapsed <= duration * (1 + 1e-12)
    t = elapsed[keep] / units.time
    true = truth.positions[keep]
    y0 = np.concatenate([truth.positions[0] / units.length, truth.velocities[0] / units.velocity])
    far = _FAR * float(truth.radii.max()) / units.length
    energy = 0.5 * float(y0[3:] @ y0[3:]) - NORMALISED_GM / float(np.linalg.norm(y0[:3]))
    period = 2 * np.pi * np.sqrt((NORMALISED_GM / (2 * abs(energy))) ** 3 / NORMALISED_GM)
    budget = int(_BUDGET * max(1.0, t[-1] / period))
    count = 0
    reason = "complete"

    def rate(_: float, y: Array) -> Array:
        nonlocal count, reason
        count += 1
        r = float(np.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2))
        if count > budget:
            reason = "too many evaluations"
        elif r > far:
            reason = "left the region"
        elif r < _DEEP:
            reason = "fell into the body"
        if reason != "complete":
            raise _StopFlight
        a = acceleration(y[None, :3])[0]
        if not np.all(np.isfinite(a)):
            reason = "field not finite"
            raise _StopFlight
        return np.concatenate([y[3:], a])

    positions = [y0[:3]]
    solver = scipy.integrate.DOP853(rate, t[0], y0, t[-1], rtol=_RTOL, atol=_ATOL)
    try:
        k = 1
        while k < len(t):
            message = solver.step()
            if solver.status == "failed":
                reason = f"step too small ({message})"
                break
            dense = solver.dense_output()
            while k < len(t) and t[k] <= solver.t:
                positions.append(dense(t[k])[:3])
                k += 1
    except _StopFlight:
        pass
    reached = len(positions)
    error = np.linalg.norm(np.array(positions) * units.length - true[:reached], axis=1)
    return Flight(t[:reached] * units.time, error, reason, count)
