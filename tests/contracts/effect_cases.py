"""All effects that the contract test runs on; a new effect adds one line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from unmodeled.models.physics import (
    AerodynamicLift,
    Albedo,
    ConstantInertial,
    ConstantRTN,
    ContinuousThrust,
    DeSitter,
    Effect,
    Ellipsoid,
    EmpiricalSunlight,
    ExponentialDrag,
    FineSolidTide,
    ImpulsiveManoeuvre,
    LenseThirring,
    LinearRadial,
    Mascon,
    Mesh,
    NonGravitationalA123,
    OceanTide,
    OncePerRevolutionRTN,
    PointMass,
    PoleTide,
    Polyhedron,
    PowerLawGravity,
    PoyntingRobertson,
    ScaledField,
    Schwarzschild,
    SolarRadiationPressure,
    SolidTide,
    SphericalHarmonics,
    SunLinePush,
    ThermalRecoil,
    ThermosphereDrag,
    ThirdBody,
    TidalLag,
    UnknownPerturber,
    VelocityDrag,
    Zonal,
)
from unmodeled.models.physics.spherical_harmonics import coefficient_names
from unmodeled.models.physics.tracks import Tracks

SPIN = {"spin_rate": 0.7, "prime_meridian": 0.4}


@dataclass(frozen=True)
class EffectCase:
    """An effect with numbers, and what is claimed of it; lengths and times of order one."""

    effect: Effect
    values: Mapping[str, float] = field(default_factory=dict)
    #: the velocity or the time matters: states are asked for, bare positions refused
    needs_states: bool = False
    #: acceleration = grad U, U independent of velocity
    potential: bool = True
    #: Laplace's equation holds outside the body
    harmonic: bool = True
    #: symmetric about z
    axisymmetric: bool = False
    spinning: bool = False
    tracks: Tracks | None = None
    #: the source moves by a law of its own: the potential depends on time
    moves: bool = False

    @property
    def steady(self) -> bool:
        """The potential, if there is one, does not depend on time but by the spin."""
        still = self.tracks is None or self.tracks.degree == 0
        return self.potential and still and not self.moves


def coefficients(degree, order=None, min_degree=2):
    """Random coefficients, large enough to matter and falling like Kaula's rule."""
    generator = np.random.default_rng(degree)
    names = coefficient_names(degree, order, min_degree)
    size = [0.05 / max(int(name.split("_")[1]), 1) ** 2 for name in names]
    values = {n: s * generator.normal() for n, s in zip(names, size, strict=True)}
    if "C_0_0" in values:
        values["C_0_0"] = 1.1
    return {"GM": 1.3, "R_ref": 0.9} | values


def zonals(*degrees):
    return {"GM": 1.3, "R_ref": 0.9} | {f"J{n}": 0.1 / n * (-1) ** n for n in degrees}


def full(degree, order=None, min_degree=2, **claims):
    return EffectCase(
        SphericalHarmonics(degree, order, min_degree),
        coefficients(degree, order, min_degree),
        **claims,
    )


def published(degree, order=None, part="all", min_degree=2, **claims):
    """EGM2008 a hundred times too strong, or it would not be seen beside a point mass."""
    effect = ScaledField("egm2008", degree, order, part, min_degree)
    values = {effect.scale_name: 1e2, "egm2008_GM": 1.3, "egm2008_R": 0.9}
    return EffectCase(effect, values, **claims)


def spinning(degree):
    return EffectCase(SphericalHarmonics(degree), coefficients(degree) | SPIN, spinning=True)


def central(effect, values, **claims):
    """A potential, but not Laplace's equation."""
    return EffectCase(effect, values, harmonic=False, **claims)


def moving(effect, values, **claims):
    """An effect of velocity or time, without a potential."""
    return EffectCase(effect, values, needs_states=True, potential=False, harmonic=False, **claims)


def circling(start, end):
    """Sun and Moon 4 to 5 from the centre, out of each other's plane, moving."""
    return Tracks.fit(
        {
            "sun": lambda t: np.stack(
                [4.6 * np.cos(0.3 * t), 4.6 * np.sin(0.3 * t), 0.9 + 0 * t], 1
            ),
            "moon": lambda t: np.stack([0.5 + 0 * t, 4 * np.cos(0.5 * t), -4 * np.sin(0.5 * t)], 1),
        },
        start,
        end,
    )


#: Enough for all that is done with a moving case; one that stands still lasts as long as wanted.
MOVING = circling(-1.0, 6.0)
STILL = Tracks(
    -1.0, 500.0, {"sun": np.array([[3.9, 2.0, 1.6]]), "moon": np.array([[-1.0, 4.0, 2.0]])}
)
LIGHT = {"srp_CrA_m": 0.7, "srp_pressure": 0.9, "au": 4.0}
# A Sun as wide as the body, as seen from the Moon: the penumbra is everywhere.
ECLIPSE = LIGHT | {"shadow_radius": 1.05, "sun_radius": 2.0}
TIDE = {"tide_k2": 0.6, "R_ref": 0.9, "GM_sun": 2.0, "GM_moon": 0.7}
WAVES = {"GM": 1.3, "R_ref": 0.9, "tide_day": 5915.5}
RELATIVITY = {"GM": 1.3, "c": 3.0}
AIR = {"drag_B": 0.6, "drag_rho0": 0.4, "drag_r0": 1.1, "drag_H": 1.3, "drag_omega": 0.2}
MASCON = {"mascon1_GM": 0.15, "mascon1_x": 0.3, "mascon1_y": -0.2, "mascon1_z": 0.1}
ELLIPSOID = {"GM": 1.3, "ellipsoid_scale": 0.9} | dict(
    zip(("ellipsoid_a", "ellipsoid_b", "ellipsoid_c"), (0.9, 0.7, 0.5), strict=True)
)
#: A tetrahedron whose centroid is not the origin.
BRICK = Mesh(
    [[0.9, 0, -0.3], [-0.5, 0.7, -0.4], [-0.4, -0.6, -0.3], [0.1, 0.1, 0.8]],
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
)
PERTURBER = {"GM": 1.3, "perturber1_GM": 0.8, "perturber1_a": 5.0, "perturber1_longitude": 0.7} | {
    "perturber1_t0": 0.2,
    "perturber1_inclination": 0.4,
    "perturber1_node": 0.9,
}
PUSH = {"manoeuvre1_t0": 0.5, "manoeuvre1_width": 0.6}
THRUST = {"thrust_t_on": 0.2, "thrust_t_off": 1.4, "thrust_width": 0.5}
FADING = {"recoil_tau": 1.7, "recoil_t0": 0.2}
FRICTION = {"friction_a": 0.3, "friction_v0": 1.3}
ECOM = {"ecom_D0": -0.4, "ecom_Y0": 0.3, "ecom_B0": 0.2, "ecom_Bc": -0.1, "ecom_Bs": 0.25}
SIX = (0.3, -0.2, 0.1, 0.4, -0.5, 0.6)


def named(prefix, keys, **more):
    return {f"{prefix}{k}": a for k, a in zip(keys, SIX, strict=False)} | more


ONCE = [f"{wave}_{axis}" for axis in "RTN" for wave in ("cos", "sin")]

EFFECT_CASES: dict[str, EffectCase] = {
    "point mass": EffectCase(PointMass(), {"GM": 1.3}, axisymmetric=True),
    "zonal 2": EffectCase(Zonal((2,)), zonals(2), axisymmetric=True),
    "zonal 3": EffectCase(Zonal((3,)), zonals(3), axisymmetric=True),
    "zonal 2-5": EffectCase(Zonal((2, 3, 4, 5)), zonals(2, 3, 4, 5), axisymmetric=True),
    "zonal 7, 4": EffectCase(Zonal((7, 4)), zonals(7, 4), axisymmetric=True),
    "harmonics 0": full(0, min_degree=0, axisymmetric=True),
    "harmonics 1": full(1, min_degree=0),
    "harmonics 2": full(2),
    "harmonics 5": full(5),
    "harmonics 8": full(8),
    "harmonics 5, order 0": full(5, 0, axisymmetric=True),
    "harmonics 6, order 2, from degree 3": full(6, 2, 3),
    "harmonics 3, spinning": spinning(3),
    "albedo": EffectCase(
        Albedo(),
        LIGHT | {"shadow_radius": 0.9, "body_albedo": 0.6},
        potential=False,
        harmonic=False,
        tracks=MOVING,
    ),
    "constant inertial": EffectCase(
        ConstantInertial(), {"inertial_a_x": 2e-3, "inertial_a_y": -3e-3, "inertial_a_z": 1e-3}
    ),
    "constant RTN": moving(ConstantRTN(), named("rtn_a_", "RTN"), axisymmetric=True),
    "drag": moving(ExponentialDrag(), AIR, axisymmetric=True),
    "Lense-Thirring": moving(
        LenseThirring(),
        RELATIVITY | {"lense_thirring_scale": 0.9, "lense_thirring_J": 1.7},
        axisymmetric=True,
    ),
    "linear radial": central(LinearRadial(), {"linear_radial_k": 2e-3}, axisymmetric=True),
    "manoeuvre": moving(
        ImpulsiveManoeuvre(), PUSH | named("manoeuvre1_dv_", "RTN"), axisymmetric=True
    ),
    "manoeuvre, inertial": moving(
        ImpulsiveManoeuvre(frame="inertial"), PUSH | named("manoeuvre1_dv_", "xyz")
    ),
    "mascon": EffectCase(Mascon(), MASCON),
    "mascon, spinning": EffectCase(Mascon(), MASCON | SPIN, spinning=True),
    "non-gravitational": moving(
        NonGravitationalA123(), named("A", "123", nongrav_r0=1.2), axisymmetric=True
    ),
    "non-gravitational, 2.7": moving(
        NonGravitationalA123(2.7), named("A", "123", nongrav_r0=1.2), axisymmetric=True
    ),
    "once per revolution": moving(OncePerRevolutionRTN(), named("opr_", ONCE)),
    "once per revolution, retrograde": moving(
        OncePerRevolutionRTN(retrograde=True), named("opr_", ONCE)
    ),
    "power law": central(
        PowerLawGravity(),
        {"GM": 1.3, "power_law_delta": 0.1, "power_law_r0": 1.4},
        axisymmetric=True,
    ),
    "Schwarzschild": moving(
        Schwarzschild(), RELATIVITY | {"schwarzschild_scale": 0.8}, axisymmetric=True
    ),
    "published field 4": published(4),
    "published tesserals 3-6, order 2": published(6, 2, "tesserals", 3),
    "published zonals 5": published(5, part="zonals", axisymmetric=True),
    # Waves of 1e-12 are made to matter, and light bodies that Love numbers do not drown them.
    "fine solid tide": EffectCase(
        FineSolidTide(),
        WAVES | {"fine_tide_scale": 1e7, "GM_sun": 2e-3, "GM_moon": 3e-3} | SPIN,
        spinning=True,
        tracks=MOVING,
    ),
    "ocean tide": EffectCase(OceanTide(), WAVES | {"ocean_tide_scale": 1e9}, tracks=MOVING),
    "pole tide": EffectCase(
        PoleTide(),
        {"GM": 1.3, "R_ref": 0.9, "pole_tide_scale": 40.0}
        | {"pole_tide_m1": 1.2, "pole_tide_m2": -0.7, "pole_tide_x": 0.4, "pole_tide_y": -0.9},
    ),
    "solid tide": EffectCase(SolidTide(), TIDE, tracks=MOVING),
    "solid tide of the Moon, still": EffectCase(
        SolidTide(("moon",)),
        {k: v for k, v in TIDE.items() if k != "GM_sun"},
        tracks=STILL,
    ),
    "Sun-line push": central(SunLinePush(), {"sun_line_a": 0.3}, tracks=MOVING),
    "Sun-line push, still": central(SunLinePush(), {"sun_line_a": 2e-3}, tracks=STILL),
    "sunlight": EffectCase(SolarRadiationPressure(shadow=False), LIGHT, tracks=MOVING),
    "sunlight, still": EffectCase(
        SolarRadiationPressure(shadow=False), LIGHT | {"srp_CrA_m": 2e-3}, tracks=STILL
    ),
    "sunlight with shadow": EffectCase(
        SolarRadiationPressure(), ECLIPSE, potential=False, harmonic=False, tracks=MOVING
    ),
    # An Earth of radius 1: heights of 600 km and more, where the air must be made to matter.
    "thermosphere": moving(
        ThermosphereDrag(),
        {"drag_B": 1e12, "drag_omega": 0.2, "thermosphere_R": 1.0, "thermosphere_day": 172.3},
    ),
    "third body": EffectCase(ThirdBody("moon"), {"GM_moon": 0.8}, tracks=MOVING),
    "third body, still": EffectCase(ThirdBody("moon"), {"GM_moon": 1e-3}, tracks=STILL),
    "thrust": moving(ContinuousThrust(), THRUST | {"thrust_a_V": -0.3}, axisymmetric=True),
    "thrust, RTN": moving(
        ContinuousThrust("rtn"), THRUST | named("thrust_a_", "RTN"), axisymmetric=True
    ),
    "aerodynamic lift": moving(
        AerodynamicLift(),
        {k: v for k, v in AIR.items() if k != "drag_B"} | {"lift_B": 0.4, "side_B": -0.3},
        axisymmetric=True,
    ),
    "empirical sunlight": moving(EmpiricalSunlight(shadow=False), ECOM, tracks=MOVING),
    "empirical sunlight with shadow": moving(
        EmpiricalSunlight(),
        ECOM | {k: v for k, v in ECLIPSE.items() if k.endswith("_radius")},
        tracks=MOVING,
    ),
    "friction": moving(VelocityDrag(), FRICTION, axisymmetric=True),
    "friction, square": moving(VelocityDrag(2.0), FRICTION, axisymmetric=True),
    "non-gravitational, water ice": moving(
        NonGravitationalA123(law="water_ice"),
        named("A", "123", nongrav_r0=1.2),
        axisymmetric=True,
    ),
    "Poynting-Robertson": moving(
        PoyntingRobertson(), RELATIVITY | {"pr_beta": 0.2, "pr_wind": 0.35}, axisymmetric=True
    ),
    "sunlight with two shadows": EffectCase(
        SolarRadiationPressure(occulter="moon"),
        ECLIPSE | {"occulter_radius": 0.9},
        potential=False,
        harmonic=False,
        tracks=MOVING,
    ),
    "thermal recoil": moving(
        ThermalRecoil(), {"recoil_a_sun": 0.3, "recoil_tau": 1.7, "recoil_t0": 0.2}, tracks=MOVING
    ),
    "thermal recoil, inertial": moving(
        ThermalRecoil("inertial"), FADING | named("recoil_a_", "xyz")
    ),
    "thermal recoil, RTN": moving(
        ThermalRecoil("rtn"), FADING | named("recoil_a_", "RTN"), axisymmetric=True
    ),
    "tidal lag": moving(
        TidalLag(),
        {"tide_k2": 0.6, "R_ref": 0.9, "tide_lag": 0.7, "tide_own_GM": 0.4, "tide_spin": 0.8},
        axisymmetric=True,
    ),
    "de Sitter": moving(
        DeSitter(),
        {"GM_sun": 2.0, "c": 3.0, "de_sitter_h": 1.7, "de_sitter_scale": 0.9},
        tracks=MOVING,
    ),
    "ellipsoid": EffectCase(Ellipsoid(4), ELLIPSOID),
    "polyhedron": EffectCase(Polyhedron(BRICK, 4), {"GM": 1.3, "polyhedron_scale": 0.9}),
    "unknown perturber": EffectCase(UnknownPerturber(), PERTURBER, moves=True),
}
