"""A force along the orbit as values at nodes, linear in between, and what it does to the rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.pipeline.linearisation import Linearisation
from unmodeled.pipeline.transition import Indices

__all__ = ["force_grids", "interpolation", "nodal_responses"]

#: Nodes of an arc at least, when there are very many arcs.
_FEWEST = 4


def force_grids(
    lin: Linearisation, period: float, *, each: int, enough: int, most: int, total: int
) -> list[Indices]:
    """Choose the nodes of each arc that carry a value, nearly even in time.

    Parameters
    ----------
    lin : Linearisation
        Gives the arcs.
    period : float
        Of a revolution, s.
    each : int
        Nodes wished for in a revolution.
    enough, most : int
        In an arc at least, if all arcs together allow it, and at most.
    total : int
        Of all arcs together.

    Returns
    -------
    list of ndarray of int
        Indices into the ``partials.nodes`` of each arc.
    """
    limit = min(max(total // len(lin.arcs), _FEWEST), most)
    grids = []
    for a in lin.arcs:
        nodes = a.partials.nodes
        wished = np.ceil(each * (nodes[-1] - nodes[0]) / period)
        count = int(np.clip(wished, min(enough, limit), limit))
        wanted = np.linspace(nodes[0], nodes[-1], count)
        grids.append(np.unique(np.clip(np.searchsorted(nodes, wanted), 0, len(nodes) - 1)))
    return grids


def nodal_responses(
    lin: Linearisation, grids: Sequence[Indices], axes: Sequence[Array] | None = None
) -> Array:
    """Return whitened columns of 1 m/s2 at each node along each axis, (n, h, 3), not projected.

    Parameters
    ----------
    lin : Linearisation
        At the fit.
    grids : sequence of ndarray of int
        Of `force_grids`; h is the number of all nodes, arc after arc.
    axes : sequence of ndarray (k, 3, 3), optional
        For each arc the axes at its ``partials.nodes``: columns are unit vectors in inertial
        components. The inertial axes if not given.
    """
    counts = [len(g) for g in grids]
    ends = np.cumsum([0, *counts])
    pushes = []
    for k, (a, grid, first) in enumerate(zip(lin.arcs, grids, ends[:-1], strict=True)):
        nodes = a.partials.nodes
        hats = interpolation(nodes, nodes[grid])
        turn = np.broadcast_to(np.eye(3), (len(nodes), 3, 3)) if axes is None else axes[k]
        push = np.zeros((len(nodes), 3, int(ends[-1]), 3))
        push[:, :, first : first + len(grid)] = np.einsum("kij,kh->kihj", turn, hats)
        pushes.append(push.reshape(len(nodes), 3, -1))
    return lin.force_columns(pushes).reshape(len(lin.residuals), int(ends[-1]), 3)


def interpolation(times: Array, centres: Array) -> Array:
    """Piecewise-linear interpolation from values at the centres, (k, h)."""
    return np.stack([np.interp(times, centres, row) for row in np.eye(len(centres))], axis=1)
