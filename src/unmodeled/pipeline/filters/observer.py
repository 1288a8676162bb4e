"""Full-state observer: a fixed gain, chosen by the user, in place of the Kalman gain."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.filters.algebra import joseph, times
from unmodeled.pipeline.filters.extended import ExtendedKalmanFilter
from unmodeled.pipeline.filters.state import Predicted, Updated

__all__ = ["FullStateObserver"]


@dataclass(frozen=True)
class FullStateObserver(ExtendedKalmanFilter):
    """dx/dt = f(x) + K (z - H x) with a constant K: [Pesce2020] Eq. 33, [Harl2013].

    The correction of a step is K dt times the innovation. The covariance is that of this gain
    (Joseph form holds for any gain), so NEES and NIS can be read as for a filter; it needs the
    process noise, the gain does not.

    Parameters
    ----------
    rate : ndarray (n, m)
        K, 1/s for the measured states; K dt well below 1, or the correction overshoots.
    """

    rate: Array | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rate is None:
            raise ConfigError(
                "the observer has no gain", allowed="rate (n, m)", do="give rate, 1/s"
            )
        shape = (self.model.size, len(self.measurement.R))
        object.__setattr__(self, "rate", as_array(self.rate, shape, "rate"))

    def update(self, predicted: Predicted, z: Array, used: npt.ArrayLike | None = None) -> Updated:
        """Use the measurements of one epoch; see `ExtendedKalmanFilter.update`."""
        kalman = super().update(predicted, z, used)
        dt = predicted.state.time - predicted.previous.time
        assert self.rate is not None
        rows = kalman.used & kalman.accepted[:, None]
        K = np.where(rows[:, None, :], self.rate * dt, 0.0)
        state = predicted.state
        after = replace(
            kalman.state,
            mean=state.mean + times(K, kalman.innovation),
            covariance=joseph(state.covariance, K, kalman.design, self.measurement.R),
        )
        return replace(kalman, state=after, gain=K)
