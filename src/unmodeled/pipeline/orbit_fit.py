"""Batch least squares: initial states of arcs and shared parameters, from measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError, OrbitError
from unmodeled.datasets.measurement_effects import MeasurementEffect
from unmodeled.models.physics import Dynamics
from unmodeled.pipeline.fit_problem import STATE, Arc, FitProblem, Point

__all__ = ["Arc", "OrbitFit", "fit_orbits"]

_MAX_ITERATIONS = 30
#: Converged: no parameter moves by more than this share of its standard deviation ...
_STEP = 1e-6
#: ... or the cost falls by less than this share.
_COST = 1e-14
_MAX_EDITS = 10
#: With less damping than this a step is that of Gauss and Newton.
_LINEAR = 1e-3
#: A search takes a fit whose cost still creeps down by less than this.
_CREEP = 1.0


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

    @property
    def rms_in_sigmas(self) -> float:
        """Root mean square of all used residuals in their stated sigmas."""
        used = self.residuals[self.residuals["used"]]
        return float(np.sqrt(np.mean((used["residual"] / used["sigma"]) ** 2)))

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
    instruments: Sequence[MeasurementEffect] = (),
    instrument_values: Mapping[str, float] | None = None,
    edit_sigmas: float | None = None,
    settled: float = 0.0,
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
    instruments : sequence of MeasurementEffect
        What the instruments do to the measurements; their parameters can be estimated too.
    instrument_values : mapping of str to float
        Parameters of the instruments.
    edit_sigmas : float, optional
        Components whose residual exceeds this many sigmas after a fit are left out of the next,
        until none changes; they are marked in ``residuals``.
    settled : float
        Stop already when the cost falls by less than this, or by less than its millionth: for
        searches that need a fit good to a fraction of a sigma. 0: to convergence.

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
    problem = FitProblem(dynamics, arcs, estimate or {}, instruments, instrument_values)
    point = problem.start()
    used = [np.ones(m.values.size, dtype=bool) for arc in arcs for m in arc.measurements]
    iterations = 0
    for _ in range(_MAX_EDITS):
        point, count = _levenberg_marquardt(problem, point, used, settled)
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
    return _result(problem, point, used, iterations)


def _result(problem: FitProblem, point: Point, used: list[Array], iterations: int) -> OrbitFit:
    full = problem.normal_equations(point, used).dense()
    a, p = len(problem.arcs), len(problem.names)
    scale = 1.0 / np.sqrt(np.diag(full))
    size, axes = np.linalg.eigh(full * scale[:, None] * scale)
    if size[0] < 100 * np.finfo(float).eps * size[-1]:
        labels = [*(s for arc in problem.arcs for s in STATE), *problem.names]
        heavy = np.argsort(-np.abs(axes[:, 0]))[:2]
        raise NumericalError(
            "the normal equations are singular: "
            + " and ".join(sorted(labels[k] for k in heavy))
            + " cannot be told apart",
            do="estimate fewer parameters, or give priors",
        )
    covariance = (axes / size) @ axes.T * scale[:, None] * scale
    sigmas = np.sqrt(np.diag(covariance))[6 * a :]
    count = int(sum(u.sum() for u in used)) + int(np.sum(problem.prior > 0))
    return OrbitFit(
        states=point.states,
        values=dict(zip(problem.names, point.values.tolist(), strict=True)),
        sigmas=dict(zip(problem.names, sigmas.tolist(), strict=True)),
        covariance=covariance,
        labels=(*(f"{arc.name}: {s}" for arc in problem.arcs for s in STATE), *problem.names),
        residuals=problem.table(point, used),
        cost=problem.cost(point, used),
        freedom=count - 6 * a - p,
        iterations=iterations,
        dynamics=problem.model(point),
    )


def _levenberg_marquardt(
    problem: FitProblem, point: Point, used: list[Array], settled: float
) -> tuple[Point, int]:
    """Iterate to convergence; return the final point and the number of iterations."""
    unknowns = 6 * len(problem.arcs) + len(problem.names)
    count = int(sum(u.sum() for u in used)) + int(np.sum(problem.prior > 0))
    if count < unknowns:
        raise DataError(
            f"{count} measured components for {unknowns} unknowns",
            allowed="at least as many components as unknowns",
        )
    damping, cost, fell = 1e-6, problem.cost(point, used), np.inf
    for iteration in range(1, _MAX_ITERATIONS + 1):
        arrow = problem.normal_equations(point, used)
        problem.refuse_empty(arrow)
        enough = max(_COST * cost, settled, 1e-6 * cost if settled else 0.0)
        if settled and damping <= _LINEAR:
            states, values = arrow.solve(damping)
            expected = np.sum(states * arrow.right_states) + values @ arrow.right_shared
            if 0 <= expected <= enough:  # so near that the last step needs no check
                return Point(point.states + states, point.values + values), iteration
        while True:
            states, values = arrow.solve(damping)
            trial = Point(point.states + states, point.values + values)
            try:
                fresh = problem.cost(trial, used)
            except OrbitError:  # the step leads into the body: a shorter one will not
                fresh = np.inf
            moved = arrow.in_sigmas(states, values)
            if fresh <= cost + settled or moved < _STEP:
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
        if moved < _STEP or -settled <= fell <= enough:
            return point, iteration
    if settled and 0 <= fell < _CREEP:  # along a direction that the data hardly see
        return point, _MAX_ITERATIONS
    raise NumericalError(
        f"the orbit fit does not converge in {_MAX_ITERATIONS} iterations (cost {cost:.6g})",
        do="start nearer to the orbit, or use shorter arcs",
    )
