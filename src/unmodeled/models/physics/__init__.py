"""Effects written once as symbols; accelerations, orbits and partials are compiled from them."""

from unmodeled.models.physics.dynamics import Dynamics, VariationalOrbit
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.point_mass import PointMass
from unmodeled.models.physics.spherical_harmonics import SphericalHarmonics, coefficient_names
from unmodeled.models.physics.zonal import Zonal

__all__ = [
    "Dynamics",
    "Effect",
    "PointMass",
    "SphericalHarmonics",
    "Symbols",
    "VariationalOrbit",
    "Vector",
    "Zonal",
    "coefficient_names",
]
