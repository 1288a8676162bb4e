"""A physical parameter: name, unit, value, scale and bounds in one object."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from unmodeled.core.errors import ConfigError

__all__ = ["Parameter"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number that a force model depends on.

    The same object serves the force model, finite differences, estimators and sweep axes.

    Parameters
    ----------
    name : str
        Field's standard symbol, e.g. ``"GM"``, ``"J2"``.
    unit : str
        SI unit, ``"1"`` if dimensionless.
    value : float
        Current value in ``unit``.
    scale : float
        Size of a typical change; estimators divide by it. Positive.
    lower, upper : float
        Bounds, inclusive.
    description : str
        One line for tables.

    Raises
    ------
    ConfigError
        If the scale is not positive or the value lies outside its bounds.

    Examples
    --------
    >>> Parameter("J2", unit="1", value=1.93e-2, scale=1e-3).with_value(0.02).value
    0.02
    """

    name: str
    unit: str
    value: float = 0.0
    scale: float = 1.0
    lower: float = -math.inf
    upper: float = math.inf
    description: str = ""

    def __post_init__(self) -> None:
        if not self.scale > 0:
            raise ConfigError(f"parameter {self.name} has scale {self.scale}", allowed="scale > 0")
        if not self.lower <= self.value <= self.upper:  # also refuses NaN
            raise ConfigError(
                f"parameter {self.name} = {self.value} {self.unit}",
                allowed=f"{self.lower} to {self.upper} {self.unit}",
            )

    def with_value(self, value: float) -> Parameter:
        """Return a copy with another value (checked against the bounds)."""
        return replace(self, value=float(value))
