"""Batch least squares of one orbit in a learned field: smoothed states and accelerations.

The field is a model, given as values and gradient, plus solid harmonics of low degree that take up
what the model lacks, with a prior about zero. Unknowns are the state in the middle and those
coefficients; data are positions and accelerations at known times. Steps are those of Levenberg and
Marquardt between orbits without gaps. Normalised units throughout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.pipeline.element_steps import step_in_elements
from unmodeled.pipeline.orbit_data import OrbitData, kepler_acceleration, kepler_place
from unmodeled.pipeline.orbit_shooting import Field, HarmonicField, Indices, Shot, shoot

__all__ = ["SmoothedOrbit", "smooth_orbit"]

_MAX_ITERATIONS = 40
#: Damping of the first step, of Gauss and Newton's, and what means a stall.
_DAMPING, _UNDAMPED, _STIFF = 1e-3, 1e-12, 1e4
#: Costs that differ by less are equal: squared residuals in the noise.
_EQUAL = 1e-4
#: Gaps are closed to this share of the position noise, or of a radius if that is more.
_CLOSED, _ROUNDED = 1e-6, 1e-11
#: Accelerations count as such where the position noise is less than this share of the radius: the
#: field is not linear over more. Others are read as places.
_SHARP = 0.1
#: Largest pull beside that of the mass, as a share of it, that such a place is corrected for.
_SMALL = 0.1
#: Factors of the prior that are tried, and the first one.
_WIDTHS = np.geomspace(0.01, 1.0, 9)
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
        Of Levenberg and Marquardt.
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
    data: OrbitData,
    field: Field,
    start: Array,
    degree: int,
    prior: Array,
    coefficients: Array | None = None,
    *,
    settled: float = 0.01,
) -> SmoothedOrbit:
    """Fit an orbit in ``field`` plus harmonics to observed positions and accelerations.

    Parameters
    ----------
    data : OrbitData
        What was observed.
    field : callable
        What is known of the field.
    start : ndarray (n, 6)
        First guess of the states: nearly an orbit of the field with ``coefficients``.
    degree : int
        Highest degree of the harmonics; -1 for none.
    prior : ndarray (p,)
        Standard deviations of their coefficients; 0 holds one at zero.
    coefficients : ndarray (p,), optional
        First guess of them; 0 if not given.
    settled : float
        Converged: no state moves by more than this share of its standard deviation.

    Raises
    ------
    NumericalError
        If the first guess is no orbit of the field, or the iteration does not converge.
    """
    free = np.flatnonzero(prior)
    model = HarmonicField(field, degree, free, data.gm)
    theta = np.zeros(len(prior)) if coefficients is None else coefficients
    size = float(np.median(np.linalg.norm(start[:, :3], axis=1)))
    closed = max(_CLOSED * data.position_noise, _ROUNDED * size)
    shot = shoot(model, data.times, start, theta, closed)
    if shot is None:
        raise NumericalError("the first guess leads to no orbit in the field", do=_DO)
    wide, damping, frozen = _FIRST_WIDTH, _DAMPING, not len(free)
    for iteration in range(1, _MAX_ITERATIONS + 1):
        seen = _Weighed(data, model, shot)
        rows, aim = seen.linear(shot)
        # The prior is about coefficients of zero, so the unknowns are they and not their steps.
        aim = aim + rows[:, 6:] @ shot.theta[free]
        triangle = np.asarray(np.linalg.qr(np.hstack([rows, aim[:, None]]), mode="r"))
        if not frozen:
            wide = _likely_width(triangle, prior[free], wide)
        step_of = _Steps(triangle, wide * prior[free], shot.theta[free])
        spread = np.linalg.norm(shot.design @ step_of.root, axis=2)
        moved = shot.design @ step_of(_UNDAMPED) + shot.gaps
        change = float((np.abs(moved) / spread).max())
        cost = seen.cost(shot) + _prior_cost(shot, wide * prior, free)
        while True:
            trial = _stepped(model, data.times, shot, step_of(damping), closed)
            if trial is not None:
                fresh = seen.cost(trial) + _prior_cost(trial, wide * prior, free)
                if fresh <= cost + _EQUAL:
                    break
            damping *= 10.0
            if damping > _STIFF:
                raise NumericalError(f"the orbit fit stalls at iteration {iteration}", do=_DO)
        shot, damping = trial, max(damping / 10.0, _UNDAMPED)
        frozen = frozen or change < 1.0 or iteration > _MAX_ITERATIONS // 2
        if change < settled:
            return SmoothedOrbit(
                shot.states,
                model(shot.states[:, :3], shot.theta)[0],
                np.linalg.norm(seen.slopes @ step_of.root, axis=2),
                spread[:, :3],
                shot.theta,
                wide,
                float(np.mean((data.positions - shot.positions) ** 2)) / data.position_noise**2,
                iteration,
            )
    raise NumericalError(
        f"the orbit fit does not converge in {_MAX_ITERATIONS} iterations: it would still move by "
        f"{change:.2g} standard deviations (allowed: {settled})",
        do=_DO,
    )


def _stepped(
    model: HarmonicField, times: Array, shot: Shot, step: Array, closed: float
) -> Shot | None:
    theta = shot.theta.copy()
    theta[model.free] += step[6:]
    states = step_in_elements(shot.states, shot.design @ step + shot.gaps, model.gm)
    return shoot(model, times, states, theta, closed)


def _prior_cost(shot: Shot, prior: Array, free: Indices) -> float:
    return float(np.sum((shot.theta[free] / prior[free]) ** 2))


class _Steps:
    """Steps of the unknowns for any damping, of columns scaled by their own norm."""

    def __init__(self, triangle: Array, prior: Array, now: Array) -> None:
        tail = np.diag(np.concatenate([np.zeros(6), 1.0 / prior]))[6:]
        full = np.vstack([triangle[:, :-1], tail])
        right = np.concatenate([triangle[:, -1], np.zeros(len(prior))]) - full[:, 6:] @ now
        self._scale = np.linalg.norm(full, axis=0)
        u, self._size, self._axes = np.linalg.svd(full / self._scale, full_matrices=False)
        self._right = u.T @ right
        #: Their covariance is ``root @ root.T``.
        self.root = self._axes.T / self._size / self._scale[:, None]

    def __call__(self, damping: float) -> Array:
        shares = self._size / (self._size**2 + damping)
        step: Array = self._axes.T @ (shares * self._right) / self._scale
        return step


class _Weighed:
    """Residuals in their noise, with weights and places as they are at one orbit."""

    def __init__(self, data: OrbitData, model: HarmonicField, shot: Shot) -> None:
        self._data, self._model, at = data, model, shot.states[:, :3]
        self._value, self._gradient, slopes = model(at, shot.theta)
        #: Of the accelerations by the unknowns, (n, 3, 6 + p).
        self.slopes = self._gradient @ shot.design[:, :3]
        self.slopes[:, :, 6:] += slopes
        self._root = _noise_root(self._gradient, (data.position_noise, data.acceleration_noise))
        self._sharp = data.position_noise < _SHARP * np.linalg.norm(at, axis=1)
        self._places = _places(data, model, shot.theta)
        self._spread = data.place_spread(self._places)
        self._read = ~self._sharp & np.isfinite(self._spread)

    def linear(self, shot: Shot) -> tuple[Array, Array]:
        """Return slopes (k, 6 + p) of all predictions, and the residuals (k,)."""
        places, noise = shot.design[:, :3], self._data.position_noise
        near = places[self._read] / self._spread[self._read, None, None]
        sharp = np.linalg.solve(self._root, self.slopes)[self._sharp]
        rows = np.concatenate([places / noise, near, sharp])
        ahead = (self._gradient @ shot.gaps[:, :3, None])[..., 0]
        return rows.reshape(-1, places.shape[2]), self._residuals(shot, self._value + ahead)

    def cost(self, shot: Shot) -> float:
        """Return the sum of squared residuals of any orbit."""
        left = self._residuals(shot, self._model(shot.positions, shot.theta)[0])
        return float(left @ left)

    def _residuals(self, shot: Shot, accelerations: Array) -> Array:
        data, at = self._data, shot.positions
        near = (self._places - at)[self._read] / self._spread[self._read, None]
        rest = (data.accelerations - accelerations)[:, :, None]
        sharp = np.linalg.solve(self._root, rest)[self._sharp, :, 0]
        return np.concatenate([(data.positions - at) / data.position_noise, near, sharp]).ravel()


def _places(data: OrbitData, model: HarmonicField, theta: Array) -> Array:
    """Return where the accelerations were felt, (n, 3), as the field tells.

    Exact in the noise, however large, where the field is that of the mass. How a place moves with
    the coefficients is left out of the fit, and so is the density of the accelerations: both say
    the same on the average, with opposite signs.
    """
    places = kepler_place(data.accelerations, data.gm)
    far = np.linalg.norm(places, axis=1)
    outside = np.flatnonzero(far >= 1.0)
    more = model(places[outside], theta)[0] - kepler_acceleration(places[outside], data.gm)
    small = np.linalg.norm(more, axis=1) < _SMALL * data.gm / far[outside] ** 2
    mended = data.accelerations[outside[small]] - more[small]
    places[outside[small]] = kepler_place(mended, data.gm)
    return places


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
