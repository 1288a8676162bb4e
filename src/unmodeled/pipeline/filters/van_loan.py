"""Transition and process noise of a linear stochastic differential equation, exactly."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from unmodeled.core.arrays import Array

__all__ = ["van_loan"]

#: Largest norm of A dt for one exponential; longer steps are doubled up from a shorter one.
_LARGEST = 2.0


def van_loan(A: Array, L: Array, dt: float) -> tuple[Array, Array]:
    r"""Return F = exp(A dt) and Q = int_0^dt exp(A s) L exp(A^T s) ds.

    One exponential of [[-A, L], [0, A^T]] gives both [VanLoan1978]. It is taken over a step so
    short that exp(-A s) and exp(A s) are of like size, and doubled up: over many time constants
    their product would cancel.

    Parameters
    ----------
    A : ndarray (n, n)
        Of dx/dt = A x + noise, 1/s.
    L : ndarray (n, n)
        Spectral density of the noise, units of x^2 / s, symmetric.
    dt : float
        Seconds, >= 0.

    Returns
    -------
    F, Q : ndarray (n, n)
        Entries of very different size keep the digits of the largest; scale the states first
        where that matters (`GaussMarkov` does).
    """
    n = len(A)
    norm = float(np.linalg.norm(A, 1)) * dt
    doublings = max(0, int(np.ceil(np.log2(norm / _LARGEST)))) if norm > _LARGEST else 0
    h = dt / 2**doublings
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A * h, L * h, A.T * h
    whole = np.asarray(expm(block))
    F = whole[n:, n:].T
    Q = F @ whole[:n, n:]
    for _ in range(doublings):
        Q = Q + F @ Q @ F.T
        F = F @ F
    return F, 0.5 * (Q + Q.T)
