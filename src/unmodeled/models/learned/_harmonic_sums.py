"""The data of a harmonic fit, added up chunk by chunk to one triangle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.physics.exterior_harmonics import derivative, exterior_harmonics

__all__ = ["Sums", "equations"]


def equations(
    places: Array, y: Array, degree: int, gm: float, radius: float, root: Array | None
) -> tuple[Array, float]:
    """Return the equations (p + 1, 3n) of some samples and the sum of the logs of their weights.

    Parameters
    ----------
    places, y : ndarray (n, 3)
        Positions and accelerations.
    degree : int
        Highest degree; p = (degree + 1)^2.
    gm, radius : float
        Reference values.
    root : ndarray (n, 3, 3), optional
        Lower Cholesky factors of the noise of each sample.

    Returns
    -------
    ndarray (p + 1, 3n)
        Columns of the weighted design and, last, the weighted accelerations.
    float
        Zero without ``root``.
    """
    table = exterior_harmonics(places / radius, degree + 1)
    scale = gm / radius**2
    rows = np.empty((3, (degree + 1) ** 2 + 1, len(y)))
    for i in range(3):
        np.multiply(derivative(table, i), scale, out=rows[i, :-1])
        rows[i, -1] = y[:, i]
    log_weight = 0.0
    if root is not None:
        weights = np.linalg.inv(root)
        log_weight = float(np.log(np.diagonal(weights, axis1=1, axis2=2)).sum())
        rows = np.einsum("nij,jpn->ipn", weights, rows)
    return np.concatenate(list(rows), axis=1), log_weight


@dataclass(frozen=True)
class Sums:
    """All that the fit needs of the data: the triangular root of the normal equations.

    Parameters
    ----------
    triangle : ndarray (k, p)
        R of the QR decomposition of the weighted design; k = p, or fewer for few data.
    target : ndarray (k,)
        Q^T y.
    rest : float
        Sum of squares of y that no coefficient reaches.
    count : int
        Number of equations.
    scale : float
        Root mean square of the weighted data.
    log_weight : float
        Sum of the logarithms of the weights, for the evidence of the data as given.
    """

    triangle: Array
    target: Array
    rest: float
    count: int
    scale: float
    log_weight: float

    @classmethod
    def of(cls, chunks: Iterator[tuple[Array, float]]) -> Sums:
        """Add up chunks of weighted equations one after another.

        The Gram matrix itself would square the condition number: half of the digits of clean
        data would be lost. Its triangular root takes the same memory, (p + 1)^2 numbers.

        Parameters
        ----------
        chunks : iterator of (ndarray (p + 1, m), float)
            From `equations`.
        """
        root, count, log_weight = None, 0, 0.0
        for rows, log_own in chunks:
            count += rows.shape[1]
            log_weight += log_own
            # transposed, it lies in memory as LAPACK wants it
            stacked = rows.T if root is None else np.concatenate([root.T, rows], axis=1).T
            root = scipy.linalg.qr(stacked, mode="r", overwrite_a=True, check_finite=False)[0]
            root = np.triu(root[: root.shape[1]])
        if root is None or not np.isfinite(root).all():
            raise NumericalError("the equations of the samples are not finite")
        unknowns = root.shape[1] - 1
        return cls(
            np.array(root[:unknowns, :unknowns], dtype=np.float64),
            np.array(root[:unknowns, unknowns], dtype=np.float64),
            float((root[unknowns:, unknowns] ** 2).sum()),
            count,
            math.sqrt(float((root[:, unknowns] ** 2).sum()) / count),
            log_weight,
        )
