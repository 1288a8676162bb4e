"""Marginal likelihood of an RBF process with its gradient in closed form, maximised by L-BFGS.

One Cholesky factorisation and one inverse serve the value and all derivatives, [Rasmussen2006]
Eq. 5.9: a tenth of the evaluations of Adam, each cheaper than automatic differentiation.
"""

from __future__ import annotations

import numpy as np
import scipy.optimize
from scipy.linalg import LinAlgError, cholesky
from scipy.linalg.lapack import dpotri

from unmodeled.core.arrays import Array
from unmodeled.core.errors import NumericalError
from unmodeled.models.learned._distances import squared_distances
from unmodeled.models.learned.learner import Progress

__all__ = ["likelihood_and_gradient", "maximise"]

#: Bounds of the lengthscale and the signal variance in scaled units.
_LENGTHS, _SIGNALS = (1e-2, 1e3), (1e-12, 1e8)


def likelihood_and_gradient(
    log_theta: Array, square: Array, target: Array, own: Array | float = 0.0
) -> tuple[float, Array, float]:
    """Return the negative log marginal likelihood, its gradient and the best constant mean.

    Parameters
    ----------
    log_theta : ndarray (3,)
        Logarithms of lengthscale, signal variance and noise variance.
    square : ndarray (n, n)
        Squared distances of the samples.
    target : ndarray (n,)
        One component. The constant mean is at its optimum, so that it adds nothing to the
        gradient.
    own : ndarray (n,)
        Known noise variance of each sample, beside the estimated one.

    Raises
    ------
    LinAlgError
        If the kernel matrix is not positive definite in float64.
    """
    length, signal, noise = np.exp(log_theta)
    smooth = np.exp(square * (-0.5 / length**2))
    smooth *= signal
    kernel = smooth.copy()
    kernel.flat[:: len(kernel) + 1] += noise + own
    factor = cholesky(kernel, lower=True, overwrite_a=True, check_finite=False)
    logdet = 2 * float(np.log(np.diag(factor)).sum())
    inverse, info = dpotri(factor, lower=1, overwrite_c=1)
    if info:
        raise LinAlgError(f"inverse from the factor failed ({info})")
    # LAPACK fills the lower triangle only.
    inverse = np.tril(inverse)
    inverse += np.tril(inverse, -1).T
    rows = inverse.sum(axis=1)
    mean = float(rows @ target / rows.sum())
    weights = inverse @ (target - mean)
    value = 0.5 * (
        float((target - mean) @ weights) + logdet + len(target) * float(np.log(2 * np.pi))
    )
    inverse -= np.outer(weights, weights)
    trace = float(np.trace(inverse))
    smooth *= inverse
    gradient = 0.5 * np.array(
        [float((smooth * square).sum()) / length**2, float(smooth.sum()), noise * trace]
    )
    return value, gradient, mean


def maximise(
    x: Array,
    t: Array,
    start: Array,
    noise_floor: float,
    iterations: int,
    progress: Progress,
    own: Array | None = None,
) -> Array:
    """Return the most likely hyperparameters (4, 3): lengthscale, signal, noise, mean.

    Parameters
    ----------
    x, t : ndarray (n, 3)
        Scaled positions and targets.
    start : ndarray (4, 3)
        Where each component starts.
    noise_floor : float
        Least noise variance, scaled.
    iterations : int
        L-BFGS steps for each component at most.
    progress : callable
        Told the share done.
    own : ndarray (n, 3), optional
        Known noise variances of the samples, scaled.

    Raises
    ------
    NumericalError
        If the likelihood cannot be computed even at the start.
    """
    square = squared_distances(x, x)
    low, high = np.log([_LENGTHS, _SIGNALS, (noise_floor, 1e4)]).T
    columns = []
    for i in range(3):
        first = np.clip(np.log(start[:3, i]), low, high)

        def tell(share: float, i: int = i) -> None:
            progress((i + share) / 3)

        mine = 0.0 if own is None else own[:, i]
        columns.append(_maximise_one(square, t[:, i], mine, first, (low, high), iterations, tell))
    progress(1.0)
    return np.stack(columns, axis=1)


def _maximise_one(
    square: Array,
    target: Array,
    own: Array | float,
    first: Array,
    limits: tuple[Array, Array],
    iterations: int,
    tell: Progress,
) -> Array:
    """Return lengthscale, signal, noise and mean of one component, (4,)."""
    best = (np.inf, first, 0.0)
    steps = 0

    def objective(log_theta: Array) -> tuple[float, Array]:
        nonlocal best
        try:
            value, gradient, mean = likelihood_and_gradient(log_theta, square, target, own)
        except LinAlgError:
            # A step into a singular kernel: worse than all before, so that the search turns.
            return best[0] + 1e6, np.zeros(3)
        if value < best[0]:  # False for NaN
            best = (value, log_theta.copy(), mean)
        return value, gradient

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
    if not np.isfinite(best[0]):
        raise NumericalError(
            f"exact_gp: the marginal likelihood of {len(target)} samples cannot be computed",
            do="raise noise_floor or remove repeated positions",
        )
    return np.append(np.exp(best[1]), best[2])
