"""Marginal likelihood of a set of columns with a ridge prior, beside the known columns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array

__all__ = ["Compressed", "Ridge", "compress", "ridge"]

#: Quarter decades of the prior's size, from the size at which the best-seen direction shows just.
_SIZES = 10.0 ** (0.25 * np.arange(25))


@dataclass(frozen=True)
class Compressed:
    """Columns B = Q T and residuals, as far as a fit of B to them needs them.

    Parameters
    ----------
    triangle : ndarray (q, p)
        T.
    seen : ndarray (q,)
        Q' r.
    square : float
        r' r.
    """

    triangle: Array
    seen: Array
    square: float


@dataclass(frozen=True)
class Ridge:
    """Evidence for columns whose coefficients are normal with one common size.

    Parameters
    ----------
    sizes : ndarray (g,)
        Prior standard deviations tried, of the coefficients in units of the given square root.
    logs : ndarray (g,)
        ln of the Bayes factor of each against nothing.
    log_bayes : float
        The same with the size unknown: the mean of all.
    size : float
        The most likely one, 0 if nothing is as likely.
    variance : float
        Of the noise, in stated variances, at that size.
    values : ndarray (q,)
        Singular values of the columns.
    right : ndarray (q, p)
        Right singular vectors.
    seen : ndarray (q,)
        Residuals along the left singular vectors.
    """

    sizes: Array
    logs: Array
    log_bayes: float
    size: float
    variance: float
    values: Array = field(repr=False)
    right: Array = field(repr=False)
    seen: Array = field(repr=False)

    def mean(self) -> Array:
        """Posterior mean of the coefficients (p,) at the most likely size."""
        s2 = self.size**2
        mean: Array = self.right.T @ (s2 * self.values * self.seen / (1.0 + s2 * self.values**2))
        return mean

    def shrinkage(self) -> Array:
        """Part of the prior variance (q,) along `right` that the data leave."""
        left: Array = 1.0 / (1.0 + (self.size * self.values) ** 2)
        return left

    def posterior_root(self) -> Array:
        """Coefficients (p, q) whose columns are orthogonal in the data, scaled by the posterior."""
        if not self.size:
            return np.zeros((self.right.shape[1], 0))
        root: Array = self.right.T * self.size * np.sqrt(self.shrinkage())
        return root


def compress(columns: Array, residual: Array) -> Compressed:
    """Turn columns (n, p) and residuals (n,), known columns projected out of both."""
    basis, triangle = scipy.linalg.qr(columns, mode="economic")
    return Compressed(
        np.asarray(triangle, dtype=np.float64), basis.T @ residual, float(residual @ residual)
    )


def ridge(data: Compressed, freedom: int, root: Array | None = None) -> Ridge:
    r"""Return the evidence for columns B with coefficients N(0, sigma^2 s^2 L L').

    Parameters
    ----------
    data : Compressed
        B and the residuals r.
    freedom : int
        Rows minus known columns, N below.
    root : ndarray (p, p), optional
        L; the unit matrix if not given. What is returned concerns the coefficients of B L.

    Notes
    -----
    The noise variance sigma^2 is unknown, so that noise which was stated wrongly is not taken for
    an effect. With nothing in the model it is r'r / N, and

    .. math::
        \ln K = -\tfrac{N}{2} \ln \frac{r'(I + s^2 B L L' B')^{-1} r}{r'r}
                - \tfrac12 \ln\det(I + s^2 B L L' B')

    ([Rasmussen2006] Eq. 2.30 with the variance at its most likely value).
    """
    triangle = data.triangle if root is None else data.triangle @ root
    square, nothing = data.square, np.zeros(0)
    if not triangle.size or not np.any(triangle):
        right = np.zeros((0, triangle.shape[1]))
        return Ridge(nothing, nothing, 0.0, 0.0, square / freedom, nothing, right, nothing)
    left, d, right = scipy.linalg.svd(triangle, full_matrices=False)
    kept = d > 1e-10 * d[0]
    left, d, right = left[:, kept], d[kept], right[kept]
    u = left.T @ data.seen
    sizes = _SIZES / d[0]
    gain = (sizes[:, None] * d) ** 2
    rest = np.maximum(square - np.sum(gain / (1.0 + gain) * u**2, axis=1), 1e-12 * square)
    logs = -0.5 * freedom * np.log(rest / square) - 0.5 * np.sum(np.log1p(gain), axis=1)
    best = int(np.argmax(logs))
    some = logs[best] > 0
    return Ridge(
        sizes,
        logs,
        float(np.logaddexp.reduce(logs) - np.log(len(logs))),
        float(sizes[best]) if some else 0.0,
        float(rest[best] if some else square) / freedom,
        d,
        right,
        u,
    )
