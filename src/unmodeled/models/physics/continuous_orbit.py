"""An orbit that can be asked for its state at any time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError

__all__ = ["ContinuousOrbit"]


@dataclass(frozen=True)
class ContinuousOrbit:
    """One orbit, integrated once: the integrator's own polynomials give the states between steps.

    Parameters
    ----------
    epoch : float
        Time of ``state``, s.
    state : ndarray (6,)
        State from which it was integrated.
    start, end : float
        Interval, s; the epoch lies in it.
    before, after : heyoka continuous_output or None
        The orbit before and after the epoch; None where there is nothing.
    stops : tuple of float
        When a step had to end because a force changes fast there (`Effect.edges`), increasing, s.
    """

    epoch: float
    state: Array
    start: float
    end: float
    before: Any
    after: Any
    stops: tuple[float, ...] = ()

    @property
    def steps(self) -> int:
        """Steps that the integrator took."""
        return sum(int(part.n_steps) for part in (self.before, self.after) if part is not None)

    def states(self, times: Array) -> Array:
        """Return states (n, 6), inertial.

        Parameters
        ----------
        times : array_like (n,)
            Any order; the states are to the last bit those of a propagation from the epoch.

        Raises
        ------
        DataError
            If a time lies outside the interval.
        """
        times = as_array(times, ("n",), "times")
        if len(times) and (times.min() < self.start or times.max() > self.end):
            raise DataError(
                f"times from {times.min():.6g} s to {times.max():.6g} s",
                allowed=f"{self.start:.6g} s to {self.end:.6g} s, where the orbit was integrated",
            )
        out = np.empty((len(times), 6))
        for part, chosen in ((self.before, times < self.epoch), (self.after, times > self.epoch)):
            if np.any(chosen):
                out[chosen] = part(times[chosen])
        out[times == self.epoch] = self.state
        return out
