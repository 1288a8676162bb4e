"""An orbit with its first-order partial derivatives."""

from __future__ import annotations

from dataclasses import dataclass

from unmodeled.core.arrays import Array

__all__ = ["VariationalOrbit"]


@dataclass(frozen=True)
class VariationalOrbit:
    """An orbit with its first-order partial derivatives.

    Parameters
    ----------
    states : ndarray (n, 6)
        Position and velocity.
    transition : ndarray (n, 6, 6)
        d state(t) / d state(first time).
    sensitivity : ndarray (n, 6, p)
        d state(t) / d parameter, in the order of ``parameters``.
    parameters : tuple of str
        Names.
    """

    states: Array
    transition: Array
    sensitivity: Array
    parameters: tuple[str, ...]
