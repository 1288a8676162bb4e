"""Square-root form of the extended filter: the covariance is never formed, only its root."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.algebra import (
    cholesky,
    lower_root,
    solve_lower,
    solve_upper,
    times,
    triangular_root,
)
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.state import FilterState, Predicted, Updated
from unmodeled.pipeline.filters.update import accept, mask_rows

__all__ = ["SquareRootFilter"]


@dataclass(frozen=True)
class SquareRootFilter(ExtendedKalmanFilter):
    """Extended Kalman filter by orthogonal transformations [Bierman1977], [Kailath2000].

    The root S, P = S S^T, is lower triangular and kept in the state's memory as ``root``;
    prediction and update are one QR decomposition each. P itself is formed for the record only:
    twice the digits of the other form for twice its time.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.iterations != 1:
            raise ConfigError(
                f"iterations is {self.iterations} in square-root form",
                allowed="1",
                do="use ExtendedKalmanFilter for the iterated update",
            )

    def start(self, state: FilterState) -> FilterState:
        """Check the size of a start and factorise its covariance."""
        state = super().start(state)
        return replace(state, memory={**state.memory, "root": lower_root(state.covariance)})

    def predict(self, state: FilterState, dt: float) -> Predicted:
        """Carry a state over ``dt`` > 0 seconds."""
        mean, F, Q, more = self._step(state, dt)
        rows = _beside(F @ state.memory["root"], lower_root(Q))
        root = triangular_root(rows)
        memory = {**state.memory, **more, "root": root}
        after = FilterState(mean, root @ root.mT, state.time + dt, memory)
        return Predicted(after, F, Q, state)

    def update(self, predicted: Predicted, z: Array, used: npt.ArrayLike | None = None) -> Updated:
        """Use the measurements of one epoch; see `ExtendedKalmanFilter.update`."""
        state = predicted.state
        mask = self._mask(z, used)
        expected, H = self.measurement.h(state.mean, state.time)
        masked, R, innovation = mask_rows(
            H, self.measurement.R, self._difference(z, expected), mask
        )
        root, m = state.memory["root"], z.shape[1]
        # [R^1/2, H S; 0, S] -> [S_zz, 0; K_bar, S+]
        top = _beside(cholesky(R, "the measurement noise"), masked @ root)
        zero = np.zeros((*top.shape[:-2], root.shape[-1], m))
        whole = triangular_root(np.concatenate([top, _beside(zero, root)], axis=-2))
        L, K_bar, after = whole[..., :m, :m], whole[..., m:, :m], whole[..., m:, m:]
        half = solve_lower(L, innovation[..., None])[..., 0]
        nis = (half**2).sum(axis=-1)
        freedom, accepted = accept(nis, mask, innovation.shape, self.gate)
        K = solve_upper(L.mT, K_bar.mT).mT  # K_bar L^-1
        if not accepted.all():
            chosen = accepted[:, None, None] if accepted.any() or len(K) > 1 else np.array(False)
            K_bar, K = np.where(chosen, K_bar, 0.0), np.where(chosen, K, 0.0)
            after = np.where(chosen, after, root)
        mean = state.mean + times(K_bar, half)
        memory = {**state.memory, "root": after}
        new = FilterState(mean, after @ after.mT, state.time, memory)
        S = L @ L.mT
        updated = Updated(new, innovation, S, nis, freedom, accepted, K, H, mask)
        return self._learned(predicted, updated)


def _beside(left: Array, right: Array) -> Array:
    """Return matrices side by side, a single one repeated for all runs."""
    shape = np.broadcast_shapes(left.shape[:-2], right.shape[:-2])
    return np.concatenate(
        [np.broadcast_to(a, (*shape, *a.shape[-2:])) for a in (left, right)], axis=-1
    )
