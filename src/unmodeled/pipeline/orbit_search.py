"""An orbit through noisy samples without any first guess, over spans that grow."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.pipeline.orbit_data import OrbitData
from unmodeled.pipeline.orbit_guess import ellipse_through, first_guess, revolution
from unmodeled.pipeline.orbit_shooting import Field, HarmonicField, shoot
from unmodeled.pipeline.orbit_smoothing import SmoothedOrbit, smooth_orbit

__all__ = ["search_orbit"]

#: Revolutions of the first span, and the fewest: in a low orbit about Bennu an ellipse turns by a
#: radian in ten.
_FIRST, _SHORTEST = 10.0, 2.5
#: Fewest samples in it, and how much longer one is taken whole.
_FEWEST, _WHOLE = 25, 1.5
#: Most that an ellipse may miss the samples by, beside their noise, as a share of its size.
_MISS = 0.5
#: Standard deviations of the squared noise that are put down to chance.
_SIGMAS = 4.0
#: The span of the next fit over that of the last: its ends are known four times worse.
_WIDER = 2.0
#: How far the fits converge, in standard deviations: that of the whole, and of a part.
_SETTLED, _ENOUGH = 0.01, 0.3
#: How nearly an orbit carried on is one, in positions.
_CARRIED = 1e-6
_DO = "give a longer or less noisy trajectory, or a lower degree"


def search_orbit(data: OrbitData, field: Field, degree: int, prior: Array) -> SmoothedOrbit:
    """Fit an orbit in ``field`` plus harmonics to samples, from nothing but them and the mass.

    An ellipse through the revolutions in the middle, both from the positions and from where a
    point mass would pull as observed, starts `smooth_orbit` there. The orbit is then carried on
    and fitted over twice the span, until it is all of it.

    Parameters
    ----------
    data : OrbitData
        What was observed.
    field : callable
        What is known of the field: nearly that of a point mass.
    degree : int
        Highest degree of the harmonics.
    prior : ndarray (p,)
        Standard deviations of their coefficients; 0 holds one at zero.

    Raises
    ------
    DataError
        For too few samples.
    NumericalError
        If no orbit is found; it says what was tried.
    """
    places, spread = data.averaged()
    period = revolution(places, data.gm, spread)
    rows, guess = _ellipse(data.times, places, spread, data.gm, period)
    count = len(data.times)
    square = np.mean(((places[rows] - guess[:, :3]) / spread[rows, None]) ** 2)
    tried = (
        f"tried from an ellipse through the middle {len(guess)} of {count} samples "
        f"(squared residuals {square:.3g} of the stated noise)"
    )
    theta = None
    try:
        while True:
            part, whole = data.part(rows), rows == slice(0, count)
            enough = _SETTLED if whole else _ENOUGH
            orbit = smooth_orbit(part, field, guess, degree, prior, theta, settled=enough)
            if whole:
                return orbit
            wider = _middle(data.times, _WIDER * (part.times[-1] - part.times[0]))
            guess = _carried_on(data, field, degree, prior, orbit, rows, wider, period)
            rows, theta = wider, orbit.coefficients
            tried += f", then over {len(guess)}"
    except NumericalError as error:
        raise NumericalError(f"{error.found}; {tried}", do=error.do or _DO) from error


def _ellipse(
    times: Array, places: Array, spread: Array, gm: float, period: float
) -> tuple[slice, Array]:
    """Return the samples of the first span, and states there.

    Where an ellipse turns too much over ten revolutions there are fewer; where two fit alike, more.
    """
    revolutions, longer = _FIRST, False
    while True:
        rows = _middle(times, revolutions * period)
        try:
            guess = first_guess(times[rows], places[rows], gm, spread[rows])
        except NumericalError:
            if rows == slice(0, len(times)) or revolutions < _FIRST:
                raise
            revolutions, longer = 2.0 * revolutions, True
            continue
        noise, size = np.mean(spread[rows] ** 2), np.mean(guess[:, :3] ** 2)
        square = np.mean((places[rows] - guess[:, :3]) ** 2)
        chance = _SIGMAS * np.sqrt(2.0 / places[rows].size) * noise
        if square - noise - chance < _MISS**2 * size:
            return rows, guess
        if longer or revolutions <= _SHORTEST:
            raise NumericalError(
                f"no ellipse about the mass meets {len(times)} samples: the nearest to the middle "
                f"{len(guess)} misses them by {np.sqrt(square / size):.2g} of its size, and the "
                f"stated noise is {np.sqrt(noise / size):.2g}",
                do="check the times, the mass, the units and the noise; use a shorter part",
            )
        revolutions /= 2.0


def _middle(times: Array, span: float) -> slice:
    """Return the samples in so long a time about the middle one, or all if few are left."""
    if times[-1] - times[0] < _WHOLE * span:
        return slice(0, len(times))
    middle = times[len(times) // 2]
    inside = np.flatnonzero(np.abs(times - middle) <= 0.5 * span)
    first = min(int(inside[0]), len(times) // 2 - _FEWEST // 2)
    last = max(int(inside[-1]), len(times) // 2 + _FEWEST // 2)
    return slice(max(first, 0), min(last + 1, len(times)))


def _carried_on(
    data: OrbitData,
    field: Field,
    degree: int,
    prior: Array,
    orbit: SmoothedOrbit,
    rows: slice,
    wider: slice,
    period: float,
) -> Array:
    """Return states (n, 6) of an orbit over more samples, a revolution after the other."""
    model = HarmonicField(field, degree, np.flatnonzero(prior), data.gm)
    out = np.empty((len(data.times), 6))
    out[rows] = orbit.states
    first, last = rows.start, rows.stop - 1
    times, theta = data.times, orbit.coefficients
    while first > wider.start or last < wider.stop - 1:
        if last < wider.stop - 1:
            k = last
            last = min(_within(times, k, period), wider.stop - 1)
            block = slice(k, last + 1)
        else:
            k = first
            first = max(_within(times, k, -period), wider.start)
            block = slice(first, k + 1)
        held = k - block.start
        guess = ellipse_through(out[k], times[block] - times[k], data.gm)
        shot = None if guess is None else shoot(model, times[block], guess, theta, _CARRIED, held)
        if shot is None:
            raise NumericalError(f"the orbit cannot be carried on from time {times[k]:.6g}", do=_DO)
        out[block] = shot.states
    return out[wider]


def _within(times: Array, k: int, reach: float) -> int:
    """Return the farthest sample within a time of another, the next one at least."""
    if reach > 0:
        return max(k + 1, int(np.searchsorted(times, times[k] + reach, side="right")) - 1)
    return min(k - 1, int(np.searchsorted(times, times[k] + reach)))
