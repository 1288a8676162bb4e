"""Where an orbit starts, from its own measurements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError, OrbitError
from unmodeled.datasets.elements import kepler_period
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics, SphericalHarmonics
from unmodeled.pipeline.cases.cut_arcs import Piece
from unmodeled.pipeline.cases.known_effects import Known
from unmodeled.pipeline.orbit_fit import Arc, fit_orbits

__all__ = ["first_guess"]

#: Part of a revolution to which a polynomial is fitted, and the part of it that is kept if it is
#: sparse: this many points at least.
_QUARTER, _POINTS = 0.25, 6
#: Revolutions of the fits that follow, each half of the next at least: a poor model converges on
#: few of them.
_WINDOWS = (1.0, 4.0)
#: Share of the radius within which all positions must be for a fit to start.
_NEAR = 0.01
#: Degree to which a field is flown on the way: 1e-5 of the attraction is left out about the Earth.
_ROUGH = 4


def first_guess(dynamics: Dynamics, piece: Piece, known: Known) -> Array:
    """Return an initial state from which the fit of an arc converges.

    The state of the case file if there is one; else the first measured state; else positions: a
    polynomial over a quarter of a revolution, then fits over one revolution, four, and all, until
    the whole arc lies near the orbit.

    Parameters
    ----------
    dynamics : Dynamics
        The known model, which may lack much.
    piece : Piece
        The arc.
    known : Known
        For the effects of the instruments.

    Returns
    -------
    ndarray (6,)
        At ``piece.start``, m and m/s, along the axes of the forces.

    Raises
    ------
    DataError
        If the arc has neither a state nor positions, too few of them, or does not converge.
    """
    if piece.state is not None:
        return piece.state
    kinds = {m.kind: m for m in piece.measurements}
    if "position_velocity" in kinds:
        m = kinds["position_velocity"]
        state, at = m.values[0].copy(), float(m.times[0])
    elif "position" in kinds:
        m = kinds["position"]
        state, at = _grown(dynamics, m, piece.name, known), float(m.times[0])
    else:
        raise DataError(
            f"{piece.name} has {', '.join(sorted(kinds))} but no positions to start from",
            do="give initial_state: {position: ..., velocity: ...}",
        )
    if at > piece.start:
        state = dynamics.propagate(state, np.array([at, piece.start]))[-1]
    return np.asarray(state)


def _grown(dynamics: Dynamics, m: Measurements, name: str, known: Known) -> Array:
    """State at the first position."""
    if len(m.times) < _POINTS:
        raise DataError(
            f"{name} has {len(m.times)} positions",
            allowed=f"{_POINTS} or more",
            do="use longer arcs, or give initial_state",
        )
    since = m.times - m.times[0]
    gm = dynamics.values.get("GM", 0.0)
    radius = float(np.median(np.linalg.norm(m.values, axis=1)))
    period = float(kepler_period(radius, gm)) if gm > 0 else float(since[-1])
    light = _light(dynamics)
    state = _from_polynomial(m, max(_QUARTER * period, float(since[_POINTS - 1])))
    instruments = tuple(e for e in known.instruments if e.concerns(m))
    names = {p.name for e in instruments for p in e.parameters}
    values = {n: v for n, v in (known.instrument_values or {}).items() if n in names}
    whole = float(since[-1]) / period
    for revolutions in (*(w for w in _WINDOWS if 2 * w < whole), whole):
        last = revolutions == whole
        if last and _is_near(light, state, m, radius):
            break
        inside = since <= (
            since[-1] if last else max(revolutions * period, float(since[_POINTS - 1]))
        )
        arc = Arc(float(m.times[0]), state, (m.subset(inside),), name)
        try:
            # Each window only has to lead to the next: a fall of one a measurement is no matter.
            fit = fit_orbits(
                dynamics if last else light,
                [arc],
                instruments=instruments,
                instrument_values=values,
                settled=float(inside.sum()),
            )
        except (NumericalError, OrbitError) as exc:
            raise DataError(
                f"{name} does not converge over {revolutions:g} revolutions with the known model "
                f"({exc.found})",
                do="use shorter arcs, or give initial_state",
            ) from exc
        state = fit.states[0]
    return state


def _light(dynamics: Dynamics) -> Dynamics:
    """Return the model with its field cut off: what is left out moves no orbit out of reach."""
    effects = [
        replace(e, degree=_ROUGH, order=min(_ROUGH, _ROUGH if e.order is None else e.order))
        if isinstance(e, SphericalHarmonics) and e.min_degree <= _ROUGH < e.degree
        else e
        for e in dynamics.effects
    ]
    if all(e in dynamics.effects for e in effects):
        return dynamics
    return dynamics.with_effects(effects, {})


def _is_near(dynamics: Dynamics, state: Array, m: Measurements, radius: float) -> bool:
    """Whether a fit of the whole arc can start from here: the orbit stays near its positions."""
    try:
        miss = dynamics.propagate(state, m.times)[:, :3] - m.values[:, :3]
    except OrbitError:
        return False
    return float(np.abs(miss).max()) < _NEAR * radius


def _from_polynomial(m: Measurements, length: float) -> Array:
    """Position and velocity at the first time, from a polynomial over a length of time."""
    since = m.times - m.times[0]
    inside = since <= length
    t = since[inside] / max(length, 1e-12)
    # Enough terms for a quarter of a revolution, few enough to smooth.
    degree = min(5, int(inside.sum()) - 1)
    powers = np.vander(t, degree + 1, increasing=True)
    coefficients = np.linalg.lstsq(powers, m.values[inside, :3], rcond=None)[0]
    return np.concatenate([coefficients[0], coefficients[1] / length])
