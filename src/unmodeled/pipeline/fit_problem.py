"""Residuals, partial derivatives and normal equations of a set of arcs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, nearest
from unmodeled.core.parameters import Parameter
from unmodeled.datasets.measurement_effects import MeasurementEffect
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics
from unmodeled.models.physics.continuous_orbit import ContinuousOrbit
from unmodeled.pipeline.arrow import Arrow
from unmodeled.pipeline.partials import ArcPartials

__all__ = ["STATE", "Arc", "FitProblem", "Point"]

STATE = ("x", "y", "z", "vx", "vy", "vz")
#: A parameter whose typical change moves all measurements together by fewer sigmas is not there.
_EMPTY = 1e-9
#: ... its typical change being at least this share of itself (GM of the Sun has 21 digits).
_SHARE = 1e-9
#: A trial may take this many times the steps of the last orbit, and some more.
_FAR = 30
_SOME = 1000
#: Orbits that are kept of each arc.
_KEPT = 2
#: Share by which the state of an arc may move before its panels are laid out anew: they only have
#: to be short enough everywhere.
_SAME = 1e-4


@dataclass(frozen=True)
class Arc:
    """One arc: its own initial state, and what was measured on it.

    Parameters
    ----------
    epoch : float
        Time of the initial state, s; not after the first measurement.
    state : ndarray (6,)
        First guess of the initial state, m and m/s, inertial.
    measurements : tuple of Measurements
        At least one.
    name : str
        In tables.
    """

    epoch: float
    state: Array
    measurements: tuple[Measurements, ...]
    name: str = "arc"

    def __post_init__(self) -> None:
        object.__setattr__(self, "state", as_array(self.state, (6,), f"{self.name}: state"))
        if not self.measurements:
            raise DataError(f"{self.name} has no measurements")
        first = min(float(m.times[0]) for m in self.measurements)
        if first < self.epoch:
            raise DataError(
                f"{self.name}: a measurement at {first:.6g} s precedes the initial state at "
                f"{self.epoch:.6g} s",
                do="give the state at or before the first measurement",
            )


@dataclass(frozen=True)
class Point:
    """Where an iteration stands: states (a, 6) of the arcs, values (p,) of the parameters."""

    states: Array
    values: Array


class FitProblem:
    """What a fit minimises.

    Parameters
    ----------
    dynamics : Dynamics
        Force model with first guesses.
    arcs : sequence of Arc
        At least one.
    estimate : mapping of str to float or None
        Shared parameters with the sigma of their priors; of the forces or of the instruments.
    instruments : sequence of MeasurementEffect
        What the instruments do to the measurements.
    instrument_values : mapping of str to float
        Parameters of the instruments.
    """

    def __init__(
        self,
        dynamics: Dynamics,
        arcs: Sequence[Arc],
        estimate: Mapping[str, float | None],
        instruments: Sequence[MeasurementEffect] = (),
        instrument_values: Mapping[str, float] | None = None,
    ) -> None:
        if not arcs:
            raise DataError("an orbit fit without arcs")
        self.dynamics, self.arcs, self.instruments = dynamics, tuple(arcs), tuple(instruments)
        known = {p.name: p for p in dynamics.parameters}
        declared = {p.name: p for effect in self.instruments for p in effect.parameters}
        given = dict(instrument_values or {})
        for name in given:
            if name not in declared:
                raise ConfigError(
                    f'unknown instrument parameter "{name}"', do=nearest(name, declared)
                )
        known |= {n: p.with_value(given.get(n, p.value)) for n, p in declared.items()}
        for name, prior in estimate.items():
            if name not in known:
                raise ConfigError(f'unknown parameter "{name}"', do=nearest(name, known))
            if prior is not None and not (np.isfinite(prior) and prior > 0):
                raise ConfigError(
                    f"prior of {name} is {prior}", allowed="a standard deviation > 0, or None"
                )
        self.names = tuple(estimate)
        self.parameters: list[Parameter] = [known[name] for name in self.names]
        self.first = np.array([p.value for p in self.parameters])
        self.prior = np.array([0.0 if s is None else 1.0 / s**2 for s in estimate.values()])
        self.forces = tuple(n for n in self.names if n not in declared)
        self._given = {n: known[n].value for n in declared}
        self._edges: dict[int, tuple[ContinuousOrbit, Array]] = {}
        self._flown: dict[int, list[tuple[bytes, ContinuousOrbit]]] = {}

    def start(self) -> Point:
        """Return the first guess."""
        return Point(np.array([arc.state for arc in self.arcs]), self.first)

    def model(self, point: Point) -> Dynamics:
        """Return the force model at a point, its parameters kept inside their bounds."""
        return self.dynamics.with_values({n: v for n, v in self._values(point) if n in self.forces})

    def instrument_values(self, point: Point) -> dict[str, float]:
        """Return the parameters of the instruments at a point."""
        return self._given | {n: v for n, v in self._values(point) if n in self._given}

    def applied(self, point: Point) -> list[tuple[Measurements, ...]]:
        """Return the measurements of each arc as the instruments make them."""
        values = self.instrument_values(point)
        out = []
        for arc in self.arcs:
            changed = []
            for m in arc.measurements:
                for effect in self.instruments:
                    if effect.concerns(m):
                        m = effect.applied(m, values)
                changed.append(m)
            out.append(tuple(changed))
        return out

    def normalised(self, point: Point) -> list[Array]:
        """Return residuals in sigmas, one flat array for each set of measurements."""
        model, out = self.model(point), []
        for a, sets in enumerate(self.applied(point)):
            orbit = self._orbit(model, point, a, sets)
            for m in sets:
                out.append((m.residuals(orbit.states(m.times)) / m.sigmas).ravel())
        return out

    def cost(self, point: Point, used: list[Array]) -> float:
        """Return the sum of squares of the used residuals, plus that of the priors."""
        pairs = zip(self.normalised(point), used, strict=True)
        deviation = point.values - self.first
        return float(sum(np.sum(r[u] ** 2) for r, u in pairs) + self.prior @ deviation**2)

    def linearised(
        self, point: Point
    ) -> Iterator[tuple[int, ArcPartials, list[tuple[Measurements, Array, Array]]]]:
        """Yield of each arc: its number, the orbit's partials, and of each set of measurements.

        The last is a list of (measurements as applied, whitened residuals (n,), whitened columns
        (n, 6 + p)): states first, then the shared parameters.
        """
        model = self.model(point)
        for a, (arc, sets) in enumerate(zip(self.arcs, self.applied(point), strict=True)):
            times = np.unique(np.concatenate([m.times for m in sets]))
            orbit = self._orbit(model, point, a, sets)
            edges = self._near_edges(a, orbit)
            partials = ArcPartials(model, arc.epoch, point.states[a], times, orbit, edges)
            self._edges[a] = (orbit, partials.edges)
            accelerations = model.parameter_partials(
                partials.node_states, self.forces, partials.nodes
            )
            force = partials.response(accelerations)
            blocks = []
            for m in sets:
                index = np.searchsorted(times, m.times)
                states = partials.states[index]
                h = m.partials(states)
                columns = np.zeros((*m.values.shape, 6 + len(self.names)))
                columns[:, :, :6] = h @ partials.transition[index]
                columns[:, :, 6 + self._at(self.forces)] = h @ force[index]
                for names, part in self.instrument_columns(model, self.instruments, m, states):
                    columns[:, :, 6 + self._at(names)] = part
                columns /= m.sigmas[:, :, None]
                residual = (m.residuals(states) / m.sigmas).ravel()
                blocks.append((m, residual, columns.reshape(residual.size, -1)))
            yield a, partials, blocks

    def instrument_columns(
        self,
        model: Dynamics,
        effects: Sequence[MeasurementEffect],
        m: Measurements,
        states: Array,
    ) -> Iterator[tuple[tuple[str, ...], Array]]:
        """Yield the estimated parameters of each effect and d predicted / d parameter (n, k, p)."""
        for effect in effects:
            wanted = [i for i, p in enumerate(effect.parameters) if p.name in self.names]
            if wanted and effect.concerns(m):
                part = effect.partials(m, states, model.acceleration(states, m.times))
                yield tuple(effect.parameters[i].name for i in wanted), part[:, :, wanted]

    def normal_equations(self, point: Point, used: list[Array]) -> Arrow:
        """Return the normal equations at a point."""
        p = len(self.names)
        N, C = np.zeros((len(self.arcs), 6, 6)), np.zeros((len(self.arcs), 6, p))
        S, g = np.diag(self.prior), np.zeros((len(self.arcs), 6))
        h = self.prior * (self.first - point.values)
        masks = iter(used)
        for a, _, blocks in self.linearised(point):
            for _, residual, columns in blocks:
                mask = next(masks)
                A, r = columns[mask], residual[mask]
                N[a] += A[:, :6].T @ A[:, :6]
                C[a] += A[:, :6].T @ A[:, 6:]
                S = S + A[:, 6:].T @ A[:, 6:]
                g[a] += A[:, :6].T @ r
                h = h + A[:, 6:].T @ r
        return Arrow(N, C, S, g, h)

    def refuse_empty(self, arrow: Arrow) -> None:
        """Refuse parameters and state components that no measurement depends on."""
        for p, size in zip(self.parameters, np.diag(arrow.shared), strict=True):
            # A change by the parameter's scale moves the measurements by rounding only.
            if np.sqrt(size) * max(p.scale, _SHARE * abs(p.value)) < _EMPTY:
                raise DataError(
                    f"the measurements do not depend on {p.name}: its column is empty",
                    do="do not estimate it from these data",
                )
        for arc, block in zip(self.arcs, arrow.blocks, strict=True):
            if np.any(np.diag(block) == 0):
                name = STATE[int(np.argmin(np.diag(block)))]
                raise DataError(f"{arc.name}: the measurements do not depend on {name}")

    def table(self, point: Point, used: list[Array]) -> pd.DataFrame:
        """Return the residuals, a row a measured component."""
        frames = []
        sets = [(arc, m) for arc in self.arcs for m in arc.measurements]
        for (arc, m), r, u in zip(sets, self.normalised(point), used, strict=True):
            frames.append(
                pd.DataFrame(
                    {
                        "arc": arc.name,
                        "label": m.label,
                        "component": np.tile(m.components, len(m.times)),
                        "t_s": np.repeat(m.times, len(m.components)),
                        "residual": r * m.sigmas.ravel(),
                        "sigma": m.sigmas.ravel(),
                        "used": u,
                    }
                )
            )
        return pd.concat(frames, ignore_index=True)

    def _orbit(
        self, model: Dynamics, point: Point, a: int, sets: Sequence[Measurements]
    ) -> ContinuousOrbit:
        """Orbit of an arc at a point; a residual and its partials come from one propagation."""
        key = point.states[a].tobytes() + point.values.tobytes()
        known = self._flown.setdefault(a, [])
        for same, orbit in known:
            if same == key:
                return orbit
        epoch = self.arcs[a].epoch
        start = min(epoch, *(float(m.times.min()) for m in sets))
        end = max(epoch, *(float(m.times.max()) for m in sets))
        # A trial that needs far more steps than where the fit began falls into a centre.
        most = _FAR * known[0][1].steps + _SOME if known else None
        orbit = model.fly(point.states[a], epoch, start, end, most)
        # The present iterate and the last trial: a trial that is refused leads back.
        self._flown[a] = [*known[-_KEPT + 1 :], (key, orbit)]
        return orbit

    def _near_edges(self, a: int, orbit: ContinuousOrbit) -> Array | None:
        """Panels of the last linearisation of an arc if its orbit was nearly the same."""
        if a not in self._edges:
            return None
        last, edges = self._edges[a]
        moved = np.linalg.norm((orbit.state - last.state).reshape(2, 3), axis=1)
        near = bool(np.all(moved < _SAME * np.linalg.norm(orbit.state.reshape(2, 3), axis=1)))
        return edges if near and (last.start, last.end) == (orbit.start, orbit.end) else None

    def _values(self, point: Point) -> Iterator[tuple[str, float]]:
        for p, v in zip(self.parameters, point.values, strict=True):
            yield p.name, float(np.clip(v, p.lower, p.upper))

    def _at(self, names: Sequence[str]) -> Array:
        return np.array([self.names.index(n) for n in names], dtype=int)
