"""The linear algebra of all filters: no inverse, no covariance that is not symmetric.

Matrices are stacked along leading axes and small (n up to a few tens); loops run over rows, numpy
over the stack.
"""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError

__all__ = [
    "cholesky",
    "cholesky_solve",
    "inverse_root",
    "joseph",
    "lower_root",
    "sandwich",
    "solve_lower",
    "solve_upper",
    "symmetrise",
    "times",
    "triangular_root",
]


#: Up to this row, sums of products are faster than a matrix product.
_FEW = 3


def symmetrise(P: Array) -> Array:
    """Return (P + P^T) / 2 of matrices (..., n, n)."""
    half: Array = P + P.mT
    half *= 0.5
    return half


def sandwich(A: Array, P: Array) -> Array:
    """Return A P A^T of matrices (..., m, n) and (..., n, n)."""
    # numpy multiplies contiguous stacks twice as fast as transposed views
    whole: Array = (A @ P) @ np.ascontiguousarray(A.mT)
    return whole


def times(A: Array, x: Array) -> Array:
    """Return the products (b, m) of matrices (b or 1, m, n) and vectors (b, n)."""
    product: Array = np.matmul(A, x[..., None])[..., 0]
    return product


def cholesky(S: Array, what: str) -> Array:
    """Return lower Cholesky factors of positive definite matrices (..., n, n).

    Raises
    ------
    NumericalError
        Naming ``what`` and the first matrix of the stack that is not positive definite.
    """
    try:
        factor = np.linalg.cholesky(S)
    except np.linalg.LinAlgError as exc:
        flat = S.reshape(-1, *S.shape[-2:])
        if not np.isfinite(flat).all():
            run = int(np.argmin(np.isfinite(flat).all(axis=(1, 2))))
            raise NumericalError(
                f"{what} of run {run} is not finite", do="the filter diverged: check its model"
            ) from exc
        least = np.linalg.eigvalsh(symmetrise(flat))[:, 0]
        run = int(np.argmin(least))
        raise NumericalError(
            f"{what} of run {run} is not positive definite (least eigenvalue {least[run]:.3g})",
            do="use the Joseph or square-root form, and check the units of P, Q and R",
        ) from exc
    return np.asarray(factor)


def solve_lower(L: Array, B: Array) -> Array:
    """Return L^-1 B for lower triangular ``L`` (..., n, n) and ``B`` (..., n, k)."""
    shape = np.broadcast_shapes(L.shape[:-2], B.shape[:-2])
    X = np.array(np.broadcast_to(B, (*shape, *B.shape[-2:])))
    for i in range(L.shape[-1]):
        row = X[..., i, :]
        for j in range(i) if i < _FEW else ():
            row -= L[..., i, j, None] * X[..., j, :]
        if i >= _FEW:
            row -= np.matmul(L[..., None, i, :i], X[..., :i, :])[..., 0, :]
        row /= L[..., i, i, None]
    return X


def solve_upper(U: Array, B: Array) -> Array:
    """Return U^-1 B for upper triangular ``U`` (..., n, n) and ``B`` (..., n, k)."""
    return solve_lower(U[..., ::-1, ::-1], B[..., ::-1, :])[..., ::-1, :]


def cholesky_solve(L: Array, B: Array) -> Array:
    """Return (L L^T)^-1 B for lower triangular ``L`` (..., n, n) and ``B`` (..., n, k)."""
    return solve_upper(L.mT, solve_lower(L, B))


def inverse_root(S: Array, what: str) -> Array:
    """Return L^-1, lower triangular, of positive definite S = L L^T (..., m, m).

    Up to three rows in closed form over the stack: for a hundred runs a quarter of the time of a
    factorisation and a substitution.

    Raises
    ------
    NumericalError
        As `cholesky`.
    """
    if S.shape[-1] <= _FEW:
        with np.errstate(invalid="ignore", divide="ignore"):
            root = _inverse_of_few(S)
        if np.isfinite(root).all():
            return root
    return solve_lower(cholesky(S, what), np.eye(S.shape[-1])[None])


def _inverse_of_few(S: Array) -> Array:
    """Inverse root of up to three rows; not finite where S is not positive definite."""
    rows = S.shape[-1]
    M = np.zeros(S.shape)
    first = 1.0 / np.sqrt(S[..., 0, 0])
    M[..., 0, 0] = first
    if rows > 1:
        a = S[..., 1, 0] * first  # entries of L below its diagonal: a, b; c
        second = 1.0 / np.sqrt(S[..., 1, 1] - a * a)
        M[..., 1, 1] = second
        M[..., 1, 0] = -a * first * second
    if rows > 2:
        b = S[..., 2, 0] * first
        c = (S[..., 2, 1] - b * a) * second
        third = 1.0 / np.sqrt(S[..., 2, 2] - b * b - c * c)
        M[..., 2, 2] = third
        M[..., 2, 1] = -c * second * third
        M[..., 2, 0] = (c * a * second - b) * first * third
    return M


def joseph(P: Array, K: Array, H: Array, R: Array) -> Array:
    """Return (I - K H) P (I - K H)^T + K R K^T, symmetric and never negative.

    Parameters
    ----------
    P : ndarray (..., n, n)
        Covariance before the measurement.
    K : ndarray (..., n, m)
        Any gain, not only the optimal one.
    H : ndarray (..., m, n)
    R : ndarray (..., m, m)
    """
    left = K @ H
    np.negative(left, out=left)
    diagonal = np.einsum("...ii->...i", left)  # a view
    diagonal += 1.0
    whole = sandwich(left, P)
    whole += sandwich(K, R)
    return symmetrise(whole)


def triangular_root(rows: Array) -> Array:
    """Return the lower triangular S with S S^T = A A^T, by QR of A^T: no product is formed.

    Parameters
    ----------
    rows : ndarray (..., n, k)
        A, k >= n.

    Returns
    -------
    ndarray (..., n, n)
        Diagonal >= 0.
    """
    upper: Array = np.asarray(np.linalg.qr(rows.mT, mode="r"), dtype=np.float64)
    signs = np.where(np.diagonal(upper, axis1=-2, axis2=-1) < 0.0, -1.0, 1.0)
    root: Array = (upper * signs[..., :, None]).mT
    return root


def lower_root(P: Array) -> Array:
    """Return a lower triangular root of matrices (..., n, n) that may be singular.

    Rows are first scaled to a unit diagonal, so that states of very different size keep their
    digits. What rounding left below zero is zero.
    """
    size = np.sqrt(np.maximum(np.diagonal(P, axis1=-2, axis2=-1), 0.0))
    scale = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(symmetrise(P / scale[..., :, None] / scale[..., None, :]))
    root = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return triangular_root(scale[..., :, None] * root)
