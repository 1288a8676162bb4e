"""True fields of simulated orbits that turn with the body: tesserals, shapes, hidden masses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.shape_file import read_shape
from unmodeled.models.physics import Dynamics, Mascon, PointMass, Polyhedron, SphericalHarmonics
from unmodeled.models.physics.built_in_shapes import built_in_shape
from unmodeled.models.physics.effect import Effect
from unmodeled.models.physics.gravity_file import read_gravity_field
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.shape_harmonics import mesh_harmonics
from unmodeled.models.physics.spherical_harmonics import coefficient_names

__all__ = [
    "TWO_MASCONS",
    "hidden_masses",
    "mascon_field",
    "polyhedron_field",
    "shape_field",
    "shape_tesseral_field",
    "tesseral_field",
]

#: Shares of GM and places, Brillouin radii, of two masses about their common centre.
TWO_MASCONS = ((0.6, (0.32, 0.0, 0.0)), (0.4, (-0.48, 0.0, 0.0)))

#: Share of GM of the two hidden masses, and their distance from the centre in Brillouin radii.
_SHARE, _PLACE = 0.1, 0.5


def tesseral_field(body: Body, path: Path, degree: int | None = None) -> Dynamics:
    """Return the field of a ``.gfc`` file about a body that turns, SI.

    Parameters
    ----------
    body : Body
        Gives the spin rate; z is its pole, the meridian is along x at time zero.
    path : Path
        GM and reference radius are those of the file.
    degree : int, optional
        Highest degree; that of the file if not given.
    """
    field = read_gravity_field(path)
    top = max(int(name.split("_")[1]) for name in field.coefficients)
    if top < 2 or not 2 <= (degree or top) <= top:
        raise ConfigError(
            f"data.field.degree is {degree} and {path.name} goes to degree {top}",
            allowed=f"2 to {top}",
        )
    low = {k: v for k, v in field.coefficients.items() if k in coefficient_names(1) and v != 0}
    if low.pop("C_0_0", 1.0) != 1.0 or low:
        raise DataError(
            f"{path.name} has coefficients {', '.join(low) or 'C_0_0'} of degree 0 or 1",
            allowed="C_0_0 = 1 and degree 1 zero: origin at the centre of mass",
        )
    names = coefficient_names(degree or top, min_degree=2)
    values = {name: field.coefficients.get(name, 0.0) for name in names}
    effects: list[Effect] = [PointMass(), SphericalHarmonics(degree or top)]
    return _turning(body, effects, {"GM": field.gm, "R_ref": field.radius} | values)


def polyhedron_field(
    body: Body, path: Path, scale: float | None = None, degree: int = 12
) -> Dynamics:
    """Return the field of a homogeneous body of a given shape that turns, SI.

    It is the series of `Polyhedron` to ``degree``, exact there, about the centroid of the mesh.

    Parameters
    ----------
    body : Body
        Gives GM (so the density), spin rate and the sphere that must hold the shape.
    path : Path
        ``.obj`` or plate model, in body axes.
    scale : float, optional
        Length of the file's unit, m. Not given: the farthest point lies on the Brillouin sphere.
    degree : int
        Highest degree of the series, 1 to 24.
    """
    mesh = read_shape(path, scale or 1.0)
    vertices = mesh.vertices - mesh.centroid
    centred = Mesh(vertices, mesh.faces, mesh.name)
    if scale is None:
        grown = vertices * (body.brillouin_radius / centred.brillouin_radius)
        centred = Mesh(grown, mesh.faces, mesh.name)
    # The farthest point put on the sphere may be outside by rounding.
    if centred.brillouin_radius > body.brillouin_radius * (1 + 1e-12):
        raise DataError(
            f"{path.name} reaches {centred.brillouin_radius:.6g} m from its centre of mass, "
            f"outside the Brillouin sphere of {body.name} ({body.brillouin_radius:g} m)",
            do="correct data.field.scale, or leave it out",
        )
    return _turning(body, [PointMass(), Polyhedron(centred, degree)], {"GM": body.gm})


def shape_field(body: Body, shape: str, degree: int = 12) -> Dynamics:
    """Return the field of a homogeneous body of a built-in shape that turns, SI.

    As `polyhedron_field`, with the mesh of `built_in_shape`, which fills the Brillouin sphere.
    """
    mesh = built_in_shape(shape, body.brillouin_radius)
    return _turning(body, [PointMass(), Polyhedron(mesh, degree)], {"GM": body.gm})


def shape_tesseral_field(body: Body, shape: str, degree: int = 8) -> Dynamics:
    """Return the card's zonals with the tesserals of a built-in shape, turning, SI.

    Degrees that the card has no zonal for take that of the shape too. Tesserals are those of
    `mesh_harmonics` for constant density; for Bennu and its ``bennu_like`` shape they have the
    size of the true ones and not their values.

    Parameters
    ----------
    body : Body
        Gives GM, zonals and spin rate; the shape fills its Brillouin sphere.
    shape : str
        Name of a built-in shape.
    degree : int
        Highest degree, 2 or more.
    """
    radius = body.brillouin_radius
    values = mesh_harmonics(built_in_shape(shape, radius), degree, radius)
    # The sphere that the card's zonals refer to may be another one.
    share = body.reference_radius / radius
    for n, zonal in body.zonal_unnormalised().items():
        if n <= degree:
            values[f"C_{n}_0"] = -zonal / np.sqrt(2.0 * n + 1.0) * share**n
    kept = {name: float(values[name]) for name in coefficient_names(degree, min_degree=2)}
    effects: list[Effect] = [PointMass(), SphericalHarmonics(degree)]
    return _turning(body, effects, {"GM": body.gm, "R_ref": radius} | kept)


def mascon_field(
    body: Body, masses: Sequence[tuple[float, Sequence[float]]] = TWO_MASCONS
) -> Dynamics:
    """Return the field of point masses that turn with the body, SI; the total mass is GM.

    Parameters
    ----------
    body : Body
        Gives GM, spin rate and the Brillouin radius.
    masses : sequence of (share, place)
        Share of GM, not zero, and place (3,) in Brillouin radii, inside that sphere. What the
        shares leave of GM stays at the origin.
    """
    if not masses:
        raise ConfigError("data.field.masses is empty", do="list at least one mass")
    values = {"GM": body.gm}
    effects: list[Effect] = [PointMass()]
    rest = sum(float(share) for share, _ in masses)
    # Beside a point mass of all GM, what is elsewhere is missing in the middle.
    central = [(-rest, (0.0, 0.0, 0.0))] if abs(rest) > 1e-12 else []
    for index, (share, place) in enumerate([*masses, *central], start=1):
        if share == 0 or not np.linalg.norm(place) < 1.0:
            raise ConfigError(
                f"data.field.masses: share {share:g} of GM at {tuple(place)} Brillouin radii",
                allowed="a share that is not zero, a place less than 1 from the origin",
            )
        values[f"mascon{index}_GM"] = share * body.gm
        for axis, coordinate in zip("xyz", place, strict=True):
            values[f"mascon{index}_{axis}"] = coordinate * body.brillouin_radius
        effects.append(Mascon(index))
    return _turning(body, effects, values)


def hidden_masses(body: Body) -> Dynamics:
    """Return the point mass with +0.1 GM at x = R/2 and -0.1 GM at x = -R/2, turning, SI.

    The total mass is GM; the centre of mass is 0.1 R from the origin, as in the tests of learned
    fields by peers: what assumes a point mass far away fails by that dipole.
    """
    masses = [(sign * _SHARE, (sign * _PLACE, 0.0, 0.0)) for sign in (1.0, -1.0)]
    return mascon_field(body, masses)


def _turning(body: Body, effects: list[Effect], values: dict[str, Any]) -> Dynamics:
    if body.spin_rate == 0:
        raise ConfigError(
            f"the card of {body.name} has no spin rate",
            do="add spin_rate (rad/s) to the card: a field that is not zonal turns",
        )
    return Dynamics(effects, values | {"spin_rate": body.spin_rate}, spinning=True)
