"""The acceleration that the residuals ask for, along the orbit, whatever its cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.pipeline.comparison.force_nodes import force_grids, nodal_responses
from unmodeled.pipeline.comparison.marginal import Ridge, compress, ridge
from unmodeled.pipeline.comparison.orbit_geometry import orbit_geometry
from unmodeled.pipeline.linearisation import Linearisation
from unmodeled.pipeline.transition import Indices

__all__ = ["FreeForce", "free_force"]

#: Nodes wished for in a revolution; in an arc at least, if all arcs together allow it; at most.
_REVOLUTION, _ENOUGH, _MOST = 8, 40, 120
#: Of all arcs together.
_ALL = 240
#: Correlation times tried, in revolutions.
_TAUS = (0.1, 0.3, 1.0, 3.0, 10.0)


@dataclass(frozen=True)
class FreeForce:
    """Reconstructed acceleration.

    Parameters
    ----------
    table : DataFrame
        A row a node: arc, t_s, R, T, N, sigma_R, sigma_T, sigma_N, x, y, z (inertial), all m/s2,
        then the columns of `orbit_geometry`.
    prior_sigma : float
        Standard deviation of the prior on each axis, m/s2; 0 where no force is as likely.
    tau : float
        Its correlation time, s.
    step : float
        Between nodes, s: what changes faster is not resolved.
    log_bayes : float
        ln of the Bayes factor of such a force against none.
    known : float
        Share of the prior variance that the data took away, over all axes and nodes: 0 where they
        say nothing.
    """

    table: pd.DataFrame
    prior_sigma: float
    tau: float
    step: float
    log_bayes: float
    known: float


def free_force(lin: Linearisation, period: float) -> FreeForce:
    """Return the smoothed acceleration under a first-order Gauss-Markov prior.

    Parameters
    ----------
    lin : Linearisation
        At the fit; what states and free parameters absorb is not seen, and the sigmas say so.
    period : float
        Of a revolution, s.

    Notes
    -----
    On each of the axes R, T, N the acceleration is piecewise linear between nodes whose values
    have the covariance ``s^2 exp(-|t - t'| / tau)``: the first-order Gauss-Markov process of
    [TapleySchutzBorn2004] section 4.9, whose smoothed filter gives the same answer. s and tau are
    the most likely on a grid; sigmas are those of the posterior with the noise as estimated.
    """
    grids = force_grids(lin, period, each=_REVOLUTION, enough=_ENOUGH, most=_MOST, total=_ALL)
    counts = [3 * len(g) for g in grids]
    ends = np.cumsum([0, *counts])
    axes = [np.swapaxes(rtn_from_inertial(a.partials.node_states), 1, 2) for a in lin.arcs]
    columns = nodal_responses(lin, grids, axes)
    # Axis after axis within an arc: the prior is a block for each.
    blocks = np.split(columns, np.cumsum([len(g) for g in grids])[:-1], axis=1)
    columns = np.concatenate(
        [np.swapaxes(b, 1, 2).reshape(len(columns), -1) for b in blocks], axis=1
    )
    data = compress(lin.project(columns), lin.project(lin.residuals))
    found: list[tuple[float, float, Ridge, Array]] = []
    for turns in _TAUS:
        root = scipy.linalg.block_diag(
            *(
                np.kron(np.eye(3), _root(a.partials.nodes[g], turns * period))
                for a, g in zip(lin.arcs, grids, strict=True)
            )
        )
        r = ridge(data, lin.freedom, root)
        found.append((float(r.logs.max(initial=0.0)), turns * period, r, root))
    _, tau, best, root = max(found, key=lambda f: f[0])
    spread = np.sqrt(best.variance) * best.size
    mean = root @ best.mean()
    # Prior variance minus what the data took away along each seen direction.
    seen_part = root @ best.right.T * np.sqrt(1.0 - best.shrinkage())
    variance = np.maximum(np.sum(root**2, axis=1) - np.sum(seen_part**2, axis=1), 0.0)
    sigma = spread * np.sqrt(variance)
    tables = [
        _table(lin, k, grid, mean[first:last], sigma[first:last])
        for k, (grid, first, last) in enumerate(zip(grids, ends[:-1], ends[1:], strict=True))
    ]
    steps = [np.diff(a.partials.nodes[g]) for a, g in zip(lin.arcs, grids, strict=True)]
    logs = np.array([f[2].log_bayes for f in found])
    return FreeForce(
        pd.concat(tables, ignore_index=True),
        float(spread),
        float(tau),
        float(np.median(np.concatenate(steps))),
        float(np.logaddexp.reduce(logs) - np.log(len(logs))),
        float(1.0 - np.mean(variance)) if best.size else 0.0,
    )


def _root(times: Array, tau: float) -> Array:
    """Lower triangular root of exp(-|t - t'| / tau): the process step by step."""
    fade = np.exp(-np.diff(times) / tau)
    root = np.zeros((len(times), len(times)))
    root[0, 0] = 1.0
    for k, f in enumerate(fade, start=1):
        root[k] = f * root[k - 1]
        root[k, k] = np.sqrt(1.0 - f * f)
    return root


def _table(lin: Linearisation, k: int, grid: Indices, mean: Array, sigma: Array) -> pd.DataFrame:
    partials = lin.arcs[k].partials
    states, times = partials.node_states[grid], partials.nodes[grid]
    rtn, spread = mean.reshape(3, -1).T, sigma.reshape(3, -1).T
    inertial = np.einsum("nji,nj->ni", rtn_from_inertial(states), rtn)
    table = pd.DataFrame({"arc": lin.arcs[k].arc.name, "t_s": times})
    for j, axis in enumerate("RTN"):
        table[axis], table[f"sigma_{axis}"] = rtn[:, j], spread[:, j]
    for j, axis in enumerate("xyz"):
        table[axis] = inertial[:, j]
    order = ["arc", "t_s", *"RTN", "sigma_R", "sigma_T", "sigma_N", *"xyz"]
    shape = orbit_geometry(lin.model, lin.case.body, states, times)
    return pd.concat([table[order], shape], axis=1)
