"""Any sum of catalogued effects as the dynamics of a filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.physics import Dynamics

__all__ = ["CatalogueModel"]


@dataclass(frozen=True)
class CatalogueModel:
    """A `RateModel` of position and velocity, inertial, from `Dynamics`.

    Compiled by heyoka, all runs in one call; the Jacobian is symbolic, not written by hand.

    Parameters
    ----------
    dynamics : Dynamics
        SI: m, m/s, s since its epoch.
    """

    dynamics: Dynamics

    @property
    def size(self) -> int:
        """Number of states."""
        return 6

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, 6) and its Jacobian (b, 6, 6); see `RateModel`."""
        states = np.ascontiguousarray(x[:, :6])
        A = np.zeros((len(x), 6, 6))
        A[:, :3, 3:] = np.eye(3)
        A[:, 3:] = self.dynamics.state_partials(states, t)
        return np.hstack([x[:, 3:6], self.dynamics.acceleration(states, t)]), A
