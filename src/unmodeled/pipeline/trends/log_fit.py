"""A straight line through errors in the logarithmic representation, as in [Neamati2022] Fig. 11."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError

__all__ = ["LogFit", "log_fit"]


@dataclass(frozen=True, slots=True)
class LogFit:
    """log10 y = slope log10 x + intercept.

    Parameters
    ----------
    slope, intercept : float
        Least squares; the intercept is where x = 1.
    slope_sigma : float
        Standard error of the slope.
    r_squared : float
        Coefficient of determination.
    count, left_out : int
        Pairs used, and pairs with a zero or an infinite value, which have no place on the axes.
    """

    slope: float
    intercept: float
    slope_sigma: float
    r_squared: float
    count: int
    left_out: int


def log_fit(x: Array, y: Array) -> LogFit:
    """Fit a line to the logarithms of two columns of positive numbers.

    Parameters
    ----------
    x, y : ndarray (n,)
        Errors, dimensionless.

    Raises
    ------
    DataError
        Fewer than three usable pairs, or all x the same.

    Examples
    --------
    >>> fit = log_fit(np.array([1e-3, 1e-2, 1e-1]), np.array([1e-4, 1e-2, 1e0]))
    >>> round(fit.slope, 6), round(fit.intercept, 6), round(fit.r_squared, 6)
    (2.0, 2.0, 1.0)
    """
    keep = np.isfinite(x) & np.isfinite(y) & (x > 0) & (y > 0)
    a, b = np.log10(x[keep]), np.log10(y[keep])
    if len(a) < 3 or np.ptp(a) == 0:
        raise DataError(f"a line through {len(a)} errors", allowed="3 or more that differ")
    found = scipy.stats.linregress(a, b)
    return LogFit(
        slope=float(found.slope),
        intercept=float(found.intercept),
        slope_sigma=float(found.stderr),
        r_squared=float(found.rvalue**2),
        count=len(a),
        left_out=int(np.sum(~keep)),
    )
