"""Error measures at test point A and of a predicted covariance."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError

__all__ = ["Calibration", "ErrorSummary", "calibrate", "fractional_error", "summarize"]


def fractional_error(true: Array, predicted: Array) -> Array:
    """Return the length of the error over the length of the true acceleration, [Neamati2022] Eq. 3.

    Parameters
    ----------
    true : ndarray (n, 3)
        Finite, not zero.
    predicted : ndarray (n, 3)
        May contain values that are not finite; their error is infinite, never dropped.

    Returns
    -------
    ndarray (n,)

    Examples
    --------
    >>> fractional_error(np.array([[0.0, 0.0, 2.0]]), np.array([[0.0, 0.0, 1.0]]))
    array([0.5])
    """
    true = as_array(true, ("n", 3), "true acceleration")
    if np.shape(predicted) != true.shape:
        raise DataError(f"prediction has shape {np.shape(predicted)}", allowed=str(true.shape))
    size = np.linalg.norm(true, axis=1)
    if np.any(size == 0):
        raise DataError(
            f"true acceleration {int(np.argmin(size))} is zero", allowed="accelerations > 0"
        )
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows counts as infinite
        error: Array = np.linalg.norm(true - predicted, axis=1) / size
    return np.where(np.isfinite(error), error, np.inf)


@dataclass(frozen=True, slots=True)
class ErrorSummary:
    """Quantiles of a set of errors; every sample counts, also an infinite one.

    Parameters
    ----------
    count, failures : int
        Samples, and how many of them are not finite.
    median, quartile_1, quartile_3, percentile_95, worst, mean : float
        Of all samples; infinite where failures reach that quantile.
    """

    count: int
    failures: int
    median: float
    quartile_1: float
    quartile_3: float
    percentile_95: float
    worst: float
    mean: float

    def as_dict(self) -> dict[str, float]:
        """Return plain data."""
        return asdict(self)


def summarize(errors: Array) -> ErrorSummary:
    """Return the summary of errors (n,), n >= 1."""
    # "nearest" quantiles stay infinite or finite without the NaN of inf - inf interpolation;
    # the linear ones are used where all is finite.
    finite = bool(np.all(np.isfinite(errors)))
    q1, median, q3, p95 = np.quantile(
        errors, [0.25, 0.5, 0.75, 0.95], method="linear" if finite else "nearest"
    )
    return ErrorSummary(
        count=len(errors),
        failures=int(np.sum(~np.isfinite(errors))),
        median=float(median),
        quartile_1=float(q1),
        quartile_3=float(q3),
        percentile_95=float(p95),
        worst=float(np.max(errors)),
        mean=float(np.mean(errors)),
    )


@dataclass(frozen=True, slots=True)
class Calibration:
    """Does the predicted covariance hold what it says?

    Parameters
    ----------
    negative_log_likelihood : float
        Mean over samples of -ln N(a_true; mean, covariance), normalised units; lower is better.
    coverage_68, coverage_95 : float
        Share of single components whose error is below 1 sigma (expected 0.683) and below
        1.96 sigma (expected 0.950).
    median_sigma : float
        Median predicted standard deviation of a component, normalised units.
    """

    negative_log_likelihood: float
    coverage_68: float
    coverage_95: float
    median_sigma: float

    def as_dict(self) -> dict[str, float]:
        """Return plain data."""
        return asdict(self)


def calibrate(true: Array, predicted: Array, covariance: Array) -> Calibration:
    """Compare errors (n, 3) with predicted covariances (n, 3, 3).

    Raises
    ------
    DataError
        If a predicted variance is not positive, or a covariance not positive definite.
    """
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    if not np.all(variance > 0):
        raise DataError(
            f"predicted variance {float(np.min(variance)):.3g}", allowed="variances > 0"
        )
    error = true - predicted
    sigma = np.sqrt(variance)
    sign, logdet = np.linalg.slogdet(covariance)
    if not np.all(sign > 0):
        raise DataError(
            f"predicted covariance {int(np.argmin(sign))} is not positive definite",
            allowed="positive definite matrices",
        )
    weighted = np.linalg.solve(covariance, error[..., None])[..., 0]
    mahalanobis = np.sum(error * weighted, axis=1)
    nll = 0.5 * (mahalanobis + logdet + 3 * math.log(2 * math.pi))
    ratio = np.abs(error) / sigma
    return Calibration(
        negative_log_likelihood=float(np.mean(nll)),
        coverage_68=float(np.mean(ratio <= 1.0)),
        coverage_95=float(np.mean(ratio <= 1.959964)),
        median_sigma=float(np.median(sigma)),
    )
