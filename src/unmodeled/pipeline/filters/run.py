"""Run a filter over a series of measurements, all Monte-Carlo runs at once, and keep the record."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import DataError, NumericalError
from unmodeled.pipeline.filters.algebra import cholesky, solve_lower
from unmodeled.pipeline.filters.state import Booleans, FilterState, Predicted, Updated

__all__ = ["Filter", "FilterRun", "normalised_error", "run_filter"]


class Filter(Protocol):
    """What can be run: pure functions on immutable states."""

    def start(self, state: FilterState) -> FilterState:
        """Check a start and add what the filter remembers."""
        ...

    def predict(self, state: FilterState, dt: float) -> Predicted:
        """Carry a state over ``dt`` > 0 seconds."""
        ...

    def update(self, predicted: Predicted, z: Array, used: npt.ArrayLike | None = None) -> Updated:
        """Use the measurements of one epoch."""
        ...


@dataclass(frozen=True)
class FilterRun:
    """What a filter said at each epoch, after its measurement.

    Parameters
    ----------
    times : ndarray (k,)
        Seconds.
    mean, sigma : ndarray (k, b, n)
    innovation : ndarray (k, b, m)
        Zero where nothing was measured.
    nis : ndarray (k, b)
    freedom : ndarray (k, b) of int
        Components measured; 0 in a gap.
    accepted : ndarray (k, b) of bool
        Measurements used; of the others with ``freedom`` > 0 the gate rejected.
    nees : ndarray (k, b) or None
        Normalised estimation error squared, with a truth.
    seconds : float
        Wall time of the whole.
    final : FilterState
    updates : tuple of Updated or None
        Each epoch in full, where asked for: covariances, gains and memory.
    predictions : tuple of Predicted or None
        Each step in full, the first epoch's without one: None.
    """

    times: Array
    mean: Array
    sigma: Array
    innovation: Array
    nis: Array
    freedom: npt.NDArray[np.intp]
    accepted: Booleans
    nees: Array | None
    seconds: float
    final: FilterState
    updates: tuple[Updated, ...] | None
    predictions: tuple[Predicted | None, ...] | None

    @property
    def rejected(self) -> int:
        """Number of measurements that the gate rejected."""
        return int(((self.freedom > 0) & ~self.accepted).sum())

    @property
    def seconds_per_step(self) -> float:
        """Wall time of one step of one run."""
        return self.seconds / max(1, self.nis.size)


def run_filter(
    filter: Filter,  # noqa: A002  (the field's own word)
    start: FilterState,
    times: Array,
    z: Array,
    used: npt.ArrayLike | None = None,
    truth: Array | None = None,
    keep: Literal["sigma", "all"] = "sigma",
) -> FilterRun:
    """Filter measurements of all runs.

    Parameters
    ----------
    filter : Filter
    start : FilterState
        At or before the first time.
    times : ndarray (k,)
        Epochs, increasing, seconds. At the time of the start nothing is predicted.
    z : ndarray (k, b, m)
        Measurements; NaN where there is none.
    used : array_like (k,), (k, b) or (k, b, m) of bool, optional
        Use these only: gaps without touching the data.
    truth : ndarray (k, n0) or (k, b, n0), optional
        True values of the first n0 states: NEES is computed on them.
    keep : {"sigma", "all"}
        ``all`` keeps every update and prediction: for the smoother, and for looking inside; it
        takes some k x b x n x n x 24 bytes.

    Raises
    ------
    DataError
        On shapes or times that do not fit.
    NumericalError
        Naming epoch and run, if an estimate is no longer finite.
    """
    times = as_array(times, ("k",), "times")
    check_increasing(times, "times")
    state = filter.start(start)
    b, n = state.mean.shape
    if z.ndim != 3 or z.shape[:2] != (len(times), b):
        raise DataError(f"z has shape {z.shape}", allowed=f"({len(times)}, {b}, m)")
    if times[0] < state.time:
        raise DataError(
            f"the first measurement is at {times[0]} s, the start at {state.time} s",
            allowed="a start at or before it",
        )
    masks = _masks(used, z.shape)
    true = None if truth is None else _truth(truth, len(times), b, n)
    mean, sigma = np.empty((len(times), b, n)), np.empty((len(times), b, n))
    innovation, nis = np.empty(z.shape), np.empty(z.shape[:2])
    freedom, accepted = np.empty(z.shape[:2], dtype=np.intp), np.empty(z.shape[:2], dtype=bool)
    nees = None if true is None else np.empty(z.shape[:2])
    updates: list[Updated] = []
    predictions: list[Predicted | None] = []
    began = time.perf_counter()
    for k, t in enumerate(times):
        dt = float(t) - state.time
        predicted = filter.predict(state, dt) if dt > 0.0 else _standing(state)
        _check_finite(predicted.state, k)
        after = filter.update(predicted, z[k], None if masks is None else masks[k])
        state = after.state
        _check_finite(state, k)
        mean[k], sigma[k] = state.mean, state.sigma
        innovation[k], nis[k] = after.innovation, after.nis
        freedom[k], accepted[k] = after.freedom, after.accepted
        if nees is not None and true is not None:
            nees[k] = normalised_error(state, true[k])
        if keep == "all":
            updates.append(after)
            predictions.append(predicted if dt > 0.0 else None)
    seconds = time.perf_counter() - began
    return FilterRun(
        times,
        mean,
        sigma,
        innovation,
        nis,
        freedom,
        accepted,
        nees,
        seconds,
        state,
        tuple(updates) if keep == "all" else None,
        tuple(predictions) if keep == "all" else None,
    )


def normalised_error(state: FilterState, true: Array) -> Array:
    """Return NEES (b,) of the first n0 states against ``true`` (b, n0)."""
    n0 = true.shape[-1]
    P = state.covariance[:, :n0, :n0]
    # Scaled to correlations: states of very different size would make P look singular.
    size = np.sqrt(np.maximum(np.diagonal(P, axis1=1, axis2=2), np.finfo(float).tiny))
    L = cholesky(P / size[:, :, None] / size[:, None, :], "the covariance of the estimate")
    half = solve_lower(L, ((state.mean[:, :n0] - true) / size)[..., None])
    squares: Array = (half[..., 0] ** 2).sum(axis=-1)
    return squares


def _check_finite(state: FilterState, epoch: int) -> None:
    good = np.isfinite(state.mean)
    if not good.all():
        run = int(np.argmin(good.all(axis=1)))
        raise NumericalError(
            f"the estimate of run {run} is not finite at epoch {epoch} ({state.time:.6g} s)",
            do="the filter diverged: check model, process noise and learning rate",
        )


def _standing(state: FilterState) -> Predicted:
    n = state.mean.shape[1]
    return Predicted(state, np.eye(n)[None], np.zeros((1, n, n)), state)


def _masks(used: npt.ArrayLike | None, shape: tuple[int, ...]) -> Booleans | None:
    if used is None:
        return None
    masks = np.asarray(used, dtype=bool)
    if masks.ndim > 3 or masks.shape != shape[: masks.ndim]:
        raise DataError(
            f"used has shape {masks.shape}", allowed=f"{shape[:1]}, {shape[:2]} or {shape}"
        )
    return np.broadcast_to(masks.reshape(*masks.shape, *(1,) * (3 - masks.ndim)), shape)


def _truth(truth: Array, k: int, b: int, n: int) -> Array:
    true = np.asarray(truth, dtype=np.float64)
    true = true[:, None, :] if true.ndim == 2 else true
    if true.ndim != 3 or true.shape[0] != k or true.shape[1] not in (1, b) or true.shape[2] > n:
        raise DataError(
            f"truth has shape {np.shape(truth)}", allowed=f"({k}, n0) or ({k}, {b}, n0), n0 <= {n}"
        )
    return np.broadcast_to(true, (k, b, true.shape[2]))
