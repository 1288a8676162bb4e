"""Heat that a spacecraft sends out to one side, fading."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import exp, expression

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, norm, rtn_axes

__all__ = ["ThermalRecoil"]

#: Components by axis: away from the Sun; inertial; radial, transverse, normal.
AXES = {"sun": ("sun",), "inertial": ("x", "y", "z"), "rtn": ("R", "T", "N")}
FADING = (
    Parameter("recoil_tau", unit="s", value=1e9, scale=1e5, lower=1e-6, description="decay time"),
    Parameter("recoil_t0", unit="s", description="time at which the push has its stated size"),
)


@dataclass(frozen=True)
class ThermalRecoil(Effect):
    r"""Push of heat or of gas that leaves on one side, fading exponentially.

    .. math::
        \mathbf a = e^{-(t - t_0)/\tau} \sum_k a_k \mathbf e_k

    Source: [Turyshev2012] (the heat of the Pioneers' generators). ``recoil_a_sun`` is positive
    away from the Sun; with ``axis="inertial"`` the parts are ``recoil_a_x``, ``_y``, ``_z``, with
    ``"rtn"`` (a craft that keeps its attitude to the orbit) ``recoil_a_R``, ``_T``, ``_N``.
    ``recoil_tau`` is the mean life: half-life over ln 2. In light and shadow alike.

    Size: Pioneer 10 -8.7e-10 m/s2 along the Sun line, tau = 127 years for plutonium
    (half-life 87.7 years), less observed; a new spacecraft loses water for days, 1e-9 m/s2.

    Confused with: for tau beyond the arc it is `SunLinePush`, `ConstantInertial` or `ConstantRTN`;
    fading tells them apart. Not to be combined with a free one of these along the same axis.

    Parameters
    ----------
    axis : {"sun", "inertial", "rtn"}
        Along what the push points.
    """

    axis: str = "sun"
    name: ClassVar[str] = "thermal_recoil"
    position_only: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.axis not in AXES:
            raise ConfigError(f'axis of the recoil is "{self.axis}"', allowed=", ".join(AXES))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Size of each part, decay time and its origin."""
        parts = tuple(
            Parameter(f"recoil_a_{k}", unit="m s-2", scale=1e-9, description=f"{k} part at t0")
            for k in AXES[self.axis]
        )
        return (*parts, *FADING)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The Sun, if the push is along its line."""
        return ("sun",) if self.axis == "sun" else ()

    def acceleration(self, s: Symbols) -> Vector:
        """Return the push."""
        level = exp((s["recoil_t0"] - s.time) / s["recoil_tau"])
        parts = [level * s[f"recoil_a_{k}"] for k in AXES[self.axis]]
        if self.axis == "inertial":
            return parts[0], parts[1], parts[2]
        if self.axis == "rtn":
            return combine(parts, rtn_axes(s.position, s.velocity))
        one = expression(1.0)
        from_sun = combine([one, -one], [s.position, s.bodies["sun"]])
        return combine([parts[0] / norm(from_sun)], [from_sun])
