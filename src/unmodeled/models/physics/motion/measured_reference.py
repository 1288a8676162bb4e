"""The target's orbit from its measured positions, as a filter on board has it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.models.physics.motion.reference_orbit import (
    Oblate,
    ReferenceOrbit,
    reference_rates,
    reference_variables,
)

__all__ = ["MeasuredReference"]

#: Weights of a position and of those before it in a velocity, by order of the difference.
_BACKWARD = {1: (1.0, -1.0), 2: (1.5, -2.0, 0.5)}


@dataclass(frozen=True)
class MeasuredReference:
    """The five variables of `ReferenceOrbit` as known at each epoch from what was measured by then.

    Between epochs the last values are carried on by one Runge-Kutta step of their own equations
    ([Marchese2023] Eq. 3.35), so nothing is taken from the future.

    Parameters
    ----------
    times : ndarray (n,)
        s, increasing.
    values : ndarray (n, 5)
        As `reference_variables` gives them.
    body : Oblate
    """

    times: Array
    values: Array
    body: Oblate

    def __post_init__(self) -> None:
        t = as_array(self.times, ("n",), "times")
        check_increasing(t, "times")
        as_array(self.values, (len(t), 5), "reference variables")

    @classmethod
    def from_positions(
        cls,
        times: npt.ArrayLike,
        positions: npt.ArrayLike,
        body: Oblate,
        measured: npt.ArrayLike | None = None,
        order: int = 2,
    ) -> MeasuredReference:
        """Estimate the variables by backward differences of positions, Eq. 3.38 and 3.108.

        Parameters
        ----------
        times : array_like (n,)
            s, at equal distances.
        positions : array_like (n, 3)
            Inertial positions of the target as measured, m; NaN where nothing is measured.
        body : Oblate
        measured : array_like (n,) of bool, optional
            False where nothing is measured: the last values are integrated through. The first
            ``order`` + 1 epochs must be measured.
        order : {1, 2}
            Of the difference. 1 is printed: that velocity is half a step old, which at 30 s makes
            the radial rate wrong by 120 m/s. 2 leaves 2 m/s.

        Notes
        -----
        The last variable is the argument of latitude, not the true anomaly of Eq. 3.108. At the
        first ``order`` epochs the first estimate is carried back.

        Raises
        ------
        ConfigError, DataError
        """
        t = as_array(times, ("n",), "times")
        check_increasing(t, "times")
        if order not in _BACKWARD:
            raise ConfigError(f"order {order} of the difference", allowed="1 or 2")
        known = np.ones(len(t), dtype=bool) if measured is None else np.asarray(measured, bool)
        if known.shape != t.shape or len(t) <= order or not known[: order + 1].all():
            raise DataError(
                f"{int(known[: order + 1].sum())} of the first {order + 1} positions measured",
                allowed=f"all of the first {order + 1}",
                do="start the gap later",
            )
        r = np.array(positions, dtype=np.float64)
        if r.shape != (len(t), 3):
            raise DataError(f"positions has shape {r.shape}", allowed=f"({len(t)}, 3)")
        r[known] = as_array(r[known], ("n", 3), "measured positions")
        step = float(t[1] - t[0])
        if not np.allclose(np.diff(t), step, rtol=1e-9):
            raise DataError("positions at unequal distances in time", allowed="one step")
        weights = _BACKWARD[order]
        velocity = sum(w * np.roll(r, lag, axis=0) for lag, w in enumerate(weights)) / step
        fresh = known & np.all([np.roll(known, lag) for lag in range(1, order + 1)], axis=0)
        fresh[:order] = False
        values = np.empty((len(t), 5))
        at = np.flatnonzero(fresh)
        values[at] = reference_variables(np.hstack([r, velocity])[at])
        for k in range(order - 1, -1, -1):
            values[k] = _step(values[k + 1], -step, body)
        for stale in np.flatnonzero(~fresh[order:]):
            values[stale + order] = _step(values[stale + order - 1], step, body)
        values[:, 4] = np.unwrap(values[:, 4])
        return cls(t, values, body)

    def at(self, t: float | Array) -> Array:
        """Return the variables (5,) at one time, s, or (k, 5) at times (k,).

        Raises
        ------
        DataError
            Before the first epoch.
        """
        low = t if isinstance(t, float) else np.min(t)
        if low < self.times[0]:
            raise DataError(f"time {low:g} s", allowed=f"from {self.times[0]:g} s")
        k = np.searchsorted(self.times, t, side="right") - 1
        return _step(self.values[k].T, t - self.times[k], self.body).T

    def error(self, truth: ReferenceOrbit) -> Array:
        """Return the difference (n, 5) from a known orbit at the epochs."""
        return self.values - np.stack([truth.at(float(t)) for t in self.times])


def _step(c: Array, dt: float | Array, body: Oblate) -> Array:
    """One Runge-Kutta step of the variables (5, ...); at 30 s good to 1e-6 m."""
    if np.ndim(dt) == 0 and dt == 0.0:
        return c
    a = reference_rates(c, body)
    b = reference_rates(c + 0.5 * dt * a, body)
    d = reference_rates(c + 0.5 * dt * b, body)
    e = reference_rates(c + dt * d, body)
    stepped: Array = c + dt / 6.0 * (a + 2.0 * b + 2.0 * d + e)
    return stepped
