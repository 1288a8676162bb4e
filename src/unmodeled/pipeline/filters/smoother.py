"""Rauch-Tung-Striebel smoother: every estimate with all measurements, before and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import InputError
from unmodeled.pipeline.filters.algebra import cholesky, cholesky_solve, symmetrise, times
from unmodeled.pipeline.filters.run import FilterRun

__all__ = ["Smoothed", "smooth"]


@dataclass(frozen=True)
class Smoothed:
    """Smoothed estimates.

    Parameters
    ----------
    times : ndarray (k,)
    mean : ndarray (k, b, n)
    covariance : ndarray (k, b or 1, n, n)
    """

    times: Array
    mean: Array
    covariance: Array

    @property
    def sigma(self) -> Array:
        """Standard deviations (k, b, n)."""
        root = np.sqrt(np.maximum(np.diagonal(self.covariance, axis1=-2, axis2=-1), 0.0))
        return np.broadcast_to(root, self.mean.shape)


def smooth(run: FilterRun) -> Smoothed:
    """Go back over a run that was kept in full [Rauch1965].

    Parameters
    ----------
    run : FilterRun
        Of ``run_filter(..., keep="all")``.

    Raises
    ------
    InputError
        If the run was not kept in full.
    """
    if run.updates is None or run.predictions is None:
        raise InputError("the run keeps no covariances", do='run the filter with keep="all"')
    state = run.updates[-1].state
    x, P = state.mean, state.covariance
    means, covariances = [x], [P]
    for k in range(len(run.times) - 2, -1, -1):
        predicted, filtered = run.predictions[k + 1], run.updates[k].state
        assert predicted is not None  # times increase
        # In correlations: P alone would lose its small states to rounding.
        size = np.sqrt(np.diagonal(predicted.state.covariance, axis1=-2, axis2=-1))
        size = np.where(size > 0.0, size, 1.0)
        unit = predicted.state.covariance / size[..., :, None] / size[..., None, :]
        L = cholesky(_regular(unit), "the predicted covariance")
        cross = (predicted.transition @ filtered.covariance) / size[..., :, None]
        G = cholesky_solve(L, cross).mT / size[..., None, :]
        x = filtered.mean + times(G, x - predicted.state.mean)
        P = symmetrise(filtered.covariance + G @ (P - predicted.state.covariance) @ G.mT)
        means.append(x)
        covariances.append(P)
    return Smoothed(
        run.times, np.stack(means[::-1]), np.stack(np.broadcast_arrays(*covariances[::-1]))
    )


def _regular(unit: Array) -> Array:
    """Give states that are known exactly (zero row) a unit variance: their gain is zero."""
    exact = np.diagonal(unit, axis1=-2, axis2=-1) == 0.0
    if not exact.any():
        return unit
    filled: Array = unit + exact[..., :, None] * np.eye(unit.shape[-1])
    return filled
