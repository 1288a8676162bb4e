"""Logarithmic axes that hold every value: also zero, infinity and what lies far outside."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from unmodeled.core.arrays import Array
from unmodeled.reports.numbers import power_of_ten

__all__ = ["LogRange", "decades"]

_MOST_TICKS = 9


@dataclass(frozen=True, slots=True)
class LogRange:
    """Limits of a logarithmic axis, whole powers of ten.

    Values above are drawn on the upper edge, values below (zero too) on the lower edge, so that
    nothing is left out of a figure without a trace.

    Parameters
    ----------
    low, high : float
        Exponents of ten.
    """

    low: int
    high: int

    @classmethod
    def around(
        cls, values: Iterable[npt.ArrayLike], floor: float = 1e-17, ceiling: float = 1e4
    ) -> LogRange:
        """Return the range that holds the finite positive values within floor and ceiling."""
        flat = np.concatenate([np.ravel(np.asarray(v, dtype=np.float64)) for v in values])
        kept = flat[np.isfinite(flat) & (flat > 0)]
        if not len(kept):
            return cls(-3, 1)
        low = math.floor(math.log10(max(float(kept.min()), floor)) + 1e-9)
        high = math.ceil(math.log10(min(max(float(kept.max()), 10.0**low), ceiling)) - 1e-9)
        # A decade of room for what is drawn on the edge; NaN is neither.
        edge_high = bool(np.any(flat > 10.0**high))
        edge_low = bool(np.any(flat < 10.0**low))
        return cls(low - edge_low, max(high + edge_high, low + 1))

    def clip(self, values: npt.ArrayLike) -> Array:
        """Return values moved onto the edges of the axis; NaN stays."""
        return np.clip(np.asarray(values, dtype=np.float64), 10.0**self.low, 10.0**self.high)

    def above(self, values: npt.ArrayLike) -> int:
        """Return how many values lie above the axis."""
        return int(np.sum(np.asarray(values) > 10.0**self.high))

    def below(self, values: npt.ArrayLike) -> int:
        """Return how many values lie below the axis."""
        return int(np.sum(np.asarray(values) < 10.0**self.low))

    @property
    def limits(self) -> tuple[float, float]:
        """Limits with a little air, for ``set_xlim`` and ``set_ylim``."""
        air = 0.02 * (self.high - self.low)
        return 10.0 ** (self.low - air), 10.0 ** (self.high + air)


def decades(axis: Axis, limits: LogRange) -> None:
    """Put ticks on whole decades, as ``10⁻³``; the axis must be logarithmic already."""
    step = max(1, math.ceil((limits.high - limits.low) / (_MOST_TICKS - 1)))
    exponents = [k for k in range(limits.low, limits.high + 1) if k % step == 0]
    axis.set_major_locator(FixedLocator([10.0**k for k in exponents]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(round(math.log10(value)))))
    axis.set_minor_locator(NullLocator())
