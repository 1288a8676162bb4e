"""What initial states and free parameters can absorb, as an orthonormal basis of the rows."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["known_basis"]


def known_basis(lin: Linearisation) -> Array:
    """Return an orthonormal basis (n, k) of all that `Linearisation.project` removes.

    Random columns minus their projection span it; the seed is constant, and the span does not
    depend on it.

    Parameters
    ----------
    lin : Linearisation
        With a arcs and p free parameters: k is at most 6 a + p.
    """
    most = len(lin.residuals) - lin.freedom
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(len(lin.residuals), most))
    basis, r, _ = scipy.linalg.qr(columns - lin.project(columns), mode="economic", pivoting=True)
    size = np.abs(np.diag(r))
    return np.asarray(basis[:, size > 1e-9 * size[0]], dtype=np.float64)
