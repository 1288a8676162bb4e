"""Empirical accelerations along the orbit's own axes: constant and once per revolution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import expression

from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.vectors import combine, cross, dot, rtn_axes

__all__ = ["ConstantRTN", "OncePerRevolutionRTN"]

AXES = {"R": "radial", "T": "transverse", "N": "normal"}


@dataclass(frozen=True)
class ConstantRTN(Effect):
    r"""Constant components along radial, transverse and normal axes.

    .. math::
        \mathbf a = a_R \mathbf e_R + a_T \mathbf e_T + a_N \mathbf e_N, \quad
        \mathbf e_R = \mathbf r / r,\; \mathbf e_N = \mathbf r \times \mathbf v /
        |\mathbf r \times \mathbf v|,\; \mathbf e_T = \mathbf e_N \times \mathbf e_R

    Source: [MontenbruckGill2000] section 3.7.4 (empirical forces). The parameters are
    ``rtn_a_R`` (outwards), ``rtn_a_T`` (forwards, not along the velocity on an eccentric orbit)
    and ``rtn_a_N`` (along the orbital angular momentum).

    Size: what is not modelled, 1e-12 (LAGEOS) to 1e-7 m/s2. On a circular orbit
    da/dt = 2 a_T / n. There is no such frame on a straight line through the centre.

    Confused with: a_T with drag, A2 and a weak thrust; a_R with GM and, on a circular orbit, with
    the Schwarzschild term; a_N averages out. Not to be combined with free drag or
    `NonGravitationalA123` on one near-circular orbit.
    """

    name: ClassVar[str] = "constant_rtn"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Three components."""
        return tuple(
            Parameter(f"rtn_a_{k}", unit="m s-2", scale=1e-9, description=f"constant {v} part")
            for k, v in AXES.items()
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the sum of the three components."""
        return combine([s[p.name] for p in self.parameters], rtn_axes(s.position, s.velocity))


@dataclass(frozen=True)
class OncePerRevolutionRTN(Effect):
    r"""Components that change once a revolution, along radial, transverse and normal axes.

    .. math::
        \mathbf a = \sum_{k \in \{R,T,N\}} (c_k \cos\lambda + s_k \sin\lambda)\, \mathbf e_k,
        \qquad \lambda = u + \Omega

    Source: [MontenbruckGill2000] section 3.7.4 (empirical forces). The parameters are
    ``opr_cos_R``, ``opr_sin_R``, and so on with T and N.

    The angle: the argument of latitude u is counted from the node, which an equatorial orbit does
    not have. The angle here is counted in the orbit plane from the direction into which the
    inertial x axis is carried by the shortest turn of z onto the orbit normal. It is
    u + Omega (the true longitude), smooth for circular and for equatorial orbits. Coefficients
    for u follow by turning each pair (c, s) by Omega. Directions on a sphere have no smooth
    origin everywhere: it breaks down at an inclination of 180 degrees, where
    ``retrograde=True`` counts u - Omega and breaks down at 0 degrees instead.

    Size: 1e-10 to 1e-8 m/s2, where radiation pressure, gravity or attitude are mismodelled.

    Confused with: nearly everything with the period of the orbit, and the initial state. R cosine
    and T sine are nearly the same. Free coefficients absorb other effects: use them to see what
    is left, not to name it. Not to be combined with a candidate that is to be judged.

    Parameters
    ----------
    retrograde : bool
        Origin of the angle for orbits near an inclination of 180 degrees.
    """

    retrograde: bool = False
    name: ClassVar[str] = "once_per_revolution_rtn"
    position_only: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Cosine and sine for each axis."""
        return tuple(
            Parameter(
                f"opr_{wave}_{k}", unit="m s-2", scale=1e-9, description=f"{wave}ine, {v} part"
            )
            for k, v in AXES.items()
            for wave in ("cos", "sin")
        )

    def acceleration(self, s: Symbols) -> Vector:
        """Return the sum over axes of cosine and sine."""
        axes = rtn_axes(s.position, s.velocity)
        radial, _, (nx, ny, nz) = axes
        side = -1.0 if self.retrograde else 1.0
        bent = nx / (expression(1.0) + side * nz)
        origin: Vector = (1.0 - nx * bent, -ny * bent, -side * nx)
        cosine, sine = dot(radial, origin), dot(radial, cross(axes[2], origin))
        return combine([s[f"opr_cos_{k}"] * cosine + s[f"opr_sin_{k}"] * sine for k in AXES], axes)
