"""Is there a force in what is left? A free acceleration, whatever its cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.core.frames import rtn_from_inertial
from unmodeled.pipeline.diagnosis.pool import Pool, log_p
from unmodeled.pipeline.linearisation import ArcRows, Linearisation

__all__ = ["Remainder", "remainder_of"]

_HATS = 24
_HARMONICS = 4
#: Something must be this unlikely by chance to be reported.
_LEVEL = float(np.log(1e-3))


@dataclass(frozen=True)
class Remainder:
    """What a free acceleration explains of the residuals beside what was found.

    Parameters
    ----------
    log_p : float
        ln p of an F-test: the noise is as found, so that one stated wrongly is not a force.
    log_p_stated : float
        ln p with the noise as stated.
    log_p_quiet : float
        ln p that residuals of the stated noise are as small as these.
    """

    log_p: float
    log_p_stated: float
    log_p_quiet: float

    @property
    def is_there(self) -> bool:
        """True if what is left is not white: a slow change is in it, of the force or the noise."""
        return self.log_p < _LEVEL

    @property
    def is_force(self) -> bool:
        """True if the stated noise cannot be the cause.

        Where all that is left is significantly smaller than the stated noise, whoever stated it
        has allowed for slow errors: they cannot be told from a force.
        """
        return self.is_there and self.log_p_stated < _LEVEL and self.log_p_quiet > _LEVEL


def remainder_of(pool: Pool, chosen: tuple[int, ...]) -> Remainder:
    """Test the residuals beside a set of members for a free acceleration.

    The acceleration is piecewise linear in time on each of the axes R, T, N, plus harmonics of
    the argument of latitude up to the fourth: no cause is assumed.
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
    freedom = lin.freedom - len(index)
    rank = min(rank, max(freedom // 4, 0))
    square = float(residual @ residual)
    quiet = float(scipy.stats.chi2.logcdf(square, max(freedom, 1)))
    if rank == 0:
        return Remainder(0.0, 0.0, quiet)
    drop = float(np.sum((basis[:, :rank].T @ residual) ** 2))
    p = log_p(np.array([drop]), np.array([rank]), square, freedom)
    return Remainder(float(p[0]), float(scipy.stats.chi2.logsf(drop, rank)), quiet)


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
