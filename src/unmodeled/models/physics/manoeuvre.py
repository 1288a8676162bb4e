"""An impulsive manoeuvre as a short smooth push."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from heyoka import sqrt

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, rtn_axes

__all__ = ["ImpulsiveManoeuvre"]

COMPONENTS = {"rtn": "RTN", "inertial": "xyz"}


@dataclass(frozen=True)
class ImpulsiveManoeuvre(Effect):
    r"""A velocity change at one instant, spread over a short width.

    .. math::
        \mathbf a = \Delta\mathbf v\, \frac{w^2}{2\,[(t - t_0)^2 + w^2]^{3/2}}

    Source: [MontenbruckGill2000] section 3.6 (thrust forces); the pulse is ours. Parameters:
    ``manoeuvre1_dv_R``, ``_T``, ``_N`` (axes of `ConstantRTN` at each instant), or ``_dv_x``,
    ``_y``, ``_z`` in inertial axes; ``manoeuvre1_t0`` and ``manoeuvre1_width``. The integral
    over all time is exactly :math:`\Delta\mathbf v` in inertial axes, and partials exist for t0
    too. The axes R, T, N turn with the velocity that is being gained, which differs from one kick
    in the axes before it by dv^2 / v: give a large plane change in inertial axes.

    The pulse: half of it acts within 0.58 w of t0; at t0 - T the share w^2 / (4 T^2) has acted
    already, at t0 + T as much is left out. The change of energy differs from an impulse's by
    about (w / P)^2 of itself on an orbit of period P (3e-8 for the default of 1 s in low Earth
    orbit), the change of the state by (n w)^2 times a logarithm of P / w.

    Why not a Gaussian: its tail is below the rounding error, and the integrator, with steps of
    minutes, passes over it unseen (1 s in low Earth orbit: 39 of 40 epochs). This tail is seen
    from afar. It too is missed if it is narrow enough: keep w above 1e-5 P, which is found down
    to a velocity change of 1e-8 of the orbital velocity. A heliocentric orbit needs minutes.

    Size: 1 mm/s (desaturation) to km/s.

    Confused with: constant transverse acceleration (0.96 on a day), outgassing. Not to be
    combined with a thrust or another manoeuvre at the same time.

    Parameters
    ----------
    index : int
        Number of the manoeuvre, 1 or more; part of its parameters' names.
    frame : str
        "rtn" or "inertial".
    """

    index: int = 1
    frame: str = "rtn"
    name: ClassVar[str] = "impulsive_manoeuvre"
    position_only: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.index < 1:
            raise ConfigError(f"manoeuvre index is {self.index}", allowed="1 or more")
        if self.frame not in COMPONENTS:
            raise ConfigError(f'manoeuvre frame is "{self.frame}"', allowed='"rtn" or "inertial"')

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Velocity change, epoch and width."""
        key = f"manoeuvre{self.index}"
        return (
            *(
                Parameter(f"{key}_dv_{k}", unit="m s-1", scale=1e-3, description=f"{k} part")
                for k in COMPONENTS[self.frame]
            ),
            Parameter(f"{key}_t0", unit="s", description="middle of the manoeuvre"),
            Parameter(
                f"{key}_width", unit="s", value=1.0, lower=1e-6, description="width of the push"
            ),
        )

    def events(self, values: Mapping[str, float]) -> tuple[tuple[float, float], ...]:
        """Return the epoch and the width of the pulse."""
        key = f"manoeuvre{self.index}"
        return ((values[f"{key}_t0"], values[f"{key}_width"]),)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the pulse."""
        *dv, t0, w = (s[p.name] for p in self.parameters)
        t = s.time - t0
        d2 = t * t + w * w
        pulse = 0.5 * w * w / (d2 * sqrt(d2))
        parts = pulse * dv[0], pulse * dv[1], pulse * dv[2]
        return combine(parts, rtn_axes(s.position, s.velocity)) if self.frame == "rtn" else parts

    @property
    def terms(self) -> frozenset[str]:
        """The manoeuvre of this number."""
        return frozenset({f"manoeuvre {self.index}"})
