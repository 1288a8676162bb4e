"""Batch least squares of one orbit in a learned field: smoothed states and accelerations.

The field is a model, given as values and gradient, plus solid harmonics of low degree that take up
what the model lacks, with a prior about zero. Unknowns are the initial state and those
coefficients; data are positions and accelerations at known times. All intervals between the times
are integrated side by side with their variational equations (multiple shooting, [Bock1984]),
so that a first guess that is off everywhere a little does not diverge as one long shot would.
Normalised units throughout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.pipeline.orbit_shooting import Field, HarmonicField, Shot, shoot

__all__ = ["Field", "SmoothedOrbit", "smooth_orbit"]


#: Converged: no state moves by more than this share of its standard deviation.
_STEP, _MAX_ITERATIONS = 0.01, 40
#: Accelerations count where the position noise is less than this share of the radius: the field
#: is not linear over more.
_SHARP = 0.1
#: Factors of the prior that are tried, and the first one.
_WIDTHS = np.geomspace(0.01, 1.0, 9)
_CLOSED, _DAMPING, _STIFFEST, _SAME = 1e-6, 1e-3, 1e6, 1e-4
TRACE, PLACES = False, True
_FIRST_WIDTH = float(_WIDTHS[4])
_DO = "give a longer or less noisy trajectory, or a lower degree"


@dataclass(frozen=True)
class SmoothedOrbit:
    """An orbit that fits the data.

    Parameters
    ----------
    states : ndarray (n, 6)
        On the orbit, at the times of the data.
    accelerations : ndarray (n, 3)
        Of the field with its harmonics, there.
    acceleration_sigmas : ndarray (n, 3)
        Standard deviations of the accelerations.
    position_sigmas : ndarray (n, 3)
        Of the positions.
    coefficients : ndarray (p,)
        Of the harmonics, fully normalised, degree 0 first.
    prior_factor : float
        What the prior standard deviations were multiplied by: most likely.
    reduced_square : float
        Weighted sum of squared position residuals over their number: 1 if the noise is as stated.
    iterations : int
        Of Gauss and Newton.
    """

    states: Array
    accelerations: Array
    acceleration_sigmas: Array
    position_sigmas: Array
    coefficients: Array
    prior_factor: float
    reduced_square: float
    iterations: int


def smooth_orbit(
    times: Array,
    observed: tuple[Array, Array],
    noise: tuple[float, float],
    field: Field,
    start: Array,
    degree: int,
    prior: Array,
    gm: float,
) -> SmoothedOrbit:
    """Fit an orbit in ``field`` plus harmonics to observed positions and accelerations.

    Parameters
    ----------
    times : ndarray (n,)
        Increasing.
    observed : (ndarray (n, 3), ndarray (n, 3))
        Positions and accelerations. Those of the accelerations belong to a place that is as
        uncertain as the position, and another draw.
    noise : (float, float)
        Standard deviations of position, positive, and acceleration.
    field : callable
        What is known of the field.
    start : ndarray (n, 6)
        First guess of the states.
    degree : int
        Highest degree of the harmonics; -1 for none.
    prior : ndarray (p,)
        Standard deviations of their coefficients; 0 holds one at zero.
    gm : float
        Scale of the coefficients (with a reference radius of 1).

    Raises
    ------
    NumericalError
        If the iteration leaves the field's domain or does not converge.
    """
    x, y = observed
    free = np.flatnonzero(prior)
    model, wide, damping = HarmonicField(field, degree, free, gm), _FIRST_WIDTH, _DAMPING
    closed = _CLOSED * noise[0]
    shot = shoot(model, times, start, np.zeros(len(prior)), closed)
    if shot is None:
        raise NumericalError("the first guess leads to no orbit in the field", do=_DO)
    frozen = not len(free)
    for iteration in range(1, _MAX_ITERATIONS + 1):
        data = _Data(model, shot, x, y, noise, gm)
        rows, aim = data.linear(shot)
        aim = aim + rows[:, 6:] @ shot.theta[free]
        triangle = np.asarray(np.linalg.qr(np.hstack([rows, aim[:, None]]), mode="r"))
        if not frozen:
            wide = _likely_width(triangle, prior[free], wide)
        tail = np.diag(np.concatenate([np.zeros(6), 1.0 / (wide * prior[free])]))[6:]
        full = np.vstack([triangle[:, :-1], tail])
        right = np.concatenate([triangle[:, -1], np.zeros(len(free))])
        right -= full[:, 6:] @ shot.theta[free]
        scale = np.linalg.norm(full, axis=0)
        u, size, vt = np.linalg.svd(full / scale, full_matrices=False)
        inverse = vt.T / size / scale[:, None]
        spread = np.linalg.norm(shot.design @ inverse, axis=2)
        moved = shot.design @ (inverse @ (u.T @ right)) + shot.gaps
        change = float((np.abs(moved) / spread).max())
        cost = data.cost(shot) + _prior_cost(shot, wide * prior, free)
        while True:
            step = vt.T @ (size / (size**2 + damping) * (u.T @ right)) / scale
            theta = shot.theta.copy()
            theta[free] += step[6:]
            trial = shoot(model, times, shot.states + shot.design @ step + shot.gaps, theta, closed)
            new = np.inf
            if trial is not None:
                new = data.cost(trial) + _prior_cost(trial, wide * prior, free)
            if TRACE: print('  it',iteration,'wide %.3g damp %.0e change %.2g cost %.4f -> %.4f'%(wide,damping,change,cost,new), np.round(theta[4:9],4))
            if new <= cost + _SAME:
                break
            damping *= 10.0
            if damping > _STIFFEST:
                raise NumericalError(f"the orbit fit stalls at iteration {iteration}", do=_DO)
        shot = trial
        frozen = frozen or change < 1.0 or iteration > _MAX_ITERATIONS // 2
        if change < _STEP:
            return SmoothedOrbit(
                shot.states,
                model(shot.states[:, :3], shot.theta)[0],
                np.linalg.norm(data.far @ inverse, axis=2),
                spread[:, :3],
                shot.theta,
                wide,
                float(np.mean((x - shot.positions) ** 2)) / noise[0] ** 2,
                iteration,
            )
        damping = max(damping / 10.0, 1e-12)
    raise NumericalError(f"the orbit fit does not converge in {_MAX_ITERATIONS} iterations", do=_DO)


def _prior_cost(shot, prior, free):
    return float(np.sum((shot.theta[free] / prior[free]) ** 2))


class _Data:
    def __init__(self, model, shot, x, y, noise, gm):
        self._model, self._x, self._y, self._noise = model, x, y, noise
        radius = np.linalg.norm(shot.states[:, :3], axis=1)
        self._sharp = noise[0] < _SHARP * radius
        value, G, H = model(shot.states[:, :3], shot.theta)
        self.far = G @ shot.design[:, :3]
        self.far[:, :, 6:] += H
        self._value, self._G = value, G
        self._root = _noise_root(G, noise)
        self._place = places(model, shot.theta, y, gm)
        size = np.linalg.norm(y, axis=1)
        self._blunt = ~self._sharp & (noise[1] < 0.1 * size) if PLACES else 0*size>1
        self._spread = np.hypot(noise[0], noise[1] * np.linalg.norm(self._place, axis=1) ** 3 / gm)

    def _residuals(self, positions, rest):
        near = (self._x - positions) / self._noise[0]
        blunt = (self._place - positions)[self._blunt] / self._spread[self._blunt, None]
        sharp = np.linalg.solve(self._root, rest[:, :, None])[self._sharp, :, 0]
        return np.concatenate([near, blunt, sharp]).ravel()

    def linear(self, shot):
        rest = self._y - self._value - (self._G @ shot.gaps[:, :3, None])[..., 0]
        d = shot.design[:, :3]
        rows = np.concatenate([d / self._noise[0], d[self._blunt] / self._spread[self._blunt, None, None], np.linalg.solve(self._root, self.far)[self._sharp]])
        return rows.reshape(-1, d.shape[2]), self._residuals(shot.positions, rest)

    def cost(self, shot):
        at = shot.positions
        r = self._residuals(at, self._y - self._model(at, shot.theta)[0])
        return float(r @ r)


def places(model, theta, y, gm):
    def alone(a):
        size = np.linalg.norm(a, axis=1)[:, None]
        return -a / size * np.sqrt(gm / size)
    at = alone(y)
    r = np.linalg.norm(at, axis=1)
    out = r >= 1
    more = np.zeros_like(y)
    more[out] = model(at[out], theta)[0] + gm * at[out] / r[out, None] ** 3
    small = np.linalg.norm(more, axis=1) < 0.1 * gm / r**2
    more[~small] = 0.0
    return alone(y - more)


def _lost(iteration: int) -> NumericalError:
    return NumericalError(f"the orbit fit falls apart at iteration {iteration}", do=_DO)


def _likely_width(triangle: Array, prior: Array, now: float) -> float:
    """Return the factor of the prior that makes the linearised data most likely."""
    free, best = len(prior), (-np.inf, now)
    for wide in _WIDTHS:
        rows = np.hstack([np.zeros((free, 6)), np.diag(1.0 / (wide * prior)), np.zeros((free, 1))])
        r = np.asarray(np.linalg.qr(np.vstack([triangle, rows]), mode="r"))
        halves = float(np.log(np.abs(np.diag(r)[:-1])).sum())
        evidence = -0.5 * float(r[-1, -1]) ** 2 - halves - free * float(np.log(wide))
        best = max(best, (evidence, float(wide)))
    return best[1]


def _noise_root(G: Array, noise: tuple[float, float]) -> Array:
    """Cholesky factors (n, 3, 3): an acceleration belongs to a place drawn about the orbit."""
    covariance = noise[1] ** 2 * np.eye(3) + noise[0] ** 2 * G @ G.mT
    size = np.trace(covariance, axis1=1, axis2=2)[:, None, None]
    root: Array = np.linalg.cholesky(covariance + 1e-4 * size * np.eye(3))
    return root
