"""The state-transition matrix along a known orbit, from the gradient of the force at nodes."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from unmodeled.core.arrays import Array

__all__ = ["NODES", "Indices", "Panels", "Transition"]

Indices: TypeAlias = npt.NDArray[np.intp]

#: Gauss-Legendre nodes of a panel.
NODES = 8
_X: Array = np.asarray(legendre.leggauss(NODES)[0], dtype=np.float64)
_W: Array = np.asarray(legendre.leggauss(NODES)[1], dtype=np.float64)
#: Lagrange's polynomials of the nodes in Legendre's basis, (degree, node); exact by Gauss's rule.
_VALUES: Array = np.asarray(legendre.legvander(_X, NODES - 1), dtype=np.float64)
_LAGRANGE = (_VALUES * _W[:, None]).T * (np.arange(NODES) + 0.5)[:, None]
#: Their first and second integrals from -1 on.
_ONCE: Array = np.asarray(legendre.legint(_LAGRANGE, lbnd=-1), dtype=np.float64)
_TWICE: Array = np.asarray(legendre.legint(_LAGRANGE, 2, lbnd=-1), dtype=np.float64)


class Panels:
    """Panels of time, each with the nodes of a Gauss-Legendre rule.

    Parameters
    ----------
    edges : ndarray (k + 1,)
        Increasing, s.

    Attributes
    ----------
    half : ndarray (k,)
        Half of each panel's length, s.
    nodes : ndarray (k, NODES)
        Times, s.
    """

    weights = _W

    def __init__(self, edges: Array) -> None:
        self.edges, self.half = edges, 0.5 * np.diff(edges)
        self.nodes = 0.5 * (edges[1:] + edges[:-1])[:, None] + self.half[:, None] * _X

    def place(self, times: Array) -> tuple[Indices, Array]:
        """Return the panel of each time and the time in it, from -1 to 1."""
        last = len(self.half) - 1
        panel = np.clip(np.searchsorted(self.edges, times, side="right") - 1, 0, last)
        return panel, (times - self.edges[panel]) / self.half[panel] - 1.0

    def rules(self, times: Array) -> tuple[Indices, Array]:
        """Return the panel of each time, and weights (n, NODES) of the integral from its start."""
        if not len(self.half):
            return np.zeros(len(times), dtype=int), np.zeros((len(times), NODES))
        panel, x = self.place(times)
        return panel, _integral(_ONCE, x) * self.half[panel][:, None]


class Transition:
    r"""The matrix Phi(t) with :math:`\dot\Phi = [[0, I], [G, D]] \Phi` and Phi = I at the start.

    G and D are the derivatives of the acceleration by position and velocity along an orbit. The
    equations are linear, so that collocation at the nodes of each panel (the implicit Runge-Kutta
    method of Gauss, of order 16 from panel to panel, [Hairer1993]
    section II.7) is one small
    linear system a panel, all solved at once. Lengths are in units of ``length``, speeds in units
    of ``speed``.

    Parameters
    ----------
    panels : Panels
        With nodes where the orbit was asked for.
    partials : ndarray (k NODES, 3, 6)
        d acceleration / d state at the nodes, s-2 and s-1.
    length, speed : float
        Units, m and m/s.
    """

    def __init__(self, panels: Panels, partials: Array, length: float, speed: float) -> None:
        self._panels, self._ratio = panels, speed / length
        count, step = len(panels.half), panels.half
        G = partials[:, :, :3].reshape(count, NODES, 3, 3)
        D = partials[:, :, 3:].reshape(count, NODES, 3, 3)
        first, second = _integral(_ONCE, _X), _integral(_TWICE, _X)
        h = step[:, None, None, None, None]
        # K_i - sum_j [h^2 b_ij G_i + h a_ij D_i] K_j = G_i (r + h c_i v) + D_i v
        matrix = -(h**2) * second[:, None, :, None] * G[:, :, :, None, :]
        matrix -= h * first[:, None, :, None] * D[:, :, :, None, :]
        matrix = matrix.reshape(count, 3 * NODES, 3 * NODES) + np.eye(3 * NODES)
        since = (step[:, None] * (1.0 + _X))[:, :, None, None]
        right = np.concatenate([G / self._ratio, G * since + D], axis=3)
        unit = np.linalg.solve(matrix, right.reshape(count, 3 * NODES, 6))
        unit = unit.reshape(count, NODES, 3, 6)
        start, ends = np.eye(6), np.ones(count)
        across = self._matrices(unit, np.eye(6), ends, step)
        self._starts = np.empty((count, 6, 6))
        for k in range(count):
            self._starts[k] = start
            start = across[k] @ start
        self._rates = unit @ self._starts[:, None]

    def at(self, times: Array) -> Array:
        """Return Phi (n, 6, 6) at any times within the panels."""
        panel, x = self._panels.place(times)
        half = self._panels.half[panel]
        return self._matrices(self._rates[panel], self._starts[panel], x, half)

    def at_nodes(self) -> Array:
        """Return Phi (k NODES, 6, 6) at the nodes."""
        return self.at(self._panels.nodes.ravel())

    def _matrices(self, rates: Array, start: Array, x: Array, half: Array) -> Array:
        """Matrices (n, 6, 6) at ``x`` of panels, from the rates (n, NODES, 3, 6) of the velocity.

        ``start`` holds the matrices at the beginning of the panels.
        """
        step = half[:, None, None]
        out = np.array(np.broadcast_to(start, (len(x), 6, 6)))
        velocity = out[:, 3:].copy()
        out[:, 3:] += step * np.einsum("nj,njab->nab", _integral(_ONCE, x), rates)
        push = step**2 * np.einsum("nj,njab->nab", _integral(_TWICE, x), rates)
        out[:, :3] += self._ratio * ((1.0 + x)[:, None, None] * step * velocity + push)
        return out


def _integral(table: Array, x: Array) -> Array:
    """Integrals (n, NODES) of Lagrange's polynomials from -1 to ``x``."""
    return np.asarray(legendre.legval(x, table).T, dtype=np.float64)
