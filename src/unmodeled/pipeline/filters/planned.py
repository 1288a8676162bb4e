"""Linear dynamics that are known before the flight: all transitions are computed at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import ConfigError

__all__ = ["PlannedModel"]


@dataclass(frozen=True)
class PlannedModel:
    """A `ProcessModel` dx/dt = A(t) x whose steps are those of a plan.

    The transitions are common to all runs, so covariance and gain are, too: a step costs as
    much as that of constant coefficients.

    Parameters
    ----------
    times : ndarray (k,)
        Epochs, s, increasing.
    transitions : ndarray (k - 1, n, n)
        From each epoch to the next.
    """

    times: Array
    transitions: Array

    @classmethod
    def of(cls, matrices: Callable[[Array], Array], times: Array) -> PlannedModel:
        """Integrate the transitions, one Runge-Kutta step of fourth order between epochs.

        Parameters
        ----------
        matrices : callable
            A (k, n, n) at times (k,), 1/s.
        times : ndarray (k,)
            Epochs, s; their distance must be short beside the periods of A.
        """
        t = as_array(times, ("k",), "times")
        check_increasing(t, "times")
        h = np.diff(t)[:, None, None]
        A = matrices(t)
        mid = matrices(t[:-1] + 0.5 * h[:, 0, 0])
        one = np.eye(A.shape[-1])
        G1 = A[:-1]
        G2 = mid @ (one + 0.5 * h * G1)
        G3 = mid @ (one + 0.5 * h * G2)
        G4 = A[1:] @ (one + h * G3)
        return cls(t, one + (h / 6.0) * (G1 + 2.0 * (G2 + G3) + G4))

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.transitions[0])

    def propagate(self, x: Array, t: float, dt: float) -> tuple[Array, Array]:
        """Return the states (b, n) at ``t + dt`` and the transition (1, n, n).

        Raises
        ------
        ConfigError
            If the step is not one of the plan.
        """
        k = int(np.searchsorted(self.times, t + 0.5 * dt)) - 1
        far = 1e-6 * dt
        planned = 0 <= k < len(self.transitions)
        if not (planned and abs(self.times[k] - t) < far and abs(self.times[k + 1] - t - dt) < far):
            raise ConfigError(
                f"a step from {t:g} s over {dt:g} s is not in the plan",
                allowed=f"from one of {len(self.times)} epochs to the next",
                do="plan with the epochs of the measurements",
            )
        F = self.transitions[k]
        return x @ F.T, F[None]
