"""What radiation and air push against."""

from __future__ import annotations

from dataclasses import dataclass

from unmodeled.core.errors import ConfigError

__all__ = ["Spacecraft"]


@dataclass(frozen=True)
class Spacecraft:
    """What radiation and air push against.

    Parameters
    ----------
    mass : float
        kg.
    area : float
        m2.
    reflectivity : float
        Cr, 1 to 2.
    drag_coefficient : float
        Cd.
    """

    mass: float
    area: float
    reflectivity: float = 1.3
    drag_coefficient: float = 2.2

    def __post_init__(self) -> None:
        for name in ("mass", "area", "reflectivity", "drag_coefficient"):
            if not getattr(self, name) > 0:
                raise ConfigError(
                    f"spacecraft {name} is {getattr(self, name)}", allowed="a number > 0"
                )
