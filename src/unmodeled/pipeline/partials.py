"""How an orbit answers to its initial state and to any small acceleration.

One variational propagation gives the state-transition matrix; the answer to an acceleration is an
integral over it (variation of constants), so that hundreds of candidate effects cost one
propagation and no compilation of their own: only their accelerations along the orbit are needed.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.models.physics import Dynamics

__all__ = ["ArcPartials"]

Indices: TypeAlias = npt.NDArray[np.intp]

#: Gauss-Legendre nodes of a panel, and panels for each turn of orbit and body: 20 panels resolve
#: forces that change with the 16th harmonic to 1e-7.
_NODES = 8
_PANELS = 20
#: Columns that are integrated at once; bounds the memory.
_CHUNK = 64


class ArcPartials:
    """First-order answer of one orbit.

    Parameters
    ----------
    dynamics : Dynamics
        Force model.
    epoch : float
        Time of the initial state, s.
    state : ndarray (6,)
        Initial state, m and m/s.
    times : array_like (n,)
        When the answer is wanted, s, strictly increasing; may begin before the epoch.

    Attributes
    ----------
    times : ndarray (n,)
    states : ndarray (n, 6)
        The orbit at ``times``.
    transition : ndarray (n, 6, 6)
        d state(t) / d initial state.
    nodes : ndarray (k,)
        Where accelerations are asked for, s.
    node_states : ndarray (k, 6)
        The orbit there.

    Notes
    -----
    With Phi the state-transition matrix from the first time and B = [0; I]:
    ``d x(t) = Phi(t) integral of Phi(s)^-1 B a(s) ds`` from the epoch to t, [MontenbruckGill2000]
    section 7.2 with Lagrange's variation of constants. The integral is a Gauss-Legendre rule on
    panels of equal phase.
    """

    def __init__(self, dynamics: Dynamics, epoch: float, state: Array, times: Array) -> None:
        self.times = as_array(times, ("n",), "times")
        if not len(self.times):
            raise DataError("no times", allowed="at least one")
        start, end = min(epoch, self.times[0]), max(epoch, self.times[-1])
        first = state
        if start < epoch:
            first = dynamics.propagate(state, np.array([epoch, start]))[-1]
        edges = _refined(_panels(dynamics, first, start, end), dynamics)
        x, self._weights = legendre.leggauss(_NODES)
        self._edges, self._half = edges, 0.5 * np.diff(edges)
        middle = 0.5 * (edges[1:] + edges[:-1])
        self.nodes = (middle[:, None] + self._half[:, None] * x).ravel()
        grid = np.unique(np.concatenate([[start, epoch], self.times, self.nodes]))
        if len(grid) > 1:
            orbit = dynamics.propagate_variational(first, grid)
            states, matrices = orbit.states, orbit.transition
        else:
            states, matrices = first[None], np.eye(6)[None]
        # Lengths and speeds in units of their own size: the matrices are then well conditioned.
        size = np.linalg.norm(states.reshape(-1, 2, 3), axis=2).max(axis=0)
        self._scale = np.repeat(size, 3)
        at_nodes = np.searchsorted(grid, self.nodes)
        at_times = np.searchsorted(grid, self.times)
        at_epoch = matrices[np.searchsorted(grid, epoch)]
        self.node_states, self.states = states[at_nodes], states[at_times]
        self._matrices = matrices[at_times]
        self.transition = np.linalg.solve(
            self._scaled(at_epoch).T, np.swapaxes(self._scaled(self._matrices), 1, 2)
        ).swapaxes(1, 2)
        self.transition = self.transition * self._scale[:, None] / self._scale
        push = np.zeros((6, 3))
        push[3:] = np.eye(3) / size[1]
        self._kernel = np.linalg.solve(
            self._scaled(matrices[at_nodes]), np.broadcast_to(push, (len(at_nodes), 6, 3))
        ).reshape(-1, _NODES, 6, 3)
        self._panel, self._partial = self._rules(self.times)
        panel, partial = self._rules(np.array([epoch]))
        self._epoch = (int(panel[0]), partial[0])

    def response(self, accelerations: Array) -> Array:
        """Return d state(t) / d parameter, (n, 6, p), at ``times``.

        Parameters
        ----------
        accelerations : ndarray (k, 3, p)
            d acceleration / d parameter at ``nodes``, inertial components.
        """
        p = accelerations.shape[2]
        out = np.empty((len(self.times), 6, p))
        for first in range(0, p, _CHUNK):
            part = slice(first, min(first + _CHUNK, p))
            out[:, :, part] = self._chunk(accelerations[:, :, part])
        return out

    def kicks(self, epochs: Array, axes: str) -> tuple[Array, Array]:
        """Return d state(t) / d velocity change at each of several epochs, (n, 6, 3 q).

        Parameters
        ----------
        epochs : ndarray (q,)
            Moved to the nearest of ``nodes``; a kick outside the arc changes nothing.
        axes : str
            "rtn" or "inertial".

        Returns
        -------
        columns : ndarray (n, 6, 3 q)
        epochs : ndarray (q,)
            Where the kicks are.
        """
        k = np.abs(self.nodes[:, None] - epochs).argmin(axis=0)
        kernel = self._kernel.reshape(-1, 6, 3)[k]
        if axes == "rtn":
            states = self.node_states[k]
            kernel = kernel @ np.swapaxes(rtn_from_inertial(states), 1, 2)
        inside = (epochs >= self.nodes[0]) & (epochs <= self.nodes[-1])
        after = (self.times[:, None] > self.nodes[k]) & inside
        columns = np.einsum("nab,qbc->naqc", self._scaled(self._matrices), kernel)
        columns = columns * after[:, None, :, None] * self._scale[:, None, None]
        return np.asarray(columns.reshape(len(self.times), 6, -1), dtype=float), self.nodes[k]

    def _chunk(self, accelerations: Array) -> Array:
        if not len(self.nodes):
            return np.zeros((len(self.times), 6, accelerations.shape[2]))
        panels = accelerations.reshape(-1, _NODES, 3, accelerations.shape[2])
        rate = self._kernel @ panels  # (panels, nodes, 6, p)
        whole = np.einsum("j,kjap->kap", self._weights, rate) * self._half[:, None, None]
        before = np.concatenate([np.zeros((1, *whole.shape[1:])), np.cumsum(whole, axis=0)])
        k, weights = self._epoch
        zero = before[k] + np.einsum("j,jap->ap", weights, rate[k])
        sums = before[self._panel] - zero
        sums += np.einsum("nj,njap->nap", self._partial, rate[self._panel])
        turned: Array = self._scaled(self._matrices) @ sums * self._scale[:, None]
        return turned

    def _rules(self, times: Array) -> tuple[Indices, Array]:
        """Panel of each time, and the weights of the integral from the panel's start to it."""
        if not len(self._half):
            return np.zeros(len(times), dtype=int), np.zeros((len(times), _NODES))
        panel = np.clip(
            np.searchsorted(self._edges, times, side="right") - 1, 0, len(self._half) - 1
        )
        x = (times - self._edges[panel]) / self._half[panel] - 1.0
        nodes, weights = legendre.leggauss(_NODES)
        # The interpolating polynomial in Legendre's basis, each term integrated from -1 to x.
        basis = legendre.legvander(nodes, _NODES)
        upper = legendre.legvander(x, _NODES + 1)
        integral = np.empty((len(x), _NODES))
        integral[:, 0] = x + 1.0
        for n in range(1, _NODES):
            integral[:, n] = (upper[:, n + 1] - upper[:, n - 1]) / (2 * n + 1)
        degrees = np.arange(_NODES) + 0.5
        rules = (integral * degrees) @ basis[:, :_NODES].T * weights
        return panel, rules * self._half[panel][:, None]

    def _scaled(self, matrices: Array) -> Array:
        scaled: Array = matrices / self._scale[:, None] * self._scale
        return scaled


def _panels(dynamics: Dynamics, state: Array, start: float, end: float) -> Array:
    """Edges of panels of equal phase of orbit and spin, (k + 1,)."""
    if end <= start:
        return np.array([start])
    spin = abs(dynamics.values.get("spin_rate", 0.0))
    step = _turn_rate(dynamics, state[None], np.array([start]))[0]
    for _ in range(3):
        count = int(np.clip(np.ceil((end - start) * step * 8.0), 16, 400_000))
        times = np.linspace(start, end, count + 1)
        rates = _turn_rate(dynamics, dynamics.propagate(state, times), times)
        if rates.max() <= 2.0 * step:
            break
        step = float(rates.max())
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times))])
    phase += spin * (times - start)
    panels = int(np.ceil(_PANELS * phase[-1] / (2.0 * np.pi))) + 1
    edges: Array = np.interp(np.linspace(0.0, phase[-1], panels + 1), phase, times)
    edges[0], edges[-1] = start, end
    return edges


def _refined(edges: Array, dynamics: Dynamics) -> Array:
    """Edges with more of them where a force changes abruptly: finer by halves towards the event."""
    extra: list[Array] = []
    for effect in dynamics.effects:
        for time, width in effect.events(dynamics.values):
            reach = np.median(np.diff(edges)) if len(edges) > 1 else width
            steps = width * 2.0 ** np.arange(-1, max(np.ceil(np.log2(reach / width)), 0) + 2)
            extra += [time - steps, np.array([time]), time + steps]
    if not extra or len(edges) < 2:
        return edges
    inside = np.concatenate(extra)
    inside = inside[(inside > edges[0]) & (inside < edges[-1])]
    return np.unique(np.concatenate([edges, inside]))


def _turn_rate(dynamics: Dynamics, states: Array, times: Array) -> Array:
    """sqrt(|a| / |r|): the rate of a circular orbit here, rad/s."""
    a = np.linalg.norm(dynamics.acceleration(states, times), axis=1)
    rate: Array = np.sqrt(a / np.linalg.norm(states[:, :3], axis=1))
    return rate
