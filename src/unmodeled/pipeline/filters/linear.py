"""Linear models and measurements, exact; with them the extended filter is the Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.algebra import times

__all__ = ["LinearMeasurement", "LinearModel"]


@dataclass(frozen=True)
class LinearModel:
    """dx/dt = A x, solved exactly: a `RateModel` and a `ProcessModel`.

    With it, `ExtendedKalmanFilter` is the Kalman filter; as its transition is the same for all
    runs, one covariance and one gain serve them all.

    Parameters
    ----------
    A : ndarray (n, n)
        1/s.
    """

    A: Array
    _cache: dict[float, Array] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        size = len(np.atleast_1d(self.A))
        object.__setattr__(self, "A", as_array(self.A, (size, size), "A"))

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.A)

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return A x (b, n) and A (1, n, n)."""
        return times(self.A[None], x), self.A[None]

    def propagate(self, x: Array, t: float, dt: float) -> tuple[Array, Array]:
        """Return exp(A dt) x (b, n) and exp(A dt) (1, n, n)."""
        F = self._cache.get(dt)
        if F is None:
            F = np.asarray(expm(self.A * dt))[None]
            if len(self._cache) > 256:  # irregular times: do not grow without end
                self._cache.clear()
            self._cache[dt] = F
        return times(F, x), F


@dataclass(frozen=True)
class LinearMeasurement:
    """z = H x + noise of covariance R.

    Parameters
    ----------
    H : ndarray (m, n)
    R : ndarray (m, m)
        Positive definite.
    """

    H: Array
    R: Array

    def __post_init__(self) -> None:
        H = as_array(self.H, ("m", "n"), "H")
        R = as_array(self.R, (len(H), len(H)), "R")
        if not np.array_equal(R, R.T) or np.linalg.eigvalsh(R).min() <= 0.0:
            raise ConfigError("R is not a covariance", allowed="symmetric, positive definite")
        object.__setattr__(self, "H", H)
        object.__setattr__(self, "R", R)

    @classmethod
    def of_sigma(cls, columns: list[int], sigma: list[float], size: int) -> LinearMeasurement:
        """Measure single states, ``columns``, each with its own independent ``sigma``."""
        H = np.zeros((len(columns), size))
        H[np.arange(len(columns)), columns] = 1.0
        return cls(H, np.diag(np.asarray(sigma, dtype=np.float64) ** 2))

    def h(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return H x (b, m) and H (1, m, n)."""
        return times(self.H[None], x), self.H[None]
