"""Motion about a body of which only the mass is known, in inertial axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError

__all__ = ["CentralBody"]


@dataclass(frozen=True)
class CentralBody:
    """Point mass at the origin of inertial axes: where a filter about a small body starts.

    Parameters
    ----------
    gm : float
        m3/s2.

    Raises
    ------
    ConfigError
        If GM is not positive.
    """

    gm: float

    def __post_init__(self) -> None:
        if not self.gm > 0.0:
            raise ConfigError(f"GM {self.gm}", allowed="a number > 0, m3/s2")

    @property
    def size(self) -> int:
        """Six: position and velocity."""
        return 6

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, 6) and its Jacobian (b, 6, 6)."""
        r = x[:, :3]
        r2 = (r * r).sum(axis=1)
        factor = self.gm / (r2 * np.sqrt(r2))
        out = np.hstack([x[:, 3:], -factor[:, None] * r])
        J = np.zeros((len(x), 6, 6), dtype=x.dtype)
        J[:, :3, 3:] = np.eye(3)
        outer = r[:, :, None] * r[:, None, :]
        J[:, 3:, :3] = (3.0 * factor / r2)[:, None, None] * outer
        J[:, 3:, :3] -= factor[:, None, None] * np.eye(3)
        return out, J
