"""Climb a marginal likelihood in the logarithms of its hyperparameters, the best value kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.optimize

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.learned.learner import Progress

__all__ = ["most_likely"]

#: scipy's own default.
_SMALL_CHANGE = 2.220446049250313e-09


def most_likely(
    name: str,
    negative_log: Callable[[Array], tuple[float, Array]],
    theta: Array,
    limits: Sequence[tuple[float, float]],
    iterations: int,
    tell: Progress,
    enough: float = _SMALL_CHANGE,
) -> Array:
    """Return the most likely hyperparameters (p,) met by L-BFGS-B.

    Parameters
    ----------
    name : str
        Of the learner, for messages.
    negative_log : callable
        Logarithms (p,) to the negative log likelihood and its gradient (p,); infinite where the
        kernel is singular.
    theta : ndarray (p,)
        Where to start.
    limits : sequence of (float, float)
        Of each.
    iterations : int
        Steps at most.
    tell : callable
        Told the share of them that is done.
    enough : float
        Relative change of the likelihood in a step at which the search ends.

    Raises
    ------
    NumericalError
        If the likelihood was finite nowhere.
    """
    best, at, steps = np.inf, np.log(theta), 0

    def objective(log_theta: Array) -> tuple[float, Array]:
        nonlocal best, at
        value, gradient = negative_log(log_theta)
        if not np.isfinite(value):
            # A step into a singular kernel: worse than all before, so that the search turns.
            return min(best, 1e300) + 1e6, gradient
        if value < best:
            best, at = value, log_theta.copy()
        return value, gradient

    def step(intermediate: Array) -> None:
        nonlocal steps
        steps += 1
        tell(min(1.0, steps / iterations))

    low, high = np.log(limits).T
    scipy.optimize.minimize(  # type: ignore[call-overload]  # knows no (value, gradient)
        objective,
        np.clip(at, low, high),
        jac=True,
        method="L-BFGS-B",
        bounds=scipy.optimize.Bounds(low, high),
        callback=step,
        options={"maxiter": iterations, "ftol": enough},
    )
    if not np.isfinite(best):
        raise NumericalError(
            f"{name}: the marginal likelihood cannot be computed",
            do="raise noise_floor or remove repeated positions",
        )
    return np.exp(at)
