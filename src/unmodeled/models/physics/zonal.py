"""Zonal harmonics of the body's gravity field, unnormalised coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heyoka import diff, expression, make_vars, sqrt, subs

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import GM

__all__ = ["REFERENCE_RADIUS", "Zonal"]

#: Reference radius of the harmonic coefficients.
REFERENCE_RADIUS = Parameter(
    "R_ref", unit="m", value=1.0, scale=1.0, lower=0.0, description="reference radius of the field"
)


@dataclass(frozen=True)
class Zonal(Effect):
    r"""Zonal harmonics :math:`J_n`, without the point mass.

    .. math::
        U = -\frac{GM}{r} \sum_n J_n \left(\frac{R}{r}\right)^n P_n\!\left(\frac{z}{r}\right),
        \qquad \mathbf a = \nabla U

    with plain Legendre polynomials :math:`P_n`; :math:`J_n = -\sqrt{2n+1}\,\bar C_{n0}`.
    Source: [MontenbruckGill2000] Eq. 3.9 and 3.10; [Neamati2022] Table 2. z is the body's pole.
    Not to be combined with a spherical-harmonic field that contains the same degrees.

    Parameters
    ----------
    degrees : tuple of int
        Degrees n, each 2 or more.
    """

    degrees: tuple[int, ...] = (2,)
    name: ClassVar[str] = "zonal"
    axes: ClassVar[str] = "body"

    def __post_init__(self) -> None:
        object.__setattr__(self, "degrees", tuple(self.degrees))  # a list cannot be a cache key
        if not self.degrees or min(self.degrees) < 2 or len(set(self.degrees)) < len(self.degrees):
            raise ConfigError(
                f"zonal degrees are {self.degrees}", allowed="different integers of 2 or more"
            )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM, reference radius and one J for each degree."""
        zonals = (
            Parameter(f"J{n}", unit="1", scale=1e-3, description=f"zonal harmonic of degree {n}")
            for n in self.degrees
        )
        return (GM, REFERENCE_RADIUS, *zonals)

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of `potential`."""
        variables = make_vars("_x", "_y", "_z")
        bare = Symbols(tuple(variables), s.velocity, s.time, s.parameters)
        gradient = [diff(self.potential(bare), v) for v in variables]
        put = {"_x": s.position[0], "_y": s.position[1], "_z": s.position[2]}
        ax, ay, az = subs(gradient, put)
        return ax, ay, az

    def potential(self, s: Symbols) -> expression:
        """Return the zonal part of the force function."""
        x, y, z = s.position
        r = sqrt(x * x + y * y + z * z)
        u, q = z / r, s["R_ref"] / r
        # P_n by Bonnet's recursion; q**n is built up the same way because heyoka's integer
        # powers above two are not finite where the base is zero.
        below, here = expression(1.0), u
        power = q
        total = expression(0.0)
        for n in range(2, max(self.degrees) + 1):
            below, here = here, ((2 * n - 1) * u * here - (n - 1) * below) / expression(float(n))
            power = power * q
            if n in self.degrees:
                total = total + s[f"J{n}"] * power * here
        return -s["GM"] / r * total

    @property
    def terms(self) -> frozenset[str]:
        """One term for each degree."""
        return frozenset(f"gravity C({n},0)" for n in self.degrees)
