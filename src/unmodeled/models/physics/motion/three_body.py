"""Motion in the Earth-Moon system, in axes that turn with the Moon."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError

__all__ = ["RestrictedThreeBody"]


@dataclass(frozen=True)
class RestrictedThreeBody:
    r"""Circular restricted three-body problem, with the Sun if it is given.

    Lengths in the distance of the primaries, times in 1 / their mean motion. The larger primary
    stands at x = -mu, the smaller at 1 - mu.

    .. math::
        \ddot x - 2\dot y - x = -(1-\mu)\frac{x+\mu}{r_1^3} - \mu\frac{x+\mu-1}{r_2^3},\quad
        \ddot y + 2\dot x - y = -\Big(\frac{1-\mu}{r_1^3}+\frac{\mu}{r_2^3}\Big)y,\quad
        \ddot z = -\Big(\frac{1-\mu}{r_1^3}+\frac{\mu}{r_2^3}\Big)z

    and of the Sun (bicircular problem) its tidal pull and the push of its light. [Fereoli2024]
    Eq. 1 and 5 print the wrong sign at the first term of the z equation and at the diagonal
    Jacobian; Eq. 6 pushes towards the Sun. The forms here are those of [Koon2011] and
    [Simo1995].

    Parameters
    ----------
    mu : float
        Mass share of the smaller primary.
    sun_mass : float
        In masses of both primaries; 0 leaves the Sun's gravity out.
    sun_distance : float
        From the barycentre.
    sun_rate : float
        Angular velocity of the Sun's direction in the turning axes; negative.
    push : float
        Acceleration by sunlight at ``sun_distance``, away from the Sun.

    Raises
    ------
    ConfigError
        mu not between 0 and 1/2, distance not positive.
    """

    mu: float
    sun_mass: float = 0.0
    sun_distance: float = 388.81114
    sun_rate: float = -0.925195985520347
    push: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.mu <= 0.5:
            raise ConfigError(f"mass share {self.mu}", allowed="0 < mu <= 0.5")
        if not self.sun_distance > 1.0:
            raise ConfigError(
                f"distance of the Sun {self.sun_distance}",
                allowed="more than that of the primaries",
            )

    @property
    def size(self) -> int:
        """Six: position and velocity in the turning axes."""
        return 6

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        """Return dx/dt (b, 6) and its Jacobian (b, 6, 6)."""
        out = np.empty_like(x)
        J = np.zeros((len(x), 6, 6), dtype=x.dtype)
        out[:, :3] = x[:, 3:]
        out[:, 3] = x[:, 0] + 2.0 * x[:, 4]
        out[:, 4] = x[:, 1] - 2.0 * x[:, 3]
        out[:, 5] = 0.0
        J[:, :3, 3:] = np.eye(3)
        J[:, 3, 0] = J[:, 4, 1] = 1.0
        J[:, 3, 4], J[:, 4, 3] = 2.0, -2.0
        for mass, place in ((1.0 - self.mu, -self.mu), (self.mu, 1.0 - self.mu)):
            pull, gradient = _attraction(x[:, :3] - np.array([place, 0.0, 0.0]), mass)
            out[:, 3:] += pull
            J[:, 3:, :3] += gradient
        if self.sun_mass or self.push:
            pull, gradient = self._of_the_sun(x[:, :3], t)
            out[:, 3:] += pull
            J[:, 3:, :3] += gradient
        return out, J

    def disturbance(self, x: Array, t: float) -> Array:
        """Return what the Sun does, gravity and light: acceleration (b, 3)."""
        return self._of_the_sun(x[:, :3], t)[0]

    def sun(self, t: float) -> Array:
        """Return the Sun's place (3,)."""
        angle = self.sun_rate * t
        return self.sun_distance * np.array([math.cos(angle), math.sin(angle), 0.0])

    def _of_the_sun(self, place: Array, t: float) -> tuple[Array, Array]:
        sun = self.sun(t)
        # light falls with the square of the distance, as attraction, and pushes: one law
        strength = self.sun_mass - self.push * self.sun_distance**2
        pull, gradient = _attraction(place - sun, strength)
        # the frame falls towards the Sun with its attraction, but not with its light
        return pull - self.sun_mass * sun / self.sun_distance**3, gradient


def _attraction(d: Array, mass: float) -> tuple[Array, Array]:
    """Attraction (b, 3) to a mass from which ``d`` (b, 3) points here, and its gradient."""
    r2 = (d * d).sum(axis=1)
    factor = mass / (r2 * np.sqrt(r2))
    outer = d[:, :, None] * d[:, None, :]
    gradient = (3.0 * factor / r2)[:, None, None] * outer - factor[:, None, None] * np.eye(3)
    return -factor[:, None] * d, gradient
