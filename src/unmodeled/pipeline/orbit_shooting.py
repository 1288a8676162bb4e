"""Multiple shooting: one orbit as states at many times that the field carries into each other.

All intervals between the times are integrated side by side with their variational equations
([Bock1984]), outward from one of them, so that a field is asked about all of them at once. Gaps are
closed to all orders: on states with gaps the transition matrices of many revolutions do not belong
together, and their product grows without bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.models.physics.exterior_harmonics import derivative, exterior_harmonics

__all__ = ["Field", "HarmonicField", "Shot", "shoot"]

Indices: TypeAlias = npt.NDArray[np.intp]
#: Acceleration (n, 3) and gradient (n, 3, 3) at positions (n, 3).
Field: TypeAlias = Callable[[Array], tuple[Array, Array]]

#: Steps of fourth order between two samples; 25 samples a period make 400 steps of it.
_STEPS = 16
#: Doublings of the usual time between samples that these steps still serve.
_LONG = 0.5
#: Slopes and gaps beyond this are those of an orbit that fell apart.
_WILD = 1e8
#: Farthest that a gap moves a state at once, as a share of its radius.
_REACH = 0.3
#: Times that gaps are closed before the states count as no orbit.
_CLOSINGS = 8


class HarmonicField:
    """A field plus solid harmonics: acceleration, gradient, and slopes by the free coefficients.

    Parameters
    ----------
    field : callable
        What is known of it.
    degree : int
        Highest degree of the harmonics, fully normalised, reference radius 1.
    free : ndarray of int
        Which coefficients are not held at zero.
    gm : float
        Scale of the coefficients.
    """

    def __init__(self, field: Field, degree: int, free: Indices, gm: float) -> None:
        self._field, self._degree, self.free, self.gm = field, degree, free, gm

    def __call__(self, x: Array, theta: Array) -> tuple[Array, Array, Array]:
        """Return acceleration (n, 3), gradient (n, 3, 3) and slopes (n, 3, p) at places (n, 3)."""
        value, G = self._field(x)
        if not len(self.free):
            return value, G, np.empty((len(x), 3, 0))
        table = exterior_harmonics(x, self._degree + 2)
        first = [derivative(table, i) for i in range(3)]
        H = self.gm * np.stack([f[: len(theta)].T for f in first], axis=1)
        own = np.empty_like(G)
        for i in range(3):
            for j in range(i, 3):
                own[:, i, j] = own[:, j, i] = theta @ derivative(first[i], j)[: len(theta)]
        return value + H @ theta, G + self.gm * own, H[:, :, self.free]


@dataclass(frozen=True)
class Shot:
    """States that are one orbit but for small gaps, and how they follow one of them.

    Parameters
    ----------
    states : ndarray (n, 6)
        At the times given.
    theta : ndarray (q,)
        All coefficients of the harmonics.
    design : ndarray (n, 6, 6 + p)
        Slopes of the states by the one held and the free coefficients.
    gaps : ndarray (n, 6)
        What the states lack of an orbit, to first order.
    """

    states: Array
    theta: Array
    design: Array
    gaps: Array

    @property
    def positions(self) -> Array:
        """Of the orbit, (n, 3)."""
        return self.states[:, :3] + self.gaps[:, :3]


def shoot(
    model: HarmonicField,
    times: Array,
    states: Array,
    theta: Array,
    closed: float,
    held: int | None = None,
) -> Shot | None:
    """Return the orbit through one of nearby states; None if they lead to none.

    Parameters
    ----------
    model : HarmonicField
        Where it flies.
    times : ndarray (n,)
        Increasing.
    states : ndarray (n, 6)
        First guess of the orbit.
    theta : ndarray (q,)
        All coefficients of the harmonics.
    closed : float
        Largest gap that may be left in a position.
    held : int, optional
        Which state stays as it is; the middle one if not given, so that shots are short.
    """
    held, states = len(times) // 2 if held is None else held, states.copy()
    ahead, back = np.arange(held, len(times) - 1), np.arange(held, 0, -1)
    starts, ends = np.concatenate([ahead, back]), np.concatenate([ahead + 1, back - 1])
    for _ in range(_CLOSINGS):
        came, phi, psi = _integrate(model, theta, states[starts], times[ends] - times[starts])
        if not (np.isfinite(came).all() and np.isfinite(phi).all() and np.isfinite(psi).all()):
            return None
        design = np.zeros((len(times), 6, 6 + len(model.free)))
        gaps = np.zeros((len(times), 6))
        design[held, :, :6] = np.eye(6)
        for i, (k, j) in enumerate(zip(starts, ends, strict=True)):
            design[j] = phi[i] @ design[k]
            design[j, :, 6:] += psi[i]
            gaps[j] = phi[i] @ gaps[k] + came[i] - states[j]
        if not np.abs(design).max() < _WILD or not np.abs(gaps).max() < _WILD:
            return None
        far = np.linalg.norm(gaps[:, :3], axis=1)
        if far.max() < closed:
            return Shot(states, theta, design, gaps)
        share = _REACH * np.linalg.norm(states[:, :3], axis=1) / np.maximum(far, 1e-300)
        states += np.minimum(1.0, share)[:, None] * gaps
    return None


def _integrate(
    model: HarmonicField, theta: Array, states: Array, steps: Array
) -> tuple[Array, Array, Array]:
    """Return ends (n, 6) of all intervals, their transition (n, 6, 6) and slopes (n, 6, p)."""
    n, p = len(states), len(model.free)
    big = np.zeros((n, 6, 7 + p))
    big[:, :, 0], big[:, :, 1:7] = states, np.eye(6)
    # Gaps between the samples take more steps, by powers of two.
    length = np.abs(steps)
    doublings = np.ceil(np.log2(np.maximum(length / np.median(length), 1.0)) - _LONG).astype(int)
    doublings = np.maximum(doublings, 0)
    for k in np.unique(doublings):
        rows = doublings == k
        big[rows] = _flown(model, theta, big[rows], steps[rows], _STEPS * 2 ** int(k))
    return big[:, :, 0], big[:, :, 1:7], big[:, :, 7:]


def _flown(model: HarmonicField, theta: Array, big: Array, steps: Array, count: int) -> Array:
    h = (steps / count)[:, None, None]

    def rate(now: Array) -> Array:
        value, G, H = model(now[:, :3, 0], theta)
        out = np.empty_like(now)
        out[:, :3] = now[:, 3:]
        out[:, 3:, 0] = value
        out[:, 3:, 1:] = G @ now[:, :3, 1:]
        out[:, 3:, 7:] += H
        return out

    with np.errstate(all="ignore"):  # what is not finite is found by the caller
        for _ in range(count):
            if not np.isfinite(big).all():
                break
            one = rate(big)
            two = rate(big + 0.5 * h * one)
            three = rate(big + 0.5 * h * two)
            four = rate(big + h * three)
            big = big + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return big
