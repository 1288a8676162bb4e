"""Inputs of a network of the potential: positions scaled by the radius, with their derivatives."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.learned._potential_network import Jet

__all__ = ["DECAY", "input_jet", "power"]

#: Power of 1/r before the network, by the kind of inputs.
DECAY = {"kelvin": 1, "direction": 2}


def power(x: Array, p: float, hessian: bool) -> Jet:
    """Return r^-p with derivatives, one column."""
    square = (x * x).sum(axis=1)
    value = square ** (-0.5 * p)
    lower = value / square
    gradient = (-p * lower * x.T)[:, :, None]
    second = None
    if hessian:
        outer = (p + 2) * (x.T[:, None] * x.T[None]) / square - np.eye(3)[:, :, None]
        second = (p * lower * outer)[..., None]
    return Jet(value[:, None], gradient, (p * (p - 1) * lower)[:, None], second)


def input_jet(kind: str, x: Array, hessian: bool = False) -> Jet:
    """Return the inputs at ``x`` (n, 3), lengths in radii of the reference sphere.

    ``kelvin``: x / r^2, the point's image in the sphere: with a factor 1/r before the network, U is
    harmonic outside where the network is inside ([Axler2001] Chapter 4). ``direction``:
    x / r and 1 / r, as [Martin2023].
    """
    p = 2 if kind == "kelvin" else 1
    factor = power(x, p, hessian)
    # Products of the coordinates with r^-p.
    value = x * factor.value
    eye = np.eye(3)
    gradient = factor.value * eye[:, None, :] + factor.gradient * x[None]
    assert factor.laplacian is not None
    laplacian = factor.laplacian * x + 2.0 * factor.gradient[:, :, 0].T
    second = None
    if factor.hessian is not None:
        # d2 (x_k f) / dx_i dx_j = x_k f_ij + delta_ik f_j + delta_jk f_i
        second = factor.hessian * x
        second = second + eye[:, None, None, :] * factor.gradient[None]
        second = second + eye[None, :, None, :] * factor.gradient[:, None]
    jet = Jet(value, gradient, laplacian, second)
    return jet if kind == "kelvin" else _join(jet, power(x, 1, hessian))


def _join(a: Jet, b: Jet) -> Jet:
    assert a.laplacian is not None
    assert b.laplacian is not None
    second = None
    if a.hessian is not None and b.hessian is not None:
        second = np.concatenate([a.hessian, b.hessian], axis=3)
    return Jet(
        np.concatenate([a.value, b.value], axis=1),
        np.concatenate([a.gradient, b.gradient], axis=2),
        np.concatenate([a.laplacian, b.laplacian], axis=1),
        second,
    )
