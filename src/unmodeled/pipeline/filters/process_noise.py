"""Process noise that does not depend on the state: constant, white, or held over a step."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.state import FilterState

__all__ = ["ConstantNoise", "HeldAcceleration", "WhiteAcceleration", "axis_values"]


def axis_values(values: npt.ArrayLike, name: str, dimensions: int) -> Array:
    """Return one value >= 0 for each axis, from one for all or one for each."""
    array = np.asarray(values, dtype=np.float64)
    array = as_array(np.full(dimensions, array) if array.ndim == 0 else array, (dimensions,), name)
    if np.any(array < 0.0):
        raise ConfigError(f"{name} is {array.min()}", allowed="numbers >= 0")
    return array


@dataclass(frozen=True)
class ConstantNoise:
    """The same covariance for every step, whatever its length.

    Parameters
    ----------
    Q : ndarray (n, n)
    """

    Q: Array

    def __post_init__(self) -> None:
        size = len(np.atleast_1d(self.Q))
        Q = as_array(self.Q, (size, size), "Q")
        if np.linalg.eigvalsh(0.5 * (Q + Q.T)).min() < -1e-9 * np.abs(Q).max():
            raise ConfigError("Q has a negative eigenvalue", allowed="a covariance")
        object.__setattr__(self, "Q", Q)

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (n, n)."""
        return self.Q


@dataclass(frozen=True)
class WhiteAcceleration:
    """Acceleration noise white in time: Q = q [dt^3/3, dt^2/2; dt^2/2, dt] on each axis.

    Independent of how the time is cut into steps. States are positions, then velocities, then
    anything else, which gets no noise.

    Parameters
    ----------
    density : float or array_like (dimensions,)
        Spectral density q, (m/s2)^2 s. What is often quoted as "sigma a second" is its root.
    dimensions : int
        Axes.
    """

    density: npt.ArrayLike
    dimensions: int = 3
    _cache: dict[tuple[int, float], Array] = field(default_factory=dict, compare=False, repr=False)

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (n, n)."""
        found = self._cache.get((state.mean.shape[1], dt))
        if found is not None:
            return found
        q = axis_values(self.density, "density", self.dimensions)
        blocks = ((dt**3 / 3.0, dt**2 / 2.0), (dt**2 / 2.0, dt))
        return _kept(self._cache, state.mean.shape[1], dt, q, blocks)


@dataclass(frozen=True)
class HeldAcceleration:
    """A new acceleration for each step, constant over it: Q = sigma^2 G G^T, G = [dt^2/2; dt].

    The form of [Pesce2020] and of most relative-navigation filters. Its strength depends on the
    step: for the same random walk in velocity, sigma^2 dt is the density of `WhiteAcceleration`.

    Parameters
    ----------
    sigma : float or array_like (dimensions,)
        m/s2.
    dimensions : int
        Axes.
    """

    sigma: npt.ArrayLike
    dimensions: int = 3
    _cache: dict[tuple[int, float], Array] = field(default_factory=dict, compare=False, repr=False)

    def covariance(self, state: FilterState, dt: float) -> Array:
        """Return Q (n, n)."""
        found = self._cache.get((state.mean.shape[1], dt))
        if found is not None:
            return found
        q = axis_values(self.sigma, "sigma", self.dimensions) ** 2
        blocks = ((dt**4 / 4.0, dt**3 / 2.0), (dt**3 / 2.0, dt**2))
        return _kept(self._cache, state.mean.shape[1], dt, q, blocks)


def _kept(
    cache: dict[tuple[int, float], Array],
    n: int,
    dt: float,
    q: Array,
    blocks: tuple[tuple[float, float], tuple[float, float]],
) -> Array:
    """Return the matrix for one size and step; steps repeat, so the last ones are kept."""
    d = len(q)
    made = np.zeros((n, n))
    made[: 2 * d, : 2 * d] = np.kron(np.array(blocks), np.diag(q))
    if len(cache) > 256:  # irregular times: do not grow without end
        cache.clear()
    cache[n, dt] = made
    return made
