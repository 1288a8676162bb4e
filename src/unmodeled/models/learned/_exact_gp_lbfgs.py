"""L-BFGS-B on the marginal likelihoods, one component after another."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.optimize

from unmodeled.core.arrays import Array
from unmodeled.models.learned._exact_gp_likelihood import Evaluation, Indices
from unmodeled.models.learned.learner import Progress

__all__ = ["Objective", "maximise"]


class Objective(Protocol):
    """Negative log likelihoods of some problems, e.g. a `Likelihood`."""

    def __call__(self, log_theta: Array, *, which: Indices) -> Evaluation:
        """Evaluate problems ``which`` (k,) at ``log_theta`` (k, q)."""
        ...


def maximise(
    likelihood: Objective,
    start: Array,
    limits: tuple[Array, Array],
    iterations: int,
    progress: Progress,
) -> tuple[Array, Array, Array]:
    """Return the most likely points (k, q), their values (k,) and means (k,).

    Parameters
    ----------
    likelihood : Objective
        Of k components.
    start : ndarray (k, q)
        Logarithms of lengthscales, signal and noise variance at which each starts.
    limits : tuple of ndarray (q,)
        Least and largest logarithms.
    iterations : int
        L-BFGS steps for each component at most.
    progress : callable
        Told the share done.
    """
    found = []
    for i, first in enumerate(start):

        def tell(share: float, i: int = i) -> None:
            progress((i + share) / len(start))

        found.append(_maximise_one(likelihood, i, first, limits, iterations, tell))
    points, values, means = zip(*found, strict=True)
    return np.stack(points), np.array(values), np.array(means)


def _maximise_one(
    likelihood: Objective,
    index: int,
    first: Array,
    limits: tuple[Array, Array],
    iterations: int,
    tell: Progress,
) -> tuple[Array, float, float]:
    best = (np.inf, first, 0.0)
    steps = 0

    def objective(log_theta: Array) -> tuple[float, Array]:
        nonlocal best
        e = likelihood(log_theta[None], which=np.array([index]))
        value = float(e.value[0])
        if not np.isfinite(value):
            # A step into a singular kernel: worse than all before, so that the search turns.
            return min(best[0], 1e300) + 1e6, np.zeros(len(log_theta))
        if value < best[0]:
            best = (value, log_theta.copy(), float(e.mean[0]))
        return value, e.gradient[0]

    def step(intermediate: Array) -> None:
        nonlocal steps
        steps += 1
        tell(min(1.0, steps / iterations))

    scipy.optimize.minimize(  # type: ignore[call-overload]  # the stubs know no (value, gradient)
        objective,
        first,
        jac=True,
        method="L-BFGS-B",
        bounds=scipy.optimize.Bounds(*limits),
        callback=step,
        options={"maxiter": iterations},
    )
    return best[1], best[0], best[2]
