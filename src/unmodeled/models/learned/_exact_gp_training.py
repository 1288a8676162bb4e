"""Training of `ExactGP`: from the best start of a grid, by Adam, L-BFGS or Newton's method.

Hyperparameters travel as an array ``theta`` (l + 3, 3) in scaled units: rows are lengthscales
(l = 1, or one for each input), signal variance, noise variance and mean, columns the acceleration
components.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import expit

from unmodeled.core.arrays import Array
from unmodeled.models.learned._distances import squared_distances
from unmodeled.models.learned._exact_gp_lbfgs import maximise
from unmodeled.models.learned._exact_gp_likelihood import Likelihood
from unmodeled.models.learned._exact_gp_newton import minimise
from unmodeled.models.learned._kernels import correlation
from unmodeled.models.learned.learner import Progress

__all__ = ["adam", "best_start", "limits", "optimum"]

#: The grid of starts, in scaled units: lengthscales, and noise variance per signal variance.
_LENGTHS = (0.3, 1.0, 3.0)
_NOISES = (1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0)
#: The grid is judged on about this many samples at most: it only picks a start.
_SAMPLES = 500
#: Bounds of lengthscale, signal variance and noise variance in scaled units.
_LENGTH_LIMITS, _SIGNAL_LIMITS, _MOST_NOISE = (1e-2, 1e3), (1e-12, 1e8), 1e4
#: Most signal variance per least noise variance: n times this bounds the condition number, and
#: above 1e16 the likelihood itself is rounding, on which an optimiser loses its way.
_MOST_CONTRAST = 1e12
#: Adam's decay rates and the guard of its quotient, [Kingma2015].
_BETA_1, _BETA_2, _EPSILON = 0.9, 0.999, 1e-8


def best_start(
    x: Array,
    t: Array,
    noise_floor: float,
    known_noise: float,
    kernel: str = "rbf",
    lengths: int = 1,
) -> Array:
    """Return the most likely hyperparameters of a small grid, by component.

    At each lengthscale one eigendecomposition gives the likelihood at every noise level, with
    the signal variance at its maximum in closed form.

    Parameters
    ----------
    x, t : ndarray (n, d), (n, 3)
        Scaled inputs and targets.
    noise_floor : float
        Least noise variance, scaled.
    known_noise : float
        Known noise variance, scaled; 0 if unknown. Replaces the grid's.
    kernel : str
        Of `_kernels.KERNELS`.
    lengths : int
        How many lengthscales; all start the same.
    """
    step = -(-len(x) // _SAMPLES)
    x, mean = x[::step], t.mean(axis=0)
    square = squared_distances(x, x)
    found = []
    for length in _LENGTHS:
        values, vectors = np.linalg.eigh(correlation(kernel, (1.0 / length**2) * square))
        energy = (vectors.T @ (t[::step] - mean)) ** 2
        for ratio in _NOISES:
            # Eigenvalues below the rounding of the largest are noise themselves.
            total = (np.maximum(values, 0.0) + max(ratio, 1e-15 * values[-1]))[:, None]
            signal = np.maximum((energy / total).mean(axis=0), 10 * noise_floor)
            nll = 0.5 * (
                len(x) * np.log(signal) + np.log(total).sum() + (energy / total).sum(0) / signal
            )
            noise = np.full(3, known_noise) if known_noise else ratio * signal
            theta = [
                *np.full((lengths, 3), length),
                signal,
                np.maximum(noise, 2 * noise_floor),
                mean,
            ]
            found.append((nll, np.stack(theta)))
    best = np.argmin([nll for nll, _ in found], axis=0)
    return np.stack([found[k][1][:, i] for i, k in enumerate(best)], axis=1)


def adam(
    likelihood: Likelihood,
    starts: Sequence[Array],
    noise_floor: float,
    epochs: int,
    learning_rate: float,
    progress: Progress,
) -> list[Array]:
    """Maximise the likelihood by Adam at a constant rate; return the best ``theta`` of each.

    Steps are taken in gpytorch's raw hyperparameters (softplus, the noise above its floor, the
    mean as it is) on its objective, the mean over samples: the same course as gpytorch's own, at
    a third of its cost. Of all epochs the best one is kept, for each component.

    Parameters
    ----------
    likelihood : Likelihood
        Of ``b`` data sets.
    starts : sequence of ndarray (l + 3, 3)
        ``theta`` at which each begins.
    noise_floor : float
        Least noise variance, scaled.
    epochs, learning_rate
        Steps and rate of Adam.
    progress : callable
        Told the share done.

    Returns
    -------
    list of ndarray (l + 3, 3)
        Infinite where the likelihood cannot be computed even at the start.
    """
    theta = _columns(starts)
    floor = np.zeros(theta.shape[1] - 1)
    floor[-1] = noise_floor
    raw = np.column_stack([_inverse_softplus(theta[:, :-1] - floor), theta[:, -1]])
    moment, square = np.zeros_like(raw), np.zeros_like(raw)
    best, kept = np.full(len(raw), np.inf), np.full_like(raw, np.inf)
    active = np.arange(len(raw), dtype=np.int64)
    for epoch in range(epochs + 1):
        positive = np.logaddexp(raw[active, :-1], 0.0) + floor
        with np.errstate(divide="ignore", over="ignore"):
            found = likelihood(np.log(positive), raw[active, -1], which=active)
        # A component whose kernel turns singular keeps its best epoch and stops.
        healthy = np.isfinite(found.value) & np.isfinite(found.gradient).all(axis=1)
        better = healthy & (found.value < best[active])
        chosen = active[better]
        kept[chosen] = np.column_stack([positive, raw[active, -1]])[better]
        best[chosen] = found.value[better]
        active, positive = active[healthy], positive[healthy]
        if epoch == epochs or not len(active):
            break
        slope = expit(raw[active, :-1]) / positive
        gradient = np.column_stack(
            [found.gradient[healthy] * slope, found.mean_gradient[healthy]]
        ) / (likelihood.samples)
        moment[active] += (1 - _BETA_1) * (gradient - moment[active])
        square[active] = _BETA_2 * square[active] + (1 - _BETA_2) * gradient**2
        size = np.sqrt(square[active] / (1 - _BETA_2 ** (epoch + 1))) + _EPSILON
        raw[active] -= learning_rate / (1 - _BETA_1 ** (epoch + 1)) * moment[active] / size
        progress((epoch + 1) / epochs)
    progress(1.0)
    return _thetas(kept)


def optimum(
    likelihood: Likelihood,
    starts: Sequence[Array],
    noise_floor: float,
    method: str,
    iterations: int,
    progress: Progress,
) -> list[Array]:
    """Maximise the likelihood to its optimum, the mean always at its most likely value.

    Parameters
    ----------
    likelihood, starts, noise_floor, progress
        As in `adam`.
    method : {"newton", "lbfgs"}
        Newton's method with closed-form second derivatives, or scipy's L-BFGS-B.
    iterations : int
        Steps of each component at most.

    Returns
    -------
    list of ndarray (l + 3, 3)
        As `adam`.
    """
    low, high = limits(noise_floor, len(starts[0]) - 3)
    first = np.clip(np.log(_columns(starts)[:, :-1]), low, high)
    if method == "lbfgs":
        point, value, mean = maximise(likelihood, first, (low, high), iterations, progress)
    else:
        point, found = minimise(
            lambda points, which: likelihood(points, which=which, second=True),
            first,
            (low, high),
            iterations,
            progress,
        )
        value, mean = found.value, found.mean
    progress(1.0)
    theta = np.column_stack([np.exp(point), mean])
    return _thetas(np.where(np.isfinite(value)[:, None], theta, np.inf))


def limits(noise_floor: float, lengths: int) -> tuple[Array, Array]:
    """Return least and largest logarithms of lengthscales, signal and noise variance, scaled."""
    least, most = _SIGNAL_LIMITS
    signals = (least, max(1.0, min(most, _MOST_CONTRAST * noise_floor)))
    low, high = np.log([*[_LENGTH_LIMITS] * lengths, signals, (noise_floor, _MOST_NOISE)]).T
    return low, high


def _columns(thetas: Sequence[Array]) -> Array:
    """Stack ``theta`` (l + 3, 3) of each data set as rows (3 b, l + 3), a component a row."""
    return np.concatenate([theta.T for theta in thetas])


def _thetas(rows: Array) -> list[Array]:
    """Undo `_columns`."""
    return [np.ascontiguousarray(rows[k : k + 3].T) for k in range(0, len(rows), 3)]


def _inverse_softplus(value: Array) -> Array:
    inverse: Array = value + np.log(-np.expm1(-value))
    return inverse
