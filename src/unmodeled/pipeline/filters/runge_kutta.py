"""From a differential equation to steps: fourth-order Runge-Kutta of states and transition."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.interfaces import RateModel

__all__ = ["RungeKutta"]


@dataclass(frozen=True)
class RungeKutta:
    """A `ProcessModel` that integrates a `RateModel` and its variational equations.

    The classical fourth-order method; the transition is the exact derivative of the discrete
    map to fourth order (d/dt F = A F along the same stages).

    Parameters
    ----------
    model : RateModel
    longest : float
        Longest integration step, seconds; a filter step is cut into equal parts of at most this.
    """

    model: RateModel
    longest: float = float("inf")

    def __post_init__(self) -> None:
        if not self.longest > 0.0:
            raise ConfigError(f"longest step is {self.longest} s", allowed="> 0")

    @property
    def size(self) -> int:
        """Number of states."""
        return self.model.size

    def propagate(self, x: Array, t: float, dt: float) -> tuple[Array, Array]:
        """Return states and transition after ``dt``; see `ProcessModel`."""
        parts = max(1, int(np.ceil(dt / self.longest * (1.0 - 1e-12))))
        h = dt / parts
        whole: Array | None = None
        for k in range(parts):
            x, F = self._step(x, t + k * h, h)
            whole = F if whole is None else F @ whole
        assert whole is not None
        return x, whole

    def _step(self, x: Array, t: float, h: float) -> tuple[Array, Array]:
        rates, half = self.model.rates, 0.5 * h
        k1, A1 = rates(x, t)
        k2, A2 = rates(x + half * k1, t + half)
        k3, A3 = rates(x + half * k2, t + half)
        k4, A4 = rates(x + h * k3, t + h)
        # slopes of the stages, of F starting at the unit matrix: the derivative of each line above,
        # G2 = A2 (1 + h/2 A1), G3 = A3 (1 + h/2 G2), G4 = A4 (1 + h G3); in place, for speed
        G2 = A2 @ A1
        G2 *= half
        G2 += A2
        G3 = A3 @ G2
        G3 *= half
        G3 += A3
        F = A4 @ G3
        F *= h
        F += A4
        F += A1
        G2 += G3
        G2 *= 2.0
        F += G2
        F *= h / 6.0
        diagonal = np.einsum("bii->bi", F)  # a view
        diagonal += 1.0
        return x + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4), F
