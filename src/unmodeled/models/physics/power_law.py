"""Gravity with another exponent than two."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import exp, expression, log, sinh

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.vectors import combine, norm

__all__ = ["PowerLawGravity"]

PARAMETERS = (
    GM,
    Parameter(
        "power_law_delta",
        unit="1",
        scale=1e-7,
        lower=-0.5,
        description="gravity falls with the power 2 + delta",
    ),
    Parameter(
        "power_law_r0",
        unit="m",
        value=1.0,
        lower=1e-6,
        description="distance at which gravity has its Newtonian size",
    ),
)


@dataclass(frozen=True)
class PowerLawGravity(Effect):
    r"""What a power law adds to Newton's point mass.

    .. math::
        \mathbf a = -\frac{GM\,\mathbf r}{r^3} \left[\left(\frac{r}{r_0}\right)^{-\delta} - 1
        \right], \qquad
        U = \frac{GM}{r}\left[\frac{(r/r_0)^{-\delta}}{1 + \delta} - 1\right]

    Source: [Hall1894], the law of force with exponent 2 + delta. Together with the point mass
    the force is proportional to :math:`r^{-(2+\delta)}`. Inertial axes. ``power_law_r0`` is a
    choice, not an observable: another one changes GM. Choose the size of the orbit.

    Size: delta = 1.57e-7 moves Mercury's perihelion by the 43 arcseconds a century that
    relativity explains; the periapsis advances by about pi delta a revolution on an orbit of any
    size.

    Confused with: the Schwarzschild term and J2 on one orbit; a second body at another distance
    tells them apart. Not to be combined with `Schwarzschild` unless several orbits of different
    size are fitted.
    """

    name: ClassVar[str] = "power_law_gravity"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM, the exponent's excess and the reference distance."""
        return PARAMETERS

    def acceleration(self, s: Symbols) -> Vector:
        """Return the power law less Newton's law."""
        r = norm(s.position)
        half = -0.5 * s["power_law_delta"] * log(r / s["power_law_r0"])
        excess = 2.0 * exp(half) * sinh(half)  # exp(2 half) - 1 without cancellation
        return combine([-s["GM"] * excess / (r * r * r)], [s.position])

    def potential(self, s: Symbols) -> expression:
        """Return the force function of the power law less Newton's."""
        r, delta = norm(s.position), s["power_law_delta"]
        power = exp(-delta * log(r / s["power_law_r0"]))
        return s["GM"] / r * (power / (1.0 + delta) - 1.0)
