"""Truth of a formation: two spacecraft, each with all forces, and what one sees of the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from unmodeled.core.arrays import Array
from unmodeled.core.constants import GM_OF, RADIUS_OF
from unmodeled.core.frames import rtn_from_inertial, turned
from unmodeled.core.relative_frame import relative_from_inertial
from unmodeled.core.seeds import Streams
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import kepler_period, state_from_elements
from unmodeled.models.physics import (
    Dynamics,
    ExponentialDrag,
    PointMass,
    SolarRadiationPressure,
    SphericalHarmonics,
    ThirdBody,
    Zonal,
    egm2008_values,
)
from unmodeled.models.physics.motion import (
    ClohessyWiltshire,
    MeasuredReference,
    ReferenceOrbit,
    XuWang,
)
from unmodeled.models.physics.motion.reference_orbit import Oblate, reference_variables
from unmodeled.models.physics.motion.xu_wang import Reference
from unmodeled.pipeline.cases.surroundings import Surroundings
from unmodeled.pipeline.filters.interfaces import RateModel
from unmodeled.pipeline.filters.linear import LinearMeasurement
from unmodeled.pipeline.filters.state import Booleans
from unmodeled.pipeline.navigation.flight import Flight
from unmodeled.pipeline.navigation.scenario_config import CraftConfig, FormationConfig

__all__ = ["formation_flight"]


@dataclass(frozen=True)
class _Told:
    """A model with an acceleration that is known as a function of time."""

    model: RateModel
    missing: CubicSpline

    @property
    def size(self) -> int:
        return self.model.size

    def rates(self, x: Array, t: float) -> tuple[Array, Array]:
        rate, slope = self.model.rates(x, t)
        rate[:, 3:] += self.missing(t)
        return rate, slope


_MARGIN = 60.0  # s of track beyond the end, for the integrator's last step


def formation_flight(config: FormationConfig) -> Flight:
    """Fly both spacecraft.

    The filter's base is Clohessy-Wiltshire, the nonlinear model Xu-Wang about the orbit of the
    target as it is known (``reference``): it misses higher harmonics, air and light. The exact
    model is told what is missing.
    """
    field = egm2008_values(max(config.degree, 2))
    gm, radius = field["GM"], field["R_ref"]
    j2 = -math.sqrt(5.0) * field["C_2_0"]
    o = config.orbit
    fixed = (
        o.semi_major_axis_km * 1e3,
        o.eccentricity,
        *np.radians([o.inclination_deg, o.node_deg, o.periapsis_deg]),
    )
    anomalies = np.radians([o.true_anomaly_deg, config.chaser_true_anomaly_deg])
    target0, chaser0 = state_from_elements([[*fixed, nu] for nu in anomalies], gm)
    period = float(kepler_period(fixed[0], gm))
    times = np.arange(0.0, config.duration_s + 1e-6, config.measured.step_s)
    models = [_model(config, craft, field, times[-1]) for craft in (config.target, config.chaser)]
    target = models[0].propagate(target0, times)
    chaser = models[1].propagate(chaser0, times)
    pull = models[0].acceleration(target, times)
    truth = relative_from_inertial(target, chaser, pull)

    body = Oblate(gm, j2, radius)
    base = ClohessyWiltshire(2.0 * math.pi / period)
    known = XuWang(ReferenceOrbit.from_states(times, target, body))
    acceleration = _rate_of(times, truth)
    said = np.concatenate(
        [known.rates(x[None], float(t))[0][:, 3:] for x, t in zip(truth, times, strict=True)]
    )
    exact = _Told(known, CubicSpline(times, acceleration - said))
    gap = config.gap_orbits
    phases = {} if gap is None else {"gap": (gap[0] * period, gap[1] * period)}
    used = np.ones(len(times), dtype=bool)
    used[0] = False
    for start, end in phases.values():
        used &= ~((times > start) & (times <= end))
    nonlinear = XuWang(_reference(config, times, target, used, body))
    m = config.measured
    columns = [0, 1, 2] if not m.velocity_m_s else [0, 1, 2, 3, 4, 5]
    sigmas = [m.position_m] * 3 + [m.velocity_m_s] * 3
    sigma = np.repeat([config.start.position_m, config.start.velocity_m_s], 3)
    return Flight(
        name=config.name,
        title="formation in low Earth orbit",
        times=times,
        truth=truth,
        disturbance=acceleration - base.rates(truth, 0.0)[0][:, 3:],
        base=base,
        exact=exact,
        nonlinear=nonlinear,
        measurement=LinearMeasurement.of_sigma(columns, sigmas[: len(columns)], 6),
        used=used,
        start_sigma=sigma,
        believed_sigma=config.start.believed_factor * sigma,
        settle=config.settle_s,
        phases=phases,
        axes=("radial", "transverse", "normal"),
        facts={"period_s": period, "farthest_m": float(np.abs(truth[:, :3]).max())},
        suspects={} if config.truth == "j2" else _suspects(models[0], times, target),
    )


def _reference(
    config: FormationConfig, times: Array, target: Array, used: Booleans, body: Oblate
) -> Reference:
    """Return the target's orbit as the filters know it; one draw of its noise for all runs."""
    how = config.reference
    if how.source == "known":
        return ReferenceOrbit.from_states(times, target, body)
    if how.source == "integrated":
        return ReferenceOrbit.integrated(reference_variables(target[:1])[0], times, body)
    rng = Streams(config.seed).generator("navigate.reference")
    positions = target[:, :3] + how.position_m * rng.normal(size=(len(times), 3))
    seen = used.copy()
    seen[0] = True
    return MeasuredReference.from_positions(times, positions, body, seen, how.order)


def _suspects(model: Dynamics, times: Array, target: Array) -> dict[str, Array]:
    """Return what light and air push where the target is, for a unit of area over mass."""
    axes = rtn_from_inertial(target)
    partials = model.parameter_partials(target, ["srp_CrA_m", "drag_B"], times)
    return {name: turned(axes, partials[:, :, k]) for k, name in enumerate(("light", "air"))}


def _rate_of(times: Array, truth: Array) -> Array:
    """Return true relative accelerations (k, 3), the slope of a spline through velocities.

    A quintic spline through positions would lose digits; a cubic through velocities at a step of
    30 s is wrong by n^4 h^3 d / 24, below 1e-10 m/s2 at 30 m.
    """
    slope: Array = CubicSpline(times, truth[:, 3:])(times, 1)
    return slope


def _model(
    config: FormationConfig, craft: CraftConfig, field: dict[str, float], end: float
) -> Dynamics:
    if config.truth == "j2":
        values = {"GM": field["GM"], "R_ref": field["R_ref"]}
        values["J2"] = -math.sqrt(5.0) * field["C_2_0"]
        return Dynamics([PointMass(), Zonal((2,))], values)
    earth = load_body("earth")
    surroundings = Surroundings(earth, config.epoch, "icrf")
    end += _MARGIN
    perigee = config.orbit.semi_major_axis_km * 1e3 * (1.0 - config.orbit.eccentricity)
    assert earth.atmosphere is not None
    layer = earth.atmosphere.layer(perigee - earth.reference_radius)
    values = dict(field) | {
        "GM_sun": GM_OF["sun"].value,
        "GM_moon": GM_OF["moon"].value,
        "srp_CrA_m": craft.reflectivity * craft.area_m2 / craft.mass_kg,
        "shadow_radius": RADIUS_OF["earth"].value,
        "drag_B": craft.drag_coefficient * craft.area_m2 / craft.mass_kg,
        "drag_rho0": layer.density,
        "drag_r0": earth.reference_radius + layer.altitude,
        "drag_H": layer.scale_height,
        "drag_omega": earth.spin_rate,
    }
    effects = [
        PointMass(),
        SphericalHarmonics(config.degree),
        ThirdBody("sun"),
        ThirdBody("moon"),
        SolarRadiationPressure(),
        ExponentialDrag(),
    ]
    return Dynamics(
        effects,
        values,
        tracks=surroundings.tracks(-_MARGIN, end),
        orientation=surroundings.orientation(-_MARGIN, end),
    )
