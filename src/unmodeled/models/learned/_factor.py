"""Cholesky factors of kernel matrices, with the jitter that they needed."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, cholesky
from scipy.linalg.lapack import dpocon

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError

__all__ = ["JITTERS", "condition_number", "factorise"]

#: Shares of the mean diagonal added to a kernel matrix that Cholesky refuses, in turn.
JITTERS = (0.0, *(10.0**e for e in range(-10, -3)))


def factorise(learner: str, kernel: Array) -> tuple[Array, float]:
    """Return the lower factor and the share of the mean diagonal that had to be added.

    Raises
    ------
    NumericalError
        If the largest jitter does not help.
    """
    size = float(np.trace(kernel)) / len(kernel)
    for jitter in JITTERS:
        try:
            shifted = kernel + jitter * size * np.eye(len(kernel)) if jitter else kernel
            return cholesky(shifted, lower=True), jitter
        except (LinAlgError, ValueError):  # ValueError: not finite
            continue
    raise NumericalError(
        f"{learner}: a kernel matrix of {len(kernel)} samples is not positive definite even with "
        f"{JITTERS[-1]:.0e} of its diagonal added",
        do="raise noise_floor or remove repeated positions",
    )


def condition_number(factor: Array, norm: float) -> float:
    """Return LAPACK's estimate from the lower factor and the matrix's 1-norm, n^2 operations."""
    return 1.0 / max(float(dpocon(factor, norm, uplo="L")[0]), 1e-300)
