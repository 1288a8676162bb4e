"""Accelerations, and missing velocities, from a table of states by local least squares.

For each sample a polynomial in time is fitted to the positions *and* velocities of the samples
around it, each weighted with its stated noise, and differentiated at the sample (Savitzky and
Golay's idea [SavitzkyGolay1964], for uneven sampling and for two kinds of data at once).  Windows
never cross a gap.  Polynomials of several degrees on windows of several widths are tried, and
each sample keeps the pair whose estimated total error is smallest.  That error is

* the formal one: the covariance of the fit, enlarged where the residuals exceed the noise, and
* truncation: the difference from a fit that is two degrees higher, minus the part of it that
  noise explains.  (Nested fits: the variance of their difference is the difference of variances.)

Known limit: where a table is so coarse that no polynomial follows it (25 samples a revolution at
eccentricity 0.75), the error is underestimated several times, but the estimate is then of the
size of the acceleration itself, and a warning says so.

The smoother knows no physics: it must be given inertial axes, where an orbit is smooth.
"""

from __future__ import annotations

import itertools
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import DataError, UnmodeledWarning
from unmodeled.datasets.local_polynomials import LocalFit
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["Smoothed", "smooth", "with_accelerations"]

_DEGREES = (4, 6, 8, 10, 12, 14)
# Window widths in samples, as multiples of the number of unknowns.  The first is for tables with
# velocities only: two data a sample.
_REDUNDANCIES = (0.75, 1.2, 1.7, 2.5, 4.0)
# An acceleration that is uncertain by more than this share of itself teaches nothing.
_USELESS = 0.1


@dataclass(frozen=True)
class Smoothed:
    """Derivatives of a table, with the error of each sample.

    Parameters
    ----------
    accelerations, velocities : ndarray (n, 3)
        m/s2 and m/s; velocities are the fitted ones.
    sigma, velocity_sigma : ndarray (n,)
        Estimated standard error of one component, formal and truncation together.
    formal : ndarray (n,)
        The formal part of ``sigma``, m/s2.
    degree, width : ndarray (n,)
        Degree of the polynomial and number of samples in the window that were chosen.
    """

    accelerations: Array
    velocities: Array
    sigma: Array
    velocity_sigma: Array
    formal: Array
    degree: npt.NDArray[np.int64]
    width: npt.NDArray[np.int64]


def smooth(
    times: npt.ArrayLike,
    positions: npt.ArrayLike,
    velocities: npt.ArrayLike | None = None,
    *,
    position_noise: float | None = None,
    velocity_noise: float | None = None,
    gap: float | None = None,
) -> Smoothed:
    """Differentiate a table of states.

    Parameters
    ----------
    times : array_like (n,)
        Seconds, increasing; steps may differ.
    positions : array_like (n, 3)
        Metres along inertial axes.
    velocities : array_like (n, 3), optional
        Metres per second relative to inertial axes; leave out if the table has none.
    position_noise, velocity_noise : float, optional
        Standard deviation of one component, m and m/s; for numbers rounded to a quantum q it is
        q / sqrt(12).  Estimated from the table's own roughness where left out.
    gap : float, optional
        A longer step, s, starts a new piece; 5 median steps by default.

    Returns
    -------
    Smoothed

    Raises
    ------
    DataError
        If the table is malformed, or a piece between two gaps is too short.
    """
    t = as_array(times, ("n",), "times")
    check_increasing(t, "time")
    data = [as_array(positions, (len(t), 3), "positions")]
    if velocities is not None:
        data.append(as_array(velocities, (len(t), 3), "velocities"))
    bounds = _pieces(t, gap)
    noise = [
        _roughness(t, values, bounds) if given is None else _positive(given, name)
        for values, given, name in zip(
            data, (position_noise, velocity_noise), ("position", "velocity"), strict=False
        )
    ]
    found = [_smooth_piece(t[a:b], [d[a:b] for d in data], noise) for a, b in bounds]
    names = Smoothed.__dataclass_fields__
    return Smoothed(**{k: np.concatenate([getattr(f, k) for f in found]) for k in names})


def with_accelerations(
    trajectory: Trajectory,
    *,
    position_noise: float | None = None,
    velocity_noise: float | None = None,
    gap: float | None = None,
    use_velocities: bool = True,
) -> Trajectory:
    """Return the trajectory with smoothed accelerations, their error and a note.

    Parameters
    ----------
    trajectory : Trajectory
        In inertial axes; its positions and velocities are kept as they are.
    position_noise, velocity_noise, gap
        As in :func:`smooth`.
    use_velocities : bool
        False where the velocities themselves came from the smoother: they know nothing new.

    Returns
    -------
    Trajectory
        ``acceleration_sigma`` is the median over the samples; ``notes["accelerations"]`` says
        how they were made, with the largest error (at the ends of each piece).

    Raises
    ------
    DataError
        If the frame is not inertial, or the table cannot be smoothed.
    """
    if trajectory.frame != "inertial":
        raise DataError(
            f"accelerations cannot be smoothed in the {trajectory.frame} frame",
            allowed="inertial",
            do="turn the trajectory to inertial axes first",
        )
    made = smooth(
        trajectory.times,
        trajectory.positions,
        trajectory.velocities if use_velocities else None,
        position_noise=position_noise,
        velocity_noise=velocity_noise,
        gap=gap,
    )
    size = np.linalg.norm(made.accelerations, axis=1)
    coarse = int(np.sum(made.sigma > _USELESS * size))
    if coarse > len(size) / 20:
        warnings.warn(
            f"{trajectory.source or 'trajectory'}: {coarse} of {len(size)} smoothed accelerations "
            f"are uncertain by more than {_USELESS:.0%}: the samples are too far apart or too "
            "noisy; give accelerations, or sample more densely",
            UnmodeledWarning,
            stacklevel=2,
        )
    note = {
        "method": "local least-squares polynomials on positions"
        + (" and velocities" if use_velocities else ""),
        "median_sigma_m_s2": float(np.median(made.sigma)),
        "largest_sigma_m_s2": float(made.sigma.max()),
        "degrees": sorted({int(d) for d in made.degree}),
        "widths": [int(made.width.min()), int(made.width.max())],
    }
    return replace(
        trajectory,
        accelerations=made.accelerations,
        acceleration_sigma=float(np.median(made.sigma)),
        notes={**trajectory.notes, "accelerations": note},
    )


def _positive(value: float, name: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise DataError(f"{name}_noise is {value}", allowed="a number > 0")
    return float(value)


def _pieces(t: Array, gap: float | None) -> list[tuple[int, int]]:
    """Index ranges without a gap."""
    steps = np.diff(t)
    limit = 5 * float(np.median(steps)) if gap is None else gap
    cuts = [0, *(int(k) + 1 for k in np.flatnonzero(steps > limit)), len(t)]
    pieces = list(itertools.pairwise(cuts))
    least = _window(_DEGREES[0] + 2, _REDUNDANCIES[1])
    for a, b in pieces:
        if b - a < least:
            raise DataError(
                f"the table has {b - a} samples from {t[a]:.3f} s to {t[b - 1]:.3f} s between "
                "gaps, too few to differentiate",
                allowed=f"at least {least}",
                do="leave them out, give accelerations, or set a longer gap",
            )
    return pieces


def _window(degree: int, redundancy: float) -> int:
    """Return an odd number of samples."""
    count = int(np.ceil(redundancy * (degree + 1)))
    return count + 1 - count % 2


def _smooth_piece(t: Array, data: list[Array], noise: list[float]) -> Smoothed:
    best: dict[str, Any] = {}
    n = len(t)
    for degree in _DEGREES:
        widths = {_window(degree + 2, r) for r in _REDUNDANCIES if r * len(data) > 1}
        for width in sorted(w for w in widths if w <= n):
            low = LocalFit(t, data, noise, degree, width)
            high = LocalFit(t, data, noise, degree + 2, width)
            trial = _errors(low, high)
            better = trial["sigma"] < best["sigma"] if best else np.ones(n, dtype=bool)
            for name, values in trial.items():
                chosen = better[:, None] if values.ndim == 2 else better
                best[name] = np.where(chosen, values, best.get(name, values))
    whole = {k: best.pop(k).astype(np.int64) for k in ("degree", "width")}
    return Smoothed(**best, degree=whole["degree"], width=whole["width"])


def _errors(low: LocalFit, high: LocalFit) -> dict[str, Array]:
    """Total error of the lower fit at each sample, for acceleration and velocity."""
    width = low.width
    # The higher fit's residuals hold less truncation: they tell how far to trust the noise.
    scale = np.maximum(1.0, high.residual_scale)
    out = {
        "accelerations": low.second,
        "velocities": low.first,
        "degree": np.full(len(scale), low.degree, dtype=np.float64),
        "width": np.full(len(scale), width, dtype=np.float64),
        "formal": low.second_sigma * scale,
    }
    for name, values, others, low_sigma, high_sigma in (
        ("sigma", low.second, high.second, low.second_sigma, high.second_sigma),
        ("velocity_sigma", low.first, high.first, low.first_sigma, high.first_sigma),
    ):
        excess = np.mean((values - others) ** 2, axis=1)
        explained = (high_sigma**2 - low_sigma**2) * scale**2
        # One difference is a poor estimate: average it over neighbours, but not from the inside
        # of the piece to its ends, where windows are one-sided and errors larger.
        truncation = np.maximum(_local_mean(excess, width) - explained, 0.0)
        out[name] = np.sqrt((low_sigma * scale) ** 2 + truncation)
    return out


def _local_mean(values: Array, width: int) -> Array:
    half = width // 2
    padded = np.cumsum(np.concatenate([[0.0], values]))
    k = np.arange(len(values))
    # Towards an end the neighbourhood shrinks, down to the sample itself.
    reach = np.minimum(half, np.minimum(k, len(values) - 1 - k) // 2)
    means: Array = (padded[k + reach + 1] - padded[k - reach]) / (2 * reach + 1)
    return np.maximum(means, values) if half == 0 else means


def _roughness(t: Array, values: Array, bounds: list[tuple[int, int]]) -> float:
    """Noise of a column: the smallest residual of local polynomials of several degrees."""
    found = []
    for degree in _DEGREES:
        width = _window(degree, 1.0) + 6
        scales = [
            LocalFit(t[a:b], [values[a:b]], [1.0], degree, width).residual_scale
            for a, b in bounds
            if b - a >= width
        ]
        if scales:
            found.append(float(np.median(np.concatenate(scales))))
    # Never below the rounding of the numbers themselves.
    floor = float(np.finfo(np.float64).eps * np.abs(values).max())
    return max([floor, min(found, default=0.0)])
