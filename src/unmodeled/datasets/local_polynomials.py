"""Local polynomials in time, fitted to positions, or positions and velocities, at each sample."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import legendre

from unmodeled.core.arrays import Array

__all__ = ["LocalFit"]

# Samples worked on together: bounds the memory at some tens of MB.
_CHUNK = 2048


class LocalFit:
    """Polynomials of one degree on windows of one width, differentiated at every sample.

    Parameters
    ----------
    t : ndarray (n,)
        Seconds, increasing, without a gap.
    data : list of ndarray (n, 3)
        Positions (m), or positions and velocities (m/s).
    noise : list of float
        Standard deviation of one component of each.
    degree, width : int
        Degree of the polynomial; samples in a window, at most n.

    Attributes
    ----------
    first, second : ndarray (n, 3)
        Velocity and acceleration at the samples.
    first_sigma, second_sigma : ndarray (n,)
        Their formal standard errors, one component.
    residual_scale : ndarray (n,)
        Root mean square of the residuals in units of the noise: 1 where both agree.
    """

    def __init__(
        self, t: Array, data: list[Array], noise: list[float], degree: int, width: int
    ) -> None:
        self.degree, self.width = degree, width
        n = len(t)
        start = np.clip(np.arange(n) - width // 2, 0, n - width)
        index = start[:, None] + np.arange(width)
        half = (t[index[:, -1]] - t[index[:, 0]]) / 2
        middle = (t[index[:, -1]] + t[index[:, 0]]) / 2
        # Windows with the same pattern of times share one factorisation: for even sampling that
        # is all but the ends.
        nodes = (t[index] - middle[:, None]) / half[:, None]
        at = (t - middle) / half
        key = np.round(np.column_stack([nodes, at, half / half.mean()]), 9)
        _, first, which = np.unique(key, axis=0, return_index=True, return_inverse=True)
        which = which.reshape(-1)
        self.first = np.empty((n, 3))
        self.second = np.empty((n, 3))
        self.first_sigma = np.empty(n)
        self.second_sigma = np.empty(n)
        square = np.empty(n)
        freedom = len(data) * width - degree - 1
        by_pattern = np.argsort(which, kind="stable")
        for begin in range(0, n, _CHUNK):
            mine = by_pattern[begin : begin + _CHUNK]
            patterns, group = np.unique(which[mine], return_inverse=True)
            some = first[patterns]
            weights, q = _factor(nodes[some], at[some], half[some], noise, degree)
            # The value at the sample is taken out first: 1e7 m would cost digits.
            rows = [d[index[mine]] for d in data]
            rows[0] = rows[0] - data[0][mine][:, None, :]
            y = np.concatenate([r / s for r, s in zip(rows, noise, strict=True)], axis=1)
            if len(patterns) == 1:
                group = np.zeros(1, dtype=np.intp)  # one factorisation serves all by broadcasting
            derivatives = weights[group] @ y
            self.first[mine], self.second[mine] = derivatives[:, 0], derivatives[:, 1]
            spread = np.sqrt(np.sum(weights**2, axis=2))
            self.first_sigma[mine], self.second_sigma[mine] = spread[group].T
            # Residuals one by one: a difference of two sums of squares would be all rounding.
            left = y - q[group] @ (np.swapaxes(q[group], 1, 2) @ y)
            square[mine] = np.sum(left**2, axis=(1, 2))
        self.residual_scale = np.sqrt(square / (3 * max(freedom, 1)))


def _factor(
    nodes: Array, at: Array, half: Array, noise: list[float], degree: int
) -> tuple[Array, Array]:
    """Weights (g, 2, rows) of the first two derivatives, and the orthonormal basis (g, rows, p)."""
    basis: Any = np.eye(degree + 1)
    first, second = legendre.legder(basis, axis=0), legendre.legder(basis, 2, axis=0)

    def values(x: Array, coefficients: Any) -> Array:
        found: Any = legendre.legval(x, coefficients)
        return np.moveaxis(found, 0, -1)

    blocks = [values(nodes, basis) / noise[0]]
    if len(noise) == 2:
        blocks.append(values(nodes, first) / half[:, None, None] / noise[1])
    q, r = np.linalg.qr(np.concatenate(blocks, axis=1))
    wanted = np.stack(
        [values(at, first) / half[:, None], values(at, second) / half[:, None] ** 2], axis=1
    )
    # weights = wanted R^-1 Q^T
    solved = np.swapaxes(np.linalg.solve(np.swapaxes(r, 1, 2), np.swapaxes(wanted, 1, 2)), 1, 2)
    return solved @ np.swapaxes(q, 1, 2), q
