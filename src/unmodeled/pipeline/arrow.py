"""Normal equations in the shape of an arrow: a block for each arc, and shared parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError

__all__ = ["Arrow"]


@dataclass(frozen=True)
class Arrow:
    """Normal equations of several arcs that share parameters.

    Parameters
    ----------
    blocks : ndarray (a, 6, 6)
        Of each arc's state.
    coupling : ndarray (a, 6, p)
        Between a state and the shared parameters.
    shared : ndarray (p, p)
        Of the shared parameters, priors included.
    right_states : ndarray (a, 6)
        Right side of each arc.
    right_shared : ndarray (p,)
        Right side of the shared parameters.
    """

    blocks: Array
    coupling: Array
    shared: Array
    right_states: Array
    right_shared: Array

    def dense(self) -> Array:
        """Return the whole matrix (6a + p, 6a + p), states first."""
        a = len(self.blocks)
        full: Array = scipy.linalg.block_diag(*self.blocks, self.shared)
        for k in range(a):
            full[6 * k : 6 * k + 6, 6 * a :] = self.coupling[k]
            full[6 * a :, 6 * k : 6 * k + 6] = self.coupling[k].T
        return full

    def solve(self, damping: float = 0.0) -> tuple[Array, Array]:
        """Eliminate the states of each arc, then solve for the shared parameters.

        Parameters
        ----------
        damping : float
            Share of the diagonal that is added to it (Levenberg-Marquardt).

        Returns
        -------
        states : ndarray (a, 6)
        values : ndarray (p,)

        Raises
        ------
        NumericalError
            If the equations are singular.
        """
        scale_n, scale_s = self._scales()
        N = self.blocks * scale_n[:, :, None] * scale_n[:, None, :] + damping * np.eye(6)
        C = self.coupling * scale_n[:, :, None] * scale_s
        S = self.shared * scale_s[:, None] * scale_s + damping * np.eye(len(self.shared))
        g, h = self.right_states * scale_n, self.right_shared * scale_s
        try:
            both = np.linalg.solve(N, np.concatenate([C, g[:, :, None]], axis=2))
            inner, free = both[:, :, :-1], both[:, :, -1]
            reduced = S - np.einsum("aij,aik->jk", C, inner)
            values = np.linalg.solve(reduced, h - np.einsum("aij,ai->j", C, free))
        except np.linalg.LinAlgError as exc:
            raise NumericalError(
                "the normal equations are singular",
                do="estimate fewer parameters, or give priors",
            ) from exc
        states = free - np.einsum("aij,j->ai", inner, values)
        return states * scale_n, values * scale_s

    def in_sigmas(self, states: Array, values: Array) -> float:
        """Return the largest step in units of the least sigma that each unknown can have."""
        scale_n, scale_s = self._scales()
        return float(max(np.abs(states / scale_n).max(), np.abs(values / scale_s).max(initial=0.0)))

    def _scales(self) -> tuple[Array, Array]:
        """One over the norm of each column, (a, 6) and (p,)."""
        return (
            1.0 / np.sqrt(np.diagonal(self.blocks, axis1=1, axis2=2)),
            1.0 / np.sqrt(np.diag(self.shared)),
        )
