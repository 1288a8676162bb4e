"""Batch least squares: initial states of arcs and shared parameters, from measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import ConfigError, DataError, NumericalError, OrbitError, nearest
from unmodeled.datasets.measurements import Measurements
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.arrow import Arrow

__all__ = ["Arc", "OrbitFit", "fit_orbits"]

_STATE = ("x", "y", "z", "vx", "vy", "vz")
_MAX_ITERATIONS = 30
#: Converged: no parameter moves by more than this share of its standard deviation ...
_STEP = 1e-6
#: ... or the cost falls by less than this share.
_COST = 1e-14
_MAX_EDITS = 10
#: A parameter whose typical change moves all measurements together by fewer sigmas is not there.
_EMPTY = 1e-9


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
class OrbitFit:
    """The result of a fit, at its final iterate.

    Parameters
    ----------
    states : ndarray (a, 6)
        Initial state of each arc.
    values, sigmas : dict of str to float
        Estimated shared parameters and their standard deviations.
    covariance : ndarray (6a + p, 6a + p)
        Of all states, then all parameters, in the order of ``labels``.
    labels : tuple of str
        Names of the rows of the covariance.
    residuals : DataFrame
        One row a measured component: arc, label, component, t_s, residual (SI, measured minus
        predicted), sigma, used (False: edited out).
    cost : float
        Sum of squared normalised residuals of the used components plus the prior terms.
    freedom : int
        Used components plus priors minus estimated quantities.
    iterations : int
        Of all rounds of editing together.
    dynamics : Dynamics
        The model with the estimated values.
    """

    states: Array
    values: dict[str, float]
    sigmas: dict[str, float]
    covariance: Array
    labels: tuple[str, ...]
    residuals: pd.DataFrame = field(repr=False)
    cost: float
    freedom: int
    iterations: int
    dynamics: Dynamics = field(repr=False)

    def rms(self) -> pd.DataFrame:
        """Root mean square of the used residuals, in SI and in sigmas, a row a data type."""
        used = self.residuals[self.residuals["used"]]
        kind = np.where(used["component"].str.startswith("v"), "velocity, m/s", "position, m")
        table = pd.DataFrame(
            {
                "label": used["label"],
                "type": kind,
                "square": used["residual"] ** 2,
                "normalised": (used["residual"] / used["sigma"]) ** 2,
            }
        )
        grouped = table.groupby(["label", "type"])[["square", "normalised"]]
        means = grouped.mean()
        return pd.DataFrame(
            {
                "rms": means["square"] ** 0.5,
                "rms_in_sigmas": means["normalised"] ** 0.5,
                "count": grouped.size(),
            }
        ).reset_index()


def fit_orbits(
    dynamics: Dynamics,
    arcs: Sequence[Arc],
    estimate: Mapping[str, float | None] | None = None,
    *,
    edit_sigmas: float | None = None,
) -> OrbitFit:
    """Fit initial states and shared parameters by Levenberg-Marquardt.

    Partial derivatives come from the variational equations. The normal equations of several arcs
    have the shape of an arrow, so that arcs cost in proportion to their number. Columns are
    scaled by their own norm.

    Parameters
    ----------
    dynamics : Dynamics
        Force model with first guesses of its parameters.
    arcs : sequence of Arc
        Each with its own initial state.
    estimate : mapping of str to float or None
        Names of parameters to estimate, each with the standard deviation of its prior about the
        value in ``dynamics``, or None for no prior.
    edit_sigmas : float, optional
        Components whose residual exceeds this many sigmas after a fit are left out of the next,
        until none changes; they are marked in ``residuals``.

    Raises
    ------
    ConfigError
        Unknown parameter, prior that is not positive.
    DataError
        Fewer measurements than unknowns, or a parameter that does not act on them.
    OrbitError
        If the first guess cannot be propagated.
    NumericalError
        If the iteration does not converge.
    """
    problem = _Problem(dynamics, tuple(arcs), dict(estimate or {}))
    point = problem.start()
    used = [np.ones(m.values.size, dtype=bool) for arc in arcs for m in arc.measurements]
    iterations = 0
    for _ in range(_MAX_EDITS):
        point, count = _levenberg_marquardt(problem, point, used)
        iterations += count
        if edit_sigmas is None:
            break
        fresh = [np.abs(r) <= edit_sigmas for r in problem.normalised(point)]
        if all(np.array_equal(a, b) for a, b in zip(fresh, used, strict=True)):
            break
        used = fresh
    else:
        raise NumericalError(
            f"editing at {edit_sigmas} sigmas does not settle in {_MAX_EDITS} rounds",
            do="check the stated sigmas, or edit at more sigmas",
        )
    return problem.result(point, used, iterations)


@dataclass(frozen=True)
class _Point:
    states: Array
    values: Array


class _Problem:
    """Residuals, partials and normal equations of a set of arcs."""

    def __init__(
        self, dynamics: Dynamics, arcs: tuple[Arc, ...], estimate: dict[str, float | None]
    ) -> None:
        if not arcs:
            raise DataError("an orbit fit without arcs")
        known = {p.name: p for p in dynamics.parameters}
        for name, prior in estimate.items():
            if name not in known:
                raise ConfigError(f'unknown parameter "{name}"', do=nearest(name, known))
            if prior is not None and not (np.isfinite(prior) and prior > 0):
                raise ConfigError(
                    f"prior of {name} is {prior}", allowed="a standard deviation > 0, or None"
                )
        self.dynamics, self.arcs, self.names = dynamics, arcs, tuple(estimate)
        self.parameters = [known[name] for name in self.names]
        self.first = np.array([p.value for p in self.parameters])
        self.prior = np.array([0.0 if s is None else 1.0 / s**2 for s in estimate.values()])
        self.grids = [
            np.unique(np.concatenate([[arc.epoch], *(m.times for m in arc.measurements)]))
            for arc in arcs
        ]

    def start(self) -> _Point:
        return _Point(np.array([arc.state for arc in self.arcs]), self.first)

    def model(self, point: _Point) -> Dynamics:
        clipped = {
            p.name: float(np.clip(v, p.lower, p.upper))
            for p, v in zip(self.parameters, point.values, strict=True)
        }
        return self.dynamics.with_values(clipped)

    def normalised(self, point: _Point) -> list[Array]:
        """Residuals in sigmas, one flat array for each set of measurements."""
        model = self.model(point)
        out = []
        for arc, grid, state in zip(self.arcs, self.grids, point.states, strict=True):
            states = model.propagate(state, grid) if len(grid) > 1 else state[None]
            for m in arc.measurements:
                at = states[np.searchsorted(grid, m.times)]
                out.append(((m.values - m.predicted(at)) / m.sigmas).ravel())
        return out

    def cost(self, point: _Point, used: list[Array]) -> float:
        pairs = zip(self.normalised(point), used, strict=True)
        deviation = point.values - self.first
        return float(sum(np.sum(r[u] ** 2) for r, u in pairs) + self.prior @ deviation**2)

    def normal_equations(self, point: _Point, used: list[Array]) -> Arrow:
        model, p = self.model(point), len(self.names)
        N, C = np.zeros((len(self.arcs), 6, 6)), np.zeros((len(self.arcs), 6, p))
        S, g = np.diag(self.prior), np.zeros((len(self.arcs), 6))
        h = self.prior * (self.first - point.values)
        masks = iter(used)
        for a, (arc, grid) in enumerate(zip(self.arcs, self.grids, strict=True)):
            if len(grid) > 1:
                orbit = model.propagate_variational(point.states[a], grid, self.names)
                states = orbit.states
                sensitivity = np.concatenate([orbit.transition, orbit.sensitivity], axis=2)
            else:
                states = point.states[a][None]
                sensitivity = np.concatenate([np.eye(6), np.zeros((6, p))], axis=1)[None]
            for m in arc.measurements:
                index = np.searchsorted(grid, m.times)
                residual = ((m.values - m.predicted(states[index])) / m.sigmas).ravel()
                columns = m.partials(states[index]) @ sensitivity[index] / m.sigmas[:, :, None]
                mask = next(masks)
                A, r = columns.reshape(-1, 6 + p)[mask], residual[mask]
                N[a] += A[:, :6].T @ A[:, :6]
                C[a] += A[:, :6].T @ A[:, 6:]
                S = S + A[:, 6:].T @ A[:, 6:]
                g[a] += A[:, :6].T @ r
                h = h + A[:, 6:].T @ r
        return Arrow(N, C, S, g, h)

    def refuse_empty(self, arrow: Arrow) -> None:
        for p, size in zip(self.parameters, np.diag(arrow.shared), strict=True):
            # A change by the parameter's scale moves the measurements by rounding only.
            if np.sqrt(size) * p.scale < _EMPTY:
                raise DataError(
                    f"the measurements do not depend on {p.name}: its column is empty",
                    do="do not estimate it from these data",
                )
        for arc, block in zip(self.arcs, arrow.blocks, strict=True):
            if np.any(np.diag(block) == 0):
                name = _STATE[int(np.argmin(np.diag(block)))]
                raise DataError(f"{arc.name}: the measurements do not depend on {name}")

    def result(self, point: _Point, used: list[Array], iterations: int) -> OrbitFit:
        full = self.normal_equations(point, used).dense()
        a, p = len(self.arcs), len(self.names)
        scale = 1.0 / np.sqrt(np.diag(full))
        size, axes = np.linalg.eigh(full * scale[:, None] * scale)
        if size[0] < 100 * np.finfo(float).eps * size[-1]:
            labels = [*(s for arc in self.arcs for s in _STATE), *self.names]
            heavy = np.argsort(-np.abs(axes[:, 0]))[:2]
            raise NumericalError(
                "the normal equations are singular: "
                + " and ".join(sorted(labels[k] for k in heavy))
                + " cannot be told apart",
                do="estimate fewer parameters, or give priors",
            )
        covariance = (axes / size) @ axes.T * scale[:, None] * scale
        sigmas = np.sqrt(np.diag(covariance))[6 * a :]
        count = int(sum(u.sum() for u in used)) + int(np.sum(self.prior > 0))
        return OrbitFit(
            states=point.states,
            values=dict(zip(self.names, point.values.tolist(), strict=True)),
            sigmas=dict(zip(self.names, sigmas.tolist(), strict=True)),
            covariance=covariance,
            labels=(*(f"{arc.name}: {s}" for arc in self.arcs for s in _STATE), *self.names),
            residuals=self._table(point, used),
            cost=self.cost(point, used),
            freedom=count - 6 * a - p,
            iterations=iterations,
            dynamics=self.model(point),
        )

    def _table(self, point: _Point, used: list[Array]) -> pd.DataFrame:
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


def _levenberg_marquardt(problem: _Problem, point: _Point, used: list[Array]) -> tuple[_Point, int]:
    """Iterate to convergence; return the final point and the number of iterations."""
    unknowns = 6 * len(problem.arcs) + len(problem.names)
    count = int(sum(u.sum() for u in used)) + int(np.sum(problem.prior > 0))
    if count < unknowns:
        raise DataError(
            f"{count} measured components for {unknowns} unknowns",
            allowed="at least as many components as unknowns",
        )
    damping, cost = 1e-6, problem.cost(point, used)
    for iteration in range(1, _MAX_ITERATIONS + 1):
        arrow = problem.normal_equations(point, used)
        problem.refuse_empty(arrow)
        while True:
            states, values = arrow.solve(damping)
            trial = _Point(point.states + states, point.values + values)
            try:
                fresh = problem.cost(trial, used)
            except OrbitError:  # the step leads into the body: a shorter one will not
                fresh = np.inf
            moved = arrow.in_sigmas(states, values)
            if fresh <= cost or moved < _STEP:
                break
            damping *= 10.0
            if damping > 1e12:
                raise NumericalError(
                    f"the orbit fit stalls at iteration {iteration} (cost {cost:.6g})",
                    do="start nearer to the orbit, or use shorter arcs",
                )
        fell = cost - fresh
        if fresh <= cost:
            point, cost = trial, fresh
        damping = max(damping / 10.0, 1e-15)
        if moved < _STEP or 0 <= fell <= _COST * cost:
            return point, iteration
    raise NumericalError(
        f"the orbit fit does not converge in {_MAX_ITERATIONS} iterations (cost {cost:.6g})",
        do="start nearer to the orbit, or use shorter arcs",
    )
