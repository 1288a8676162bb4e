"""How well a model predicts arcs that it was not fitted to, and how well it should."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy.linalg
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.result import Forecast
from unmodeled.pipeline.fit_problem import FitProblem, Point
from unmodeled.pipeline.orbit_fit import OrbitFit, fit_orbits

__all__ = ["held_out_forecast", "held_out_rms"]


def held_out_rms(case: Case) -> float | None:
    """Return the residual RMS of the held-out arcs in sigmas; None if there are none.

    Their initial states are fitted, nothing else: the parameters are those of the case.
    """
    fit = _fit(case)
    return fit.rms_in_sigmas if fit is not None else None


def held_out_forecast(
    case: Case, fit: OrbitFit, nulls: Mapping[str, float], noise: float
) -> Forecast | None:
    """Return what the covariance of a fit says of the held-out residuals; None without any.

    Parameters
    ----------
    case : Case
        With all that was found, at the values of ``fit``.
    fit : OrbitFit
        Its fit.
    nulls : mapping of str to float
        What the estimated parameters are in the model as given; a place that was searched has none
        and counts as known.
    noise : float
        Standard deviation of the residuals in stated sigmas.

    Notes
    -----
    With M what the arcs' own states leave, H the partials of the parameters and C their
    covariance: the residuals have the covariance M (noise^2 I + H C H') M. Without an effect they
    also have the mean M H theta, to first order in theta.
    """
    held = _fit(case)
    if held is None:
        return None
    problem = FitProblem(
        case.dynamics, case.held_out, case.estimate, case.instruments, case.instrument_values
    )
    names = problem.names
    values = np.array([fit.values[n] for n in names])
    change = values - np.array([nulls.get(n, fit.values[n]) for n in names])
    first = len(fit.covariance) - len(names)
    root = noise * _root(fit.covariance[first:, first:])
    rows, missed, own = [], [], []
    for _, _, blocks in problem.linearised(Point(held.states, values)):
        columns = np.concatenate([c for _, _, c in blocks])
        left, mine = _without(columns[:, :6], columns[:, 6:])
        rows.append(left)
        missed.append(left @ change)
        own.append(mine)
    H = np.concatenate(rows)
    count, freedom = len(H), len(H) - sum(own)
    # The eigenvalues of the covariance: noise^2, and more in the directions of the parameters.
    reach = np.linalg.svd(H @ root, compute_uv=False) ** 2
    mean = noise**2 * freedom + float(reach.sum())
    sizes = noise**2 * np.ones(freedom)
    sizes[: len(reach)] += reach
    # Chi-square with the mean and variance of the weighted sum.
    scale = float(np.sum(sizes**2) / np.sum(sizes))
    seen = float(np.sum(_normalised(held) ** 2))
    log_p = float(scipy.stats.chi2.logsf(seen / scale, mean / scale))
    signal = float(np.sum(np.concatenate(missed) ** 2)) - float(reach.sum())
    before = noise**2 * freedom + max(signal, 0.0)
    return Forecast(
        float(np.sqrt(before / count)), float(np.sqrt(mean / count)), log_p / np.log(10.0)
    )


def _fit(case: Case) -> OrbitFit | None:
    if not case.held_out:
        return None
    return fit_orbits(
        case.dynamics,
        case.held_out,
        instruments=case.instruments,
        instrument_values=case.instrument_values,
    )


def _root(covariance: Array) -> Array:
    """Return a square root of a covariance whose units differ by many powers of ten."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    size, axes = np.linalg.eigh(covariance / scale[:, None] / scale)
    root: Array = scale[:, None] * axes * np.sqrt(np.maximum(size, 0.0))
    return root


def _without(states: Array, columns: Array) -> tuple[Array, int]:
    """Return the part of columns that the states cannot absorb, and the rank of the states."""
    size = np.linalg.norm(states, axis=0)
    basis, r, _ = scipy.linalg.qr(
        states / np.where(size > 0, size, 1.0), mode="economic", pivoting=True
    )
    rank = int(np.sum(np.abs(np.diag(r)) > 1e-13))
    basis = basis[:, :rank]
    left: Array = columns - basis @ (basis.T @ columns)
    return left - basis @ (basis.T @ left), rank


def _normalised(fit: OrbitFit) -> Array:
    used = fit.residuals[fit.residuals["used"]]
    return np.asarray(used["residual"] / used["sigma"], dtype=float)
