"""Batch least squares of one orbit in a learned field: smoothed states and accelerations.

The field is a model, given as values and gradient, plus solid harmonics of low degree that take up
what the model lacks, with a prior about zero. Unknowns are the initial state and those
coefficients; data are positions and accelerations at known times. All intervals between the times
are integrated side by side with their variational equations (multiple shooting, [Bock1984]),
so that a first guess that is off everywhere a little does not diverge as one long shot would.
Normalised units throughout.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.physics.exterior_harmonics import derivative, exterior_harmonics

__all__ = ["Field", "SmoothedOrbit", "smooth_orbit"]

Indices: TypeAlias = npt.NDArray[np.intp]
#: Acceleration (n, 3) and gradient (n, 3, 3) at positions (n, 3).
Field: TypeAlias = Callable[[Array], tuple[Array, Array]]

#: Steps of fourth order between two samples; 25 samples a period make 400 steps of it.
_STEPS = 16
#: Converged: no state moves by more than this share of its standard deviation.
_STEP, _MAX_ITERATIONS = 0.01, 40
#: Slopes and gaps beyond this are those of an orbit that fell apart.
_WILD = 1e8
#: Farthest that a state is moved at once, as a share of its radius.
_REACH = 0.3
#: Accelerations count where the position noise is less than this share of the radius: the field
#: is not linear over more.
_SHARP = 0.1
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
    nodes, steps, free = start.copy(), np.diff(times), np.flatnonzero(prior)
    model, theta, wide = _Model(field, degree, free, gm), np.zeros(len(prior)), _FIRST_WIDTH
    frozen = not len(free)
    for iteration in range(1, _MAX_ITERATIONS + 1):
        ends, phi, psi = _integrate(model, theta, nodes[:-1], steps)
        if not (np.isfinite(ends).all() and np.isfinite(phi).all()):
            raise _lost(iteration)
        a, b, c = _condense(phi, psi, ends - nodes[1:])
        if not np.abs(a).max() < _WILD or not np.abs(c).max() < _WILD:
            raise _lost(iteration)
        value, G, H = model(nodes[:, :3], theta)
        design = np.concatenate([a, b], axis=2)
        far = G @ design[:, :3]
        far[:, :, 6:] += H
        root = _noise_root(G, noise)
        sharp = noise[0] < _SHARP * np.linalg.norm(nodes[:, :3], axis=1)
        near = (x - nodes[:, :3] - c[:, :3]) / noise[0]
        rest = np.linalg.solve(root, (y - value)[:, :, None] - G @ c[:, :3, None])[..., 0]
        rows = np.concatenate([design[:, :3] / noise[0], np.linalg.solve(root, far)[sharp]])
        whole = rows.reshape(-1, design.shape[2])
        aim = np.concatenate([near, rest[sharp]]).ravel() + whole[:, 6:] @ theta[free]
        triangle = np.asarray(np.linalg.qr(np.hstack([whole, aim[:, None]]), mode="r"))
        if not frozen:
            wide = _likely_width(triangle, prior[free], wide)
        tail = np.diag(np.concatenate([np.zeros(6), 1.0 / (wide * prior[free])]))[6:]
        full = np.vstack([triangle[:, :-1], tail])
        scale = np.linalg.norm(full, axis=0)
        q, r = np.linalg.qr(full / scale)
        inverse = np.linalg.inv(r) / scale[:, None]
        step = inverse @ (q.T @ np.concatenate([triangle[:, -1], np.zeros(len(free))]))
        step[6:] -= theta[free]
        moved = design @ step + c
        length = np.linalg.norm(moved[:, :3], axis=1) / np.linalg.norm(nodes[:, :3], axis=1)
        share = min(1.0, _REACH / max(float(length.max()), 1e-300))
        nodes = nodes + share * moved
        theta[free] += share * step[6:]
        change = float((np.abs(moved) / np.linalg.norm(design @ inverse, axis=2)).max())
        frozen = frozen or change < 1.0 or iteration > _MAX_ITERATIONS // 2
        if share == 1.0 and change < _STEP:
            return SmoothedOrbit(
                nodes,
                model(nodes[:, :3], theta)[0],
                np.linalg.norm(far @ inverse, axis=2),
                np.linalg.norm(design[:, :3] @ inverse, axis=2),
                theta,
                wide,
                float(np.mean((x - nodes[:, :3]) ** 2)) / noise[0] ** 2,
                iteration,
            )
    raise NumericalError(f"the orbit fit does not converge in {_MAX_ITERATIONS} iterations", do=_DO)


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


class _Model:
    """The field with its harmonics: acceleration, gradient, and slopes by the free coefficients."""

    def __init__(self, field: Field, degree: int, free: Indices, gm: float) -> None:
        self._field, self._degree, self.free, self._gm = field, degree, free, gm

    def __call__(self, x: Array, theta: Array) -> tuple[Array, Array, Array]:
        value, G = self._field(x)
        if not len(self.free):
            return value, G, np.empty((len(x), 3, 0))
        table = exterior_harmonics(x, self._degree + 2)
        first = [derivative(table, i) for i in range(3)]
        H = self._gm * np.stack([f[: len(theta)].T for f in first], axis=1)
        own = np.empty_like(G)
        for i in range(3):
            for j in range(i, 3):
                own[:, i, j] = own[:, j, i] = theta @ derivative(first[i], j)[: len(theta)]
        return value + H @ theta, G + self._gm * own, H[:, :, self.free]


def _integrate(
    model: _Model, theta: Array, states: Array, steps: Array
) -> tuple[Array, Array, Array]:
    """Return ends (n, 6) of all intervals, their transition (n, 6, 6) and slopes (n, 6, p)."""
    n, p = len(states), len(model.free)
    big = np.zeros((n, 6, 7 + p))
    big[:, :, 0], big[:, :, 1:7] = states, np.eye(6)
    h = (steps / _STEPS)[:, None, None]

    def rate(now: Array) -> Array:
        value, G, H = model(now[:, :3, 0], theta)
        out = np.empty_like(now)
        out[:, :3] = now[:, 3:]
        out[:, 3:, 0] = value
        out[:, 3:, 1:] = G @ now[:, :3, 1:]
        out[:, 3:, 7:] += H
        return out

    with np.errstate(all="ignore"):  # what is not finite is found by the caller
        for _ in range(_STEPS):
            if not np.isfinite(big).all():
                break
            one = rate(big)
            two = rate(big + 0.5 * h * one)
            three = rate(big + 0.5 * h * two)
            four = rate(big + h * three)
            big = big + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return big[:, :, 0], big[:, :, 1:7], big[:, :, 7:]


def _condense(phi: Array, psi: Array, gap: Array) -> tuple[Array, Array, Array]:
    """Return how all states follow the first one, the coefficients, and the gaps."""
    n, p = len(phi) + 1, psi.shape[2]
    a, b, c = np.empty((n, 6, 6)), np.zeros((n, 6, p)), np.zeros((n, 6))
    a[0] = np.eye(6)
    for k in range(n - 1):
        a[k + 1] = phi[k] @ a[k]
        b[k + 1] = phi[k] @ b[k] + psi[k]
        c[k + 1] = phi[k] @ c[k] + gap[k]
    return a, b, c


def _noise_root(G: Array, noise: tuple[float, float]) -> Array:
    """Cholesky factors (n, 3, 3): an acceleration belongs to a place drawn about the orbit."""
    covariance = noise[1] ** 2 * np.eye(3) + noise[0] ** 2 * G @ G.mT
    size = np.trace(covariance, axis1=1, axis2=2)[:, None, None]
    root: Array = np.linalg.cholesky(covariance + 1e-4 * size * np.eye(3))
    return root
