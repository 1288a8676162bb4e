"""Learners fitted to a force along the orbit; the one that predicts left-out stretches is taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, NumericalError
from unmodeled.models.learned import ExactGP, Learner, NoiseLevel, RBFNetwork
from unmodeled.pipeline.comparison.force_dependence import Option
from unmodeled.pipeline.comparison.force_inference import ForceData
from unmodeled.pipeline.comparison.left_out import left_out_errors, skill_and_error, stretches
from unmodeled.pipeline.comparison.residual_table import Index
from unmodeled.pipeline.diagnosis.learned_force import LearnedForce

__all__ = ["LearnerSkill", "learn_force"]

#: Centres of the network: a third of the nodes, at most this many.
_CENTRES = 40


@dataclass(frozen=True)
class LearnerSkill:
    """How well a learner predicts stretches of the measurements that were left out.

    Parameters
    ----------
    name : str
        Of the learner.
    skill, skill_error : float
        Share of their sum of squares that it explains (0: none; may be negative), and its
        standard error.
    """

    name: str
    skill: float
    skill_error: float


def learn_force(
    data: ForceData, option: Option
) -> tuple[LearnedForce | None, tuple[LearnerSkill, ...]]:
    """Fit learners to the force as a function of chosen inputs.

    Parameters
    ----------
    data : ForceData
        Residuals, and what a force does to them.
    option : Option
        The inputs; its posterior gives the samples and their noise.

    Returns
    -------
    model : LearnedForce or None
        The best one, fitted to everything; None if none could be fitted.
    skills : tuple of LearnerSkill
        Best first.

    Notes
    -----
    A stretch of time is left out of the measurements, not of the samples: the force is inferred
    anew from the rest, the learner is fitted to that, states and free parameters are fitted to
    the rest, and the stretch is predicted. Samples of neighbouring epochs would know each other.
    """
    turn, inputs = data.turn(option.inputs), data.inputs(option.inputs)
    parts = list(stretches(data.lin))
    none = np.zeros((len(data.residual), 0))
    nothing = left_out_errors(data.known, none, data.residual, parts)
    mean = option.smooth.mean()
    unit = float(np.sqrt(np.mean(mean**2)))
    if not unit > 0:
        return None, ()
    samples = [_without(data, option, turn, part) for part in parts]
    found: list[tuple[LearnerSkill, Learner]] = []
    for make in (_process, _network):
        try:
            errors = [
                _error(
                    data,
                    turn,
                    part,
                    unit * _fitted(make(len(inputs)), inputs, *s, unit).predict(inputs),
                )
                for part, s in zip(parts, samples, strict=True)
            ]
            whole = _fitted(make(len(inputs)), inputs, mean, option.smooth.sigma(), unit)
        except (NumericalError, DataError):
            continue
        skill = skill_and_error(np.array(errors), nothing)
        found.append((LearnerSkill(whole.name, *skill), whole))
    if not found:
        return None, ()
    top = max((f[0] for f in found), key=lambda s: s.skill)
    # Of those that cannot be told apart, a process: far from its data it returns to its mean.
    near = top.skill - top.skill_error
    found.sort(key=lambda f: (f[0].skill >= near and f[1].has_covariance, f[0].skill), reverse=True)
    lin = data.lin
    model = LearnedForce(found[0][1], option.inputs, unit, lin.model, lin.case.body)
    return model, tuple(f[0] for f in found)


def _process(count: int) -> Learner:
    return ExactGP(optimizer="lbfgs")


def _network(count: int) -> Learner:
    return RBFNetwork(centres=max(min(count // 3, _CENTRES), 2))


def _fitted(learner: Learner, inputs: Array, mean: Array, sigma: Array, unit: float) -> Learner:
    return learner.fit(inputs, mean / unit, NoiseLevel(samples=sigma / unit))


def _without(data: ForceData, option: Option, turn: Array, part: Index) -> tuple[Array, Array]:
    """Posterior mean and sigma (h, 3) of the force from all rows but those of a part."""
    found, root = option.smooth.found, option.smooth.root
    rest = np.setdiff1d(np.arange(len(data.residual)), part)
    basis = _basis(data.known[rest])
    rows = data.rows(turn, root)[rest]
    rows = rows - basis @ (basis.T @ rows)
    r = data.residual[rest] - basis @ (basis.T @ data.residual[rest])
    normal = rows.T @ rows + np.eye(rows.shape[1]) / found.size**2
    factor = scipy.linalg.cho_factor(normal, lower=True)
    mean = root @ scipy.linalg.cho_solve(factor, rows.T @ r)
    half = scipy.linalg.solve_triangular(factor[0], root.T, lower=True)
    sigma = np.sqrt(found.variance * np.sum(half**2, axis=0))
    return mean.reshape(-1, 3), sigma.reshape(-1, 3)


def _error(data: ForceData, turn: Array, part: Index, force: Array) -> float:
    """Sum of squares of a part, the force given, states and parameters fitted to the rest."""
    left = data.residual - data.rows(turn, force.reshape(-1, 1))[:, 0]
    rest = np.setdiff1d(np.arange(len(left)), part)
    # What the rest does not determine stays as it is: the smallest change.
    known, *_ = np.linalg.lstsq(data.known[rest], left[rest], rcond=1e-9)
    error = left[part] - data.known[part] @ known
    return float(error @ error)


def _basis(columns: Array) -> Array:
    basis, size, _ = scipy.linalg.svd(columns, full_matrices=False)
    kept: Array = basis[:, size > 1e-5]
    return kept
