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

#: Revolutions of the first span: in a low orbit about a flat body an ellipse turns by a radian in
#: ten. Spans up to half as long again are taken whole.
_FIRST, _WHOLE = 10.0, 1.5
#: The span of the next fit over that of the last: its ends are known four times worse.
_WIDER = 2.0
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
    span = float(data.times[-1] - data.times[0])
    if span < _WHOLE * _FIRST * period:
        rows = slice(0, len(data.times))
    else:
        rows = _middle(data.times, _FIRST * period)
    guess = first_guess(data.times[rows], places[rows], data.gm, spread[rows])
    away = (places[rows] - guess[:, :3]) / spread[rows, None]
    tried = (
        f"tried from an ellipse through the middle {rows.stop - rows.start} of "
        f"{len(data.times)} samples (squared residuals {np.mean(away**2):.3g} of the stated noise)"
    )
    try:
        orbit = smooth_orbit(data.part(rows), field, guess, degree, prior)
        while rows.stop - rows.start < len(data.times):
            wider = _middle(data.times, _WIDER * (data.times[rows][-1] - data.times[rows][0]))
            start = _carried_on(data, field, degree, prior, orbit, rows, wider, period)
            rows, theta = wider, orbit.coefficients
            tried += f", then over {rows.stop - rows.start}"
            orbit = smooth_orbit(data.part(rows), field, start, degree, prior, theta)
    except NumericalError as error:
        raise NumericalError(f"{error.found}; {tried}", do=error.do or _DO) from error
    return orbit


def _middle(times: Array, span: float) -> slice:
    """Return the samples in so long a time about the middle one."""
    middle = times[len(times) // 2]
    inside = np.flatnonzero(np.abs(times - middle) <= 0.5 * span)
    return slice(int(inside[0]), int(inside[-1]) + 1)


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
