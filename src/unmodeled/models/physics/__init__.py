"""Effects written once as symbols; accelerations, orbits and partials are compiled from them."""

from unmodeled.models.physics.aerodynamic_lift import AerodynamicLift
from unmodeled.models.physics.albedo import Albedo
from unmodeled.models.physics.built_in_shapes import SHAPE_NAMES, built_in_shape
from unmodeled.models.physics.continuous_thrust import ContinuousThrust
from unmodeled.models.physics.de_sitter import DeSitter
from unmodeled.models.physics.drag import ExponentialDrag
from unmodeled.models.physics.dynamics import Dynamics
from unmodeled.models.physics.ecom import EmpiricalSunlight
from unmodeled.models.physics.effect import Effect, Symbols, Vector
from unmodeled.models.physics.egm2008 import egm2008_values
from unmodeled.models.physics.ellipsoid import Ellipsoid
from unmodeled.models.physics.fine_solid_tide import FineSolidTide
from unmodeled.models.physics.inertial_acceleration import ConstantInertial
from unmodeled.models.physics.lense_thirring import LenseThirring
from unmodeled.models.physics.linear_radial import LinearRadial
from unmodeled.models.physics.manoeuvre import ImpulsiveManoeuvre
from unmodeled.models.physics.mascon import Mascon
from unmodeled.models.physics.mesh import Mesh
from unmodeled.models.physics.ocean_tide import OceanTide
from unmodeled.models.physics.point_mass import PointMass
from unmodeled.models.physics.pole_tide import PoleTide
from unmodeled.models.physics.polyhedron import Polyhedron
from unmodeled.models.physics.polyhedron_sums import PolyhedronGravity, polyhedron_gravity
from unmodeled.models.physics.power_law import PowerLawGravity
from unmodeled.models.physics.poynting_robertson import PoyntingRobertson
from unmodeled.models.physics.relativity import Schwarzschild
from unmodeled.models.physics.rtn_acceleration import ConstantRTN, OncePerRevolutionRTN
from unmodeled.models.physics.scaled_field import ScaledField
from unmodeled.models.physics.solar_radiation_pressure import SolarRadiationPressure
from unmodeled.models.physics.solid_tide import SolidTide
from unmodeled.models.physics.spherical_harmonics import SphericalHarmonics, coefficient_names
from unmodeled.models.physics.sun_line_push import SunLinePush
from unmodeled.models.physics.tesseral import Tesseral
from unmodeled.models.physics.thermal_recoil import ThermalRecoil
from unmodeled.models.physics.thermosphere_drag import ThermosphereDrag
from unmodeled.models.physics.third_body import ThirdBody
from unmodeled.models.physics.tidal_lag import TidalLag
from unmodeled.models.physics.unknown_perturber import UnknownPerturber
from unmodeled.models.physics.variational_orbit import VariationalOrbit
from unmodeled.models.physics.velocity_drag import VelocityDrag
from unmodeled.models.physics.yarkovsky import NonGravitationalA123
from unmodeled.models.physics.zonal import Zonal

__all__ = [
    "SHAPE_NAMES",
    "AerodynamicLift",
    "Albedo",
    "ConstantInertial",
    "ConstantRTN",
    "ContinuousThrust",
    "DeSitter",
    "Dynamics",
    "Effect",
    "Ellipsoid",
    "EmpiricalSunlight",
    "ExponentialDrag",
    "FineSolidTide",
    "ImpulsiveManoeuvre",
    "LenseThirring",
    "LinearRadial",
    "Mascon",
    "Mesh",
    "NonGravitationalA123",
    "OceanTide",
    "OncePerRevolutionRTN",
    "PointMass",
    "PoleTide",
    "Polyhedron",
    "PolyhedronGravity",
    "PowerLawGravity",
    "PoyntingRobertson",
    "ScaledField",
    "Schwarzschild",
    "SolarRadiationPressure",
    "SolidTide",
    "SphericalHarmonics",
    "SunLinePush",
    "Symbols",
    "Tesseral",
    "ThermalRecoil",
    "ThermosphereDrag",
    "ThirdBody",
    "TidalLag",
    "UnknownPerturber",
    "VariationalOrbit",
    "Vector",
    "VelocityDrag",
    "Zonal",
    "built_in_shape",
    "coefficient_names",
    "egm2008_values",
    "polyhedron_gravity",
]
