"""What a filter knows, before and after a measurement: immutable, batched over runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError

__all__ = ["Booleans", "FilterState", "Predicted", "Updated", "remember"]

Booleans = npt.NDArray[np.bool_]
_EMPTY: Mapping[str, Array] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class FilterState:
    """Estimate of all runs at one time.

    Parameters
    ----------
    mean : ndarray (b, n)
        One row for each Monte-Carlo run.
    covariance : ndarray (b, n, n) or (1, n, n)
        A single matrix stands for all runs, where model and measurements allow it.
    time : float
        Seconds.
    memory : mapping of str to ndarray
        What a filter carries besides: adapted noise, network weights, a square root.
    """

    mean: Array
    covariance: Array
    time: float
    memory: Mapping[str, Array] = field(default_factory=lambda: _EMPTY)

    @classmethod
    def of(
        cls, mean: npt.ArrayLike, covariance: npt.ArrayLike, time: float, runs: int | None = None
    ) -> FilterState:
        """Check and complete a start.

        Parameters
        ----------
        mean : array_like (n,) or (b, n)
        covariance : array_like (n, n), (1, n, n) or (b, n, n)
            Symmetric, no negative eigenvalue; zero is allowed.
        time : float
            Seconds.
        runs : int, optional
            Repeat one mean this many times.

        Raises
        ------
        DataError
            On shapes that do not fit, values that are not finite, or an impossible covariance.
        """
        x = np.atleast_2d(np.asarray(mean, dtype=np.float64))
        if runs is not None and len(x) == 1:
            x = np.repeat(x, runs, axis=0)
        x = as_array(x, ("b", "n"), "mean")
        n = x.shape[1]
        P = np.asarray(covariance, dtype=np.float64)
        P = as_array(P[None] if P.ndim == 2 else P, ("b", n, n), "covariance")
        if len(P) not in (1, len(x)):
            raise DataError(
                f"covariance has {len(P)} runs and mean has {len(x)}",
                allowed="one covariance for all runs, or one for each",
            )
        size = np.sqrt(np.abs(np.diagonal(P, axis1=1, axis2=2)))
        bound = size[:, :, None] * size[:, None, :]
        # 1e-9 of the product of the sigmas is far above rounding and far below a mistake
        if np.any(np.abs(P - P.mT) > 1e-9 * bound):
            raise DataError("covariance is not symmetric", allowed="a symmetric matrix")
        unit = P / np.where(bound > 0.0, bound, 1.0)
        least = float(np.linalg.eigvalsh(0.5 * (unit + unit.mT)).min())
        if least < -1e-9:
            raise DataError(
                f"covariance has a negative eigenvalue (correlations: {least:.3g})",
                allowed="variances >= 0 and correlations between -1 and 1",
            )
        return cls(x, 0.5 * (P + P.mT), float(time))

    @property
    def sigma(self) -> Array:
        """Standard deviations (b, n)."""
        variance = np.maximum(np.einsum("...ii->...i", self.covariance), 0.0)
        root: Array = np.sqrt(variance, out=variance)
        return root if root.shape == self.mean.shape else np.broadcast_to(root, self.mean.shape)


@dataclass(frozen=True, slots=True)
class Predicted:
    """A state carried over one step, with what carried it.

    Parameters
    ----------
    state : FilterState
        At the new time, before its measurement.
    transition : ndarray (b or 1, n, n)
        d new mean / d old mean.
    noise : ndarray (b or 1, n, n)
        Process noise that was added.
    previous : FilterState
        Before the step.
    """

    state: FilterState
    transition: Array
    noise: Array
    previous: FilterState


@dataclass(frozen=True, slots=True)
class Updated:
    """A state after a measurement, with all that the measurement said.

    Parameters
    ----------
    state : FilterState
        After the measurement; unchanged for runs without one, or whose one was rejected.
    innovation : ndarray (b, m)
        Measured minus expected; zero where nothing was measured.
    innovation_covariance : ndarray (b or 1, m, m)
        S = H P H^T + R; unit rows where nothing was measured.
    nis : ndarray (b,)
        Innovation squared by S^-1, also of rejected measurements.
    freedom : ndarray (b,) of int
        Components measured; 0 in a gap.
    accepted : ndarray (b,) of bool
        True where a measurement was used; False in a gap or where the gate rejected it.
    gain : ndarray (b or 1, n, m)
        K as applied: zero where nothing was used.
    design : ndarray (b or 1, m, n)
        H at the prediction, also of components that were not measured.
    used : ndarray (b or 1, m) of bool
        Components measured.
    """

    state: FilterState
    innovation: Array
    innovation_covariance: Array
    nis: Array
    freedom: npt.NDArray[np.intp]
    accepted: Booleans
    gain: Array
    design: Array
    used: Booleans


def remember(updated: Updated, memory: Mapping[str, Array]) -> Updated:
    """Return the update with entries added to, or changed in, its state's memory."""
    state = updated.state
    return replace(updated, state=replace(state, memory={**state.memory, **memory}))
