"""Friction along the velocity: gas at rest, dynamical friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, norm

__all__ = ["VelocityDrag"]

PARAMETERS = (
    Parameter("friction_a", unit="m s-2", scale=1e-9, description="friction at friction_v0"),
    Parameter(
        "friction_v0",
        unit="m s-1",
        value=1.0,
        scale=1e3,
        lower=1e-9,
        description="speed at which friction_a holds",
    ),
)


@dataclass(frozen=True)
class VelocityDrag(Effect):
    r"""Friction against the inertial velocity, with a power of the speed.

    .. math::
        \mathbf a = -a_0 \left(\frac{v}{v_0}\right)^p \frac{\mathbf v}{v}

    Source: [Tamayo2020] (REBOUNDx: friction for p = 1, gas for p = 2, dynamical friction of
    something fast through a cloud for p = -2). The medium is uniform and at rest. ``friction_a`` is
    positive for braking; give ``friction_v0``, e.g. the speed at the start.

    Size: with p = 1 the speed alone would fall to 1/e in v0 / a0; a circular orbit shrinks by
    da/dt = -2 a0 / n.

    Confused with: drag, A2, Poynting-Robertson and a constant transverse acceleration (the same
    on a circular orbit). Not to be combined with a free one of these on a near-circular orbit.

    Parameters
    ----------
    power : float
        p, -3 to 3.
    """

    power: float = 1.0
    name: ClassVar[str] = "velocity_drag"
    position_only: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if not -3 <= self.power <= 3:
            raise ConfigError(f"power of the friction is {self.power}", allowed="-3 to 3")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Friction and the speed it is given at."""
        return PARAMETERS

    def acceleration(self, s: Symbols) -> Vector:
        """Return the friction."""
        speed = norm(s.velocity) / s["friction_v0"]
        factor = -s["friction_a"] / s["friction_v0"] * speed ** (float(self.power) - 1.0)
        return combine([factor], [s.velocity])
