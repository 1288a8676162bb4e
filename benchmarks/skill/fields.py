"""The true fields of the table, and the regions where learned fields are compared with them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.seeds import Streams
from unmodeled.core.units import NORMALISED_GM
from unmodeled.datasets.learning_data import LearningData
from unmodeled.models.physics.built_in_shapes import built_in_shape
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.polyhedron_sums import polyhedron_gravity

__all__ = [
    "FIELDS",
    "REGIONS",
    "Field",
    "region_points",
    "shape_gravity",
    "true_acceleration",
]

#: Degree of the tesseral truth, within reach of the learners, and of the series of the shape, which
#: orbits feel (3e-6 off at their lowest, 1.6 radii).
TESSERAL_DEGREE, SHAPE_DEGREE = 6, 16
#: Points of each region, and where the far field begins and ends, Brillouin radii.
POINTS, FAR = 200, (5.0, 20.0)
#: Radius below which the sum over faces is the truth: slow, and below all samples.
_NEAR = 1.6
#: About a long body that spins, orbits are drawn high, round and retrograde: others are soon
#: thrown out or end on it.
_SAFE = {"semi_major_axis": [2.5, 3.5], "eccentricity": [0.05, 0.4], "inclination": [130.0, 180.0]}


@dataclass(frozen=True)
class Field:
    """A true field.

    Parameters
    ----------
    name, title : str
        In the table and for people.
    body : str
        Card that gives size, mass and spin.
    data : dict
        ``data.field`` of the configuration; empty for the card's zonal field.
    oracle : dict
        The learner that knows the family: its coefficients are all that is not known.
    ranges : dict
        ``data.ranges`` of the elements, where they are not those of [Neamati2022] Table 3.
    """

    name: str
    title: str
    body: str
    data: dict[str, Any]
    oracle: dict[str, Any]
    ranges: dict[str, Any] = dataclasses.field(default_factory=dict)


FIELDS = {
    field.name: field
    for field in (
        Field("bennu-zonal", "Bennu, J2 to J5", "bennu", {}, {"kind": "zonal_oracle"}),
        Field(
            "bennu-tesseral",
            f"Bennu with tesserals of a Bennu-like shape, to degree {TESSERAL_DEGREE}",
            "bennu",
            {"kind": "tesseral", "shape": "bennu_like", "degree": TESSERAL_DEGREE},
            {"kind": "harmonic_least_squares", "degree": TESSERAL_DEGREE, "ridge": 0.0},
        ),
        Field(
            "eros-polyhedron",
            "Eros-like homogeneous polyhedron",
            "eros",
            {"kind": "polyhedron", "shape": "eros_like", "degree": SHAPE_DEGREE},
            {"kind": "family_oracle", "family": "polyhedron"},
            _SAFE,
        ),
        Field(
            "two-mascons",
            "Point mass and hidden masses ±0.1 GM at ±R/2",
            "eros",
            {"kind": "hidden_masses"},
            {"kind": "family_oracle", "family": "hidden_masses"},
            _SAFE,
        ),
    )
}

#: Regions beyond the samples, with what they are called.
REGIONS = {
    "below": "between the Brillouin sphere and the lowest training sample",
    "far": f"{FAR[0]:g} to {FAR[1]:g} Brillouin radii",
    "surface": "on the shape (polyhedron), on the Brillouin sphere (other fields)",
}


@cache
def eros_mesh() -> Mesh:
    """Return the shape, normalised: its farthest point is at 1 from its centroid."""
    return built_in_shape("eros_like")


def true_acceleration(field: Field, data: LearningData) -> Callable[[Array], Array]:
    """Return the truth as a function of normalised positions (n, 3), body axes.

    Orbits feel the series of the shape, which does not hold on it: close to it the closed form
    takes its place.
    """
    series = data.true_field
    assert series is not None  # orbits are simulated
    return series if field.name != "eros-polyhedron" else partial(shape_gravity, series)


def shape_gravity(series: Callable[[Array], Array], x: Array) -> Array:
    """Return the field of the shape: ``series`` beyond `_NEAR`, exact below."""
    near = np.linalg.norm(x, axis=1) < _NEAR
    found = series(x)
    if near.any():
        found[near] = polyhedron_gravity(eros_mesh(), x[near], NORMALISED_GM).acceleration
    return found


@cache
def surface_points(name: str) -> Array:
    """Return points (n, 3) just above the surface, where a lander would be."""
    streams = Streams(1)
    if name == "eros-polyhedron":
        corners = eros_mesh().corners
        chosen = streams.generator("skill.surface").choice(len(corners), POINTS, replace=False)
        # A hair above: on a face the gradient jumps, the acceleration does not.
        points: Array = corners[chosen].mean(axis=1) * (1 + 1e-6)
        return points
    return _shell(1.0, 1.0, streams.generator("skill.surface"))


def region_points(field: Field, data: LearningData) -> dict[str, Array]:
    """Return points (n, 3) of each region; normalised, body axes.

    Radii of shells are uniform between their ends, directions isotropic, and the same for all
    learners, levels of noise and volumes that share a training orbit.
    """
    radius = np.linalg.norm(data.train.positions, axis=1)
    generator = Streams(1).generator("skill.regions")
    return {
        "below": _shell(1.0, float(radius.min()), generator),
        "far": _shell(*FAR, generator),
        "surface": surface_points(field.name),
    }


def _shell(inner: float, outer: float, generator: np.random.Generator) -> Array:
    direction = generator.standard_normal((POINTS, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    points: Array = direction * (inner + (outer - inner) * generator.random(POINTS))[:, None]
    return points
