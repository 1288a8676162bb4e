"""Gravity of a homogeneous body whose shape is a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

from heyoka import expression

from unmodeled.core.errors import ConfigError
from unmodeled.core.parameters import Parameter
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.point_mass import GM
from unmodeled.models.physics.shape_harmonics import mesh_harmonics, series_force, series_potential
from unmodeled.models.physics.spherical_harmonics import coefficient_names

__all__ = ["MOST_DEGREE", "Polyhedron", "check_shape_degree"]

#: Highest degree of the series of a shape.
MOST_DEGREE = 24

SCALE = Parameter(
    "polyhedron_scale",
    unit="1",
    value=1.0,
    description="field of the shape; 1: constant density, 0: point mass only",
)


@dataclass(frozen=True)
class Polyhedron(Effect):
    r"""What the shape of a homogeneous body adds to the point mass, in body axes.

    .. math::
        U = s \left(U_\text{polyhedron} - \frac{GM}{r}\right) = s\,\frac{GM}{r} \sum_{n=1}^{N}
        \left(\frac{R}{r}\right)^n \sum_m \bar P_{nm}(\sin\varphi)
        (\bar C_{nm}\cos m\lambda + \bar S_{nm}\sin m\lambda)

    Source: [Werner1997a] for the coefficients of a polyhedron, which are exact, and
    [MontenbruckGill2000] section 3.2 for the series. It stands beside a `PointMass`; GM is G times
    density and volume. Degree 1 is the offset of the origin of the mesh from its centroid. s is
    ``polyhedron_scale``.

    The series holds outside the sphere about the origin that contains the mesh, and is as good as
    its degree: nearer, on a landing, use `polyhedron_gravity`, which sums the closed form of
    [Werner1997] over all faces and says what is inside. That sum is not compiled: symbols of a few
    hundred faces take minutes to compile, and a real mesh has thousands.

    Size: Eros at 35 km from its centre, twice its Brillouin radius: up to 17 % of the point mass.

    Confused with: `SphericalHarmonics`, of which it is a special case; a body that is not
    homogeneous. Not to be combined with zonals or spherical harmonics of the same degrees.

    Parameters
    ----------
    mesh : Mesh
        Shape, m, body axes.
    degree : int
        Highest degree N, 1 to 24.
    """

    mesh: Mesh
    degree: int = 12
    name: ClassVar[str] = "polyhedron"
    axes: ClassVar[str] = "body"

    def __post_init__(self) -> None:
        check_shape_degree(self.degree, self.name, 1)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """GM and the scale."""
        return (GM, SCALE)

    @property
    def coefficients(self) -> Mapping[str, float]:
        """Fully normalised coefficients from degree 1 on; R is the Brillouin radius."""
        found = _coefficients(self.mesh, self.degree)
        return {k: v for k, v in found.items() if k != "C_0_0"}

    def acceleration(self, s: Symbols) -> Vector:
        """Return the gradient of the series."""
        return series_force(
            s, self.coefficients, self.degree, self._gm(s), self.mesh.brillouin_radius
        )

    def potential(self, s: Symbols) -> expression:
        """Return the series."""
        return series_potential(
            s, self.coefficients, self.degree, self._gm(s), self.mesh.brillouin_radius
        )

    @property
    def terms(self) -> frozenset[str]:
        """One term for each coefficient."""
        names = coefficient_names(self.degree, min_degree=1)
        return frozenset("gravity {}({},{})".format(*name.split("_")) for name in names)

    def _gm(self, s: Symbols) -> expression:
        return s["polyhedron_scale"] * s["GM"]


def check_shape_degree(degree: int, name: str, least: int) -> None:
    """Refuse a degree that a shape's series cannot have.

    Raises
    ------
    ConfigError
        If it is no whole number from ``least`` to 24.
    """
    if isinstance(degree, bool) or not isinstance(degree, int):
        raise ConfigError(f"{name}: degree is {degree!r}", allowed="a whole number")
    if not least <= degree <= MOST_DEGREE:
        raise ConfigError(
            f"{name} to degree {degree}",
            allowed=f"{least} to {MOST_DEGREE}: beyond, compilation takes minutes",
            do="nearer to the surface than such a series reaches, sum the polyhedron itself: "
            "unmodeled.models.physics.polyhedron_gravity",
        )


@lru_cache(maxsize=8)
def _coefficients(mesh: Mesh, degree: int) -> dict[str, float]:
    return mesh_harmonics(mesh, degree, mesh.brillouin_radius)
