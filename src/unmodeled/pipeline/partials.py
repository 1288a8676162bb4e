"""How an orbit answers to its initial state and to any small acceleration.

One propagation and the gradient of the force along it give the state-transition matrix; the answer
to an acceleration is an integral over it (variation of constants), so that hundreds of candidate
effects cost one propagation: only their accelerations along the orbit are needed.
"""

from __future__ import annotations

import itertools

import numpy as np

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.models.physics import Dynamics
from unmodeled.models.physics.continuous_orbit import ContinuousOrbit
from unmodeled.pipeline.transition import NODES, Panels, Transition

__all__ = ["ArcPartials"]

#: Panels for each turn of orbit and body: 20 resolve forces that change with the 16th harmonic
#: to 1e-7.
_PANELS = 20
#: The gradient of the force decides where it says more than the attraction: near another body.
_STEEP = 1.2
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
    orbit : ContinuousOrbit, optional
        The orbit, if it has been integrated already.
    edges : ndarray (k + 1,), optional
        ``edges`` of the partials of an orbit next to this one on the same interval.

    Attributes
    ----------
    times : ndarray (n,)
    states : ndarray (n, 6)
        The orbit at ``times``.
    transition : ndarray (n, 6, 6)
        d state(t) / d initial state.
    edges : ndarray (k + 1,)
        Of the panels of equal phase, s.
    nodes : ndarray (k,)
        Where accelerations are asked for, s.
    node_states : ndarray (k, 6)
        The orbit there.

    Notes
    -----
    With Phi the state-transition matrix from the first time and B = [0; I]:
    ``d x(t) = Phi(t) integral of Phi(s)^-1 B a(s) ds`` from the epoch to t, [MontenbruckGill2000]
    section 7.2 with Lagrange's variation of constants. The integral is a Gauss-Legendre rule on
    panels of equal phase, and Phi comes from collocation at the same nodes (`Transition`).
    """

    def __init__(
        self,
        dynamics: Dynamics,
        epoch: float,
        state: Array,
        times: Array,
        orbit: ContinuousOrbit | None = None,
        edges: Array | None = None,
    ) -> None:
        self.times = as_array(times, ("n",), "times")
        if not len(self.times):
            raise DataError("no times", allowed="at least one")
        start, end = min(epoch, self.times[0]), max(epoch, self.times[-1])
        orbit = orbit or dynamics.fly(state, epoch, start, end)
        self.edges = _panels(dynamics, orbit, start, end) if edges is None else edges
        panels = Panels(_refined(self.edges, dynamics, orbit.stops))
        self._panels, self.nodes = panels, panels.nodes.ravel()
        self.node_states, self.states = orbit.states(self.nodes), orbit.states(self.times)
        # Lengths and speeds in units of their own size: the matrices are then well conditioned.
        every = np.concatenate([self.node_states, self.states])
        size = np.linalg.norm(every.reshape(-1, 2, 3), axis=2).max(axis=0)
        self._scale = np.repeat(size, 3)
        if len(self.nodes):
            gradient = dynamics.state_partials(self.node_states, self.nodes)
            phi = Transition(panels, gradient, float(size[0]), float(size[1]))
            self._matrices, at_epoch = phi.at(self.times), phi.at(np.array([epoch]))[0]
            at_nodes = phi.at_nodes()
        else:
            self._matrices, at_epoch = np.eye(6)[None], np.eye(6)
            at_nodes = np.empty((0, 6, 6))
        back = np.linalg.inv(at_epoch)
        self.transition = (self._matrices @ back) * self._scale[:, None] / self._scale
        push = np.zeros((6, 3))
        push[3:] = np.eye(3) / size[1]
        self._kernel = np.linalg.solve(
            at_nodes, np.broadcast_to(push, (len(at_nodes), 6, 3))
        ).reshape(-1, NODES, 6, 3)
        self._panel, self._partial = panels.rules(self.times)
        panel, partial = panels.rules(np.array([epoch]))
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
        columns = np.einsum("nab,qbc->naqc", self._matrices, kernel)
        columns = columns * after[:, None, :, None] * self._scale[:, None, None]
        return np.asarray(columns.reshape(len(self.times), 6, -1), dtype=float), self.nodes[k]

    def _chunk(self, accelerations: Array) -> Array:
        if not len(self.nodes):
            return np.zeros((len(self.times), 6, accelerations.shape[2]))
        pushes = accelerations.reshape(-1, NODES, 3, accelerations.shape[2])
        rate = self._kernel @ pushes  # (panels, nodes, 6, p)
        whole = np.einsum("j,kjap->kap", Panels.weights, rate) * self._panels.half[:, None, None]
        before = np.concatenate([np.zeros((1, *whole.shape[1:])), np.cumsum(whole, axis=0)])
        k, weights = self._epoch
        zero = before[k] + np.einsum("j,jap->ap", weights, rate[k])
        sums = before[self._panel] - zero
        sums += np.einsum("nj,njap->nap", self._partial, rate[self._panel])
        turned: Array = self._matrices @ sums * self._scale[:, None]
        return turned


def _panels(dynamics: Dynamics, orbit: ContinuousOrbit, start: float, end: float) -> Array:
    """Edges of panels of equal phase of orbit and spin, (k + 1,)."""
    if end <= start:
        return np.array([start])
    spin = abs(dynamics.values.get("spin_rate", 0.0))
    step = _turn_rate(dynamics, orbit, np.array([start]))[0]
    for _ in range(3):
        count = int(np.clip(np.ceil((end - start) * step * 8.0), 16, 400_000))
        times = np.linspace(start, end, count + 1)
        rates = _turn_rate(dynamics, orbit, times)
        if rates.max() <= 2.0 * step:
            break
        step = float(rates.max())
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times))])
    phase += spin * (times - start)
    panels = int(np.ceil(_PANELS * phase[-1] / (2.0 * np.pi))) + 1
    edges: Array = np.interp(np.linspace(0.0, phase[-1], panels + 1), phase, times)
    edges[0], edges[-1] = start, end
    return edges


def _refined(edges: Array, dynamics: Dynamics, stops: tuple[float, ...]) -> Array:
    """Edges with more of them where a force changes abruptly: finer by halves towards the event."""
    extra: list[Array] = []
    for effect in dynamics.effects:
        for time, width in effect.events(dynamics.values):
            reach = np.median(np.diff(edges)) if len(edges) > 1 else width
            steps = width * 2.0 ** np.arange(-1, max(np.ceil(np.log2(reach / width)), 0) + 2)
            extra += [time - steps, np.array([time]), time + steps]
    # Between two stops lies a penumbra: panels of half its width within and beside it.
    for first, second in itertools.pairwise(stops):
        if second - first < np.median(np.diff(edges)):
            extra.append(np.linspace(1.5 * first - 0.5 * second, 1.5 * second - 0.5 * first, 5))
    if not extra or len(edges) < 2:
        return edges
    inside = np.concatenate(extra)
    inside = inside[(inside > edges[0]) & (inside < edges[-1])]
    return np.unique(np.concatenate([edges, inside]))


def _turn_rate(dynamics: Dynamics, orbit: ContinuousOrbit, times: Array) -> Array:
    """Rate of a circular orbit with this attraction, or with this gradient of it, rad/s."""
    states = orbit.states(times)
    a = np.linalg.norm(dynamics.acceleration(states, times), axis=1)
    rate: Array = np.sqrt(a / np.linalg.norm(states[:, :3], axis=1))
    gradient = dynamics.state_partials(states, times)[:, :, :3]
    # That of a point mass is diag(-2, 1, 1) GM / r^3.
    steep = np.sqrt(np.linalg.norm(gradient, axis=(1, 2)) / np.sqrt(6.0))
    return np.where(steep > _STEEP * rate, steep, rate)
