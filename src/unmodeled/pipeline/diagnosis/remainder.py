"""Is there a force in what is left? A free acceleration, whatever its cause."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.pipeline.diagnosis.pool import Pool, log_p
from unmodeled.pipeline.linearisation import ArcRows, Linearisation

__all__ = ["remainder_log_p"]

_HATS = 24
_HARMONICS = 4


def remainder_log_p(pool: Pool, chosen: tuple[int, ...]) -> float:
    """Return ln p of a free acceleration in the residuals beside a set of members.

    The acceleration is piecewise linear in time on each of the axes R, T, N, plus harmonics of
    the argument of latitude up to the fourth: no cause is assumed. An F-test, so that a noise
    that was stated wrongly does not count as a force.
    """
    lin = pool.lin
    columns = lin.project(free_acceleration(lin))
    index = [int(i) for m in chosen for i in pool.members[m].columns]
    residual = pool.residual
    if index:
        known, _ = scipy.linalg.qr(pool.columns[:, index], mode="economic")
        columns = columns - known @ (known.T @ columns)
        residual = residual - known @ (known.T @ residual)
    size = np.linalg.norm(columns, axis=0)
    basis, r, _ = scipy.linalg.qr(
        columns[:, size > 0] / size[size > 0], mode="economic", pivoting=True
    )
    rank = int(np.sum(np.abs(np.diag(r)) > 1e-3))
    rank = min(rank, max((lin.freedom - len(index)) // 4, 0))
    if rank == 0:
        return 0.0
    drop = float(np.sum((basis[:, :rank].T @ residual) ** 2))
    p = log_p(
        np.array([drop]),
        np.array([rank]),
        float(residual @ residual),
        lin.freedom - len(index),
    )
    return float(p[0])


def free_acceleration(lin: Linearisation) -> Array:
    """Return whitened columns of a free acceleration of 1 m/s2 steps, (n, p)."""
    hats = max(_HATS // len(lin.arcs), 4)
    count = 3 * (hats * len(lin.arcs) + 2 * _HARMONICS)
    pushes = []
    for a, rows in enumerate(lin.arcs):
        push = np.zeros((len(rows.partials.nodes), 3, count))
        shapes = _hats(rows.partials.nodes, hats)
        axes = np.swapaxes(rtn_from_inertial(rows.partials.node_states), 1, 2)
        own = slice(3 * hats * a, 3 * hats * (a + 1))
        push[:, :, own] = np.einsum("kij,kh->kihj", axes, shapes).reshape(len(shapes), 3, -1)
        waves = _harmonics(rows)
        push[:, :, 3 * hats * len(lin.arcs) :] = np.einsum("kij,kh->kihj", axes, waves).reshape(
            len(waves), 3, -1
        )
        pushes.append(push)
    return lin.force_columns(pushes)


def _hats(times: Array, count: int) -> Array:
    """Piecewise-linear bumps that add up to one, (k, count)."""
    centres = np.linspace(times[0], times[-1], count)
    step = max(centres[1] - centres[0], 1e-9)
    shapes: Array = np.clip(1.0 - np.abs(times[:, None] - centres) / step, 0.0, None)
    return shapes


def _harmonics(rows: ArcRows) -> Array:
    """Cosines and sines of multiples of the angle run through in the orbit plane, (k, 2 h)."""
    s = rows.partials.node_states
    rate = np.linalg.norm(np.cross(s[:, :3], s[:, 3:]), axis=1) / np.sum(s[:, :3] ** 2, axis=1)
    t = rows.partials.nodes
    u = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    k = np.arange(1, _HARMONICS + 1)
    return np.concatenate([np.cos(u[:, None] * k), np.sin(u[:, None] * k)], axis=1)
