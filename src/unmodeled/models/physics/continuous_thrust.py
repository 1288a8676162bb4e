"""A thrust that is on for a while."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression, sqrt

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, norm, rtn_axes

__all__ = ["ContinuousThrust"]

COMPONENTS = {"velocity": ("V",), "rtn": ("R", "T", "N")}


@dataclass(frozen=True)
class ContinuousThrust(Effect):
    r"""Constant thrust acceleration between two instants.

    .. math::
        \mathbf a = [S(t - t_{on}) - S(t - t_{off})]\, a\, \mathbf e, \qquad
        S(t) = \frac12 \left(1 + \frac{t}{\sqrt{t^2 + w^2}}\right)

    Source: [MontenbruckGill2000] section 3.6 (thrust forces), with a smooth switch. The
    direction is the inertial velocity (``thrust_a_V``, negative to brake) or the axes of
    `ConstantRTN` (``thrust_a_R``, ``thrust_a_T``, ``thrust_a_N``). ``thrust_t_on``,
    ``thrust_t_off`` in s; ``thrust_width`` is w. The acceleration is constant: no loss of mass.

    The switch: the velocity change over all time is a (t_off - t_on), whatever w; a share
    w^2 / (4 T^2) of the acceleration is on or off at a distance T from each switch. Partials
    exist for both instants. A step of the integrator sees the switch coming, as in
    `ImpulsiveManoeuvre`.

    Size: electric propulsion 1e-5 to 3e-4 m/s2; a leak 1e-9 m/s2. On a circular orbit
    da/dt = 2 a / n.

    Confused with: drag and constant transverse acceleration while it is on; short burns with an
    impulse. Not to be combined with free `ConstantRTN` if it is on for the whole arc.

    Parameters
    ----------
    direction : str
        "velocity" or "rtn".
    """

    direction: str = "velocity"
    name: ClassVar[str] = "continuous_thrust"
    position_only: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.direction not in COMPONENTS:
            raise ConfigError(
                f'direction of the thrust is "{self.direction}"', allowed='"velocity" or "rtn"'
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Acceleration, switching times and width."""
        return (
            *(
                Parameter(f"thrust_a_{k}", unit="m s-2", scale=1e-6, description=f"{k} part")
                for k in COMPONENTS[self.direction]
            ),
            Parameter("thrust_t_on", unit="s", description="start of the thrust"),
            Parameter("thrust_t_off", unit="s", description="end of the thrust"),
            Parameter(
                "thrust_width", unit="s", value=1.0, lower=1e-6, description="width of the switch"
            ),
        )

    def events(self, values: Mapping[str, float]) -> tuple[tuple[float, float], ...]:
        """Return when the thrust is switched on and off, with the width of the switch."""
        return tuple((values[f"thrust_t_{k}"], values["thrust_width"]) for k in ("on", "off"))

    def acceleration(self, s: Symbols) -> Vector:
        """Return the thrust."""
        w = s["thrust_width"]

        def ramp(name: str) -> expression:
            t = s.time - s[name]
            return 0.5 * t / sqrt(t * t + w * w)

        level = ramp("thrust_t_on") - ramp("thrust_t_off")
        factors = [level * s[f"thrust_a_{k}"] for k in COMPONENTS[self.direction]]
        if self.direction == "rtn":
            return combine(factors, rtn_axes(s.position, s.velocity))
        return combine([factors[0] / norm(s.velocity)], [s.velocity])
