"""Hyperparameters of one process a component, in the units of the samples and in words."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned.scaling import Standardiser

__all__ = ["component_facts", "in_units"]


def in_units(theta: Array, scaling: Standardiser, ard: bool) -> tuple[Array, Array, Array]:
    """Return lengthscales (3,) or (3, d), amplitudes (3,) and noise deviations (3,).

    Parameters
    ----------
    theta : ndarray (l + 3, 3)
        Lengthscales, signal variance, noise variance and mean of each component, scaled.
    scaling : Standardiser
    ard : bool
        Whether each input has its own lengthscale.
    """
    lengths = theta[:-3].T
    return (
        lengths * scaling.x_scales if ard else lengths[:, 0] * scaling.x_scale,
        np.sqrt(theta[-3]) * scaling.y_scale,
        np.sqrt(theta[-2]) * scaling.y_scale,
    )


def component_facts(lengthscale: Array, ard: bool, **others: Array) -> dict[str, float | str]:
    """Return the lengthscales and other values (3,), named by component ``x``, ``y``, ``z``."""
    lengths = {"lengthscale": lengthscale}
    if ard:
        names = ["x", "y", "z", *range(4, lengthscale.shape[1] + 1)]
        lengths = {f"lengthscale_{n}": v for n, v in zip(names, lengthscale.T, strict=True)}
    return {
        f"{key}_{axis}": float(v)
        for key, values in (lengths | others).items()
        for axis, v in zip("xyz", values, strict=True)
    }
