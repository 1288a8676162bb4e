"""Non-gravitational accelerations of comets and asteroids: Yarkovsky effect and the like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.constants import ASTRONOMICAL_UNIT
from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, norm, rtn_axes

__all__ = ["NonGravitationalA123"]

AXES = {"A1": "radial", "A2": "transverse", "A3": "normal"}
LAWS = ("power", "water_ice")
#: Of water ice: factor, r0 in au, m, n, k.
ALPHA, R0, M, N, K = 0.111262, 2.808, 2.15, 5.093, 4.6142
REFERENCE = Parameter(
    "nongrav_r0",
    unit="m",
    value=ASTRONOMICAL_UNIT.value,
    scale=ASTRONOMICAL_UNIT.value,
    lower=0.0,
    description="distance at which A1, A2, A3 hold",
)


@dataclass(frozen=True)
class NonGravitationalA123(Effect):
    r"""Radial, transverse and normal accelerations that fall with a power of the distance.

    .. math::
        \mathbf a = \left(\frac{r_0}{r}\right)^d
        (A_1 \mathbf e_R + A_2 \mathbf e_T + A_3 \mathbf e_N)

    Source: [Marsden1973], the equation of motion with g(r). The power law is what is usual for
    asteroids; ``law="water_ice"`` is their g(r) for comets,

    .. math::
        g = 0.111262 \left(\frac{r}{r_0}\right)^{-2.15}
        \left[1 + \left(\frac{r}{r_0}\right)^{5.093}\right]^{-4.6142}, \qquad
        r_0 = 2.808\,\mathrm{au}

    which is one at 1 au; with it ``nongrav_r0`` is the au itself. Heliocentric: the origin is the
    Sun, axes as in `ConstantRTN`. A1, A2, A3 are in m/s2 at ``nongrav_r0`` (1 au in metres by
    default); 1 au/d2 is 20.04 m/s2.

    Size: Bennu A2 = -4.56e-14 au/d2 = -9.1e-13 m/s2, which gives
    da/dt = 2 A2 r0^2 / (n a^2 (1 - e^2)) = -284 m/yr for d = 2; 'Oumuamua A1 = 4e-6 m/s2.

    Confused with: A1 and d = 2 is a change of the Sun's GM (radiation pressure on the body); A2
    with drag and Poynting-Robertson drag; A3 hardly shows. Not to be combined with a free GM of
    the Sun if A1 is free, nor with `ConstantRTN`.

    Parameters
    ----------
    exponent : float
        d, 0 or more; not used by "water_ice".
    law : {"power", "water_ice"}
        How the acceleration falls with the distance.
    """

    exponent: float = 2.0
    law: str = "power"
    name: ClassVar[str] = "nongravitational_a123"
    position_only: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise ConfigError(
                f'law of the non-gravitational acceleration is "{self.law}"',
                allowed=", ".join(LAWS),
            )
        if not 0 <= self.exponent <= 20:
            raise ConfigError(
                f"exponent of the non-gravitational acceleration is {self.exponent}",
                allowed="0 to 20",
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """A1, A2, A3 and the reference distance."""
        return (
            *(
                Parameter(k, unit="m s-2", scale=1e-12, description=f"{v} part at nongrav_r0")
                for k, v in AXES.items()
            ),
            REFERENCE,
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return g(r) times the three components."""
        r = norm(s.position) / s["nongrav_r0"]
        g = _water_ice(r) if self.law == "water_ice" else r ** -float(self.exponent)
        return combine([g * s[k] for k in AXES], rtn_axes(s.position, s.velocity))


def _water_ice(r: expression) -> expression:
    """g(r) of sublimating water ice [Marsden1973], r in au."""
    ratio = r / R0
    return ALPHA * ratio**-M * (1.0 + ratio**N) ** -K
