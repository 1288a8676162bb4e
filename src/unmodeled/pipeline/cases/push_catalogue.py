"""Pushes that a model may lack: light on panels, heat, thrust, lift, friction of light."""

from __future__ import annotations

import itertools

import numpy as np

from unmodeled.core.constants import EARTH_ROTATION_RATE, RADIUS_OF
from unmodeled.models.physics import (
    AerodynamicLift,
    ContinuousThrust,
    EmpiricalSunlight,
    ExponentialDrag,
    PoyntingRobertson,
    SunLinePush,
    ThermalRecoil,
)
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.setting import Setting
from unmodeled.pipeline.cases.setting import force_candidate as _force

__all__ = ["air", "occulter", "push_candidates", "shadow_radius"]

#: Share of sunlight that heat sent to one side, and light on the panels' axes, may make up.
_HEAT, _PANEL, _THIRD = 0.1, 0.01, 0.02
#: Orbits of the Earth above this radius (m) are those for which the five constants were made.
_HIGH = 1.2e7
#: Decay times of a fading push that are searched, in lengths of the data.
_FADING = (0.05, 0.1, 0.2, 0.5, 1.0)
#: Switching times of a thrust that are searched: the arc is cut into so many pieces.
_PIECES = 10
#: Radiation pressure over the Sun's attraction for 1 m2/kg, and the solar wind [Gustafson1994].
_BETA, _WIND = 7.7e-4, 0.35
#: Share by which the air turns faster or slower than the body.
_WINDS = 0.3


def push_candidates(s: Setting) -> list[Candidate]:
    """Return what pushes: each with the size that radiation and air make one expect."""
    if s.body.name == "sun":
        return [_friction_of_light(s)]
    found = [*_lift(s), *_winds(s), _thrust(s)]
    if "sun" in s.bodies:
        found += [*_panels(s), *_heat(s)]
    return found


def shadow_radius(s: Setting) -> float:
    """Return the radius of the sphere that throws the body's shadow, m."""
    return RADIUS_OF[s.body.name].value if s.body.name in RADIUS_OF else s.body.brillouin_radius


def occulter(s: Setting) -> str:
    """Return "earth" if its shadow comes near an orbit of the Moon during the arcs, else ""."""
    tracks = s.dynamics.tracks
    if s.body.name != "moon" or tracks is None or not {"sun", "earth"} <= set(s.bodies):
        return ""
    times = np.linspace(*s.interval, 400)
    sun, earth = tracks.position("sun", times), tracks.position("earth", times)
    away = earth - sun
    away = away / np.linalg.norm(away, axis=1, keepdims=True)
    along = -np.sum(earth * away, axis=1)
    off = np.linalg.norm(earth + along[:, None] * away, axis=1)
    # The penumbra at the Moon is 1.3 radii of the Earth wide; and the way to the next time.
    reach = 2.0 * RADIUS_OF["earth"].value + s.radius + 1e3 * (times[1] - times[0])
    return "earth" if np.any((along > 0) & (off < reach)) else ""


def _panels(s: Setting) -> list[Candidate]:
    """Light along the axes of a satellite's panels: for the Earth's high satellites."""
    if s.body.name != "earth" or s.radius < _HIGH:
        return []
    effect, light = EmpiricalSunlight(), s.push / 3.0
    nulls = {"ecom_D0": 0.0, "ecom_Y0": 0.0, "ecom_B0": 0.0, "ecom_Bc": 0.0, "ecom_Bs": 0.0}
    nulls["shadow_radius"] = shadow_radius(s)
    third = {f"ecom_{k}": _THIRD * light for k in ("B0", "Bc", "Bs")}
    return [
        _force(
            "y_bias",
            "push along the solar panels (Y bias)",
            effect,
            {"ecom_Y0": _PANEL * light},
            "radiation",
            nulls,
        ),
        _force(
            "panel_light",
            "light across panels and Sun line, constant and once per revolution",
            effect,
            third,
            "radiation",
            nulls,
        ),
    ]


def _heat(s: Setting) -> list[Candidate]:
    start, end = s.interval
    size = _HEAT * s.push / 3.0
    span = max(end - start, 1.0)
    places = tuple({"recoil_tau": share * span} for share in _FADING)
    fading = _force(
        "thermal_recoil",
        "fading push along the Sun line (heat, outgassing)",
        ThermalRecoil(),
        {"recoil_a_sun": size},
        "non-gravitational",
        {**places[-1], "recoil_t0": start},
        places=places,
        searched=("recoil_tau",),
    )
    if not _eclipsed(s):
        # Without a shadow a constant push along the Sun line is sunlight, to 1e-3 in a month.
        return [fading]
    constant = _force(
        "sun_line_push",
        "push along the Sun line, in the shadow too",
        SunLinePush(),
        {"sun_line_a": size},
        "non-gravitational",
    )
    return [constant, fading]


def _eclipsed(s: Setting) -> bool:
    """Whether the osculating planes lead through the body's shadow."""
    tracks = s.dynamics.tracks
    if tracks is None:
        return False
    sun = tracks.position("sun", np.array([0.5 * sum(s.interval)]))[0]
    sun = sun / np.linalg.norm(sun)
    for arc in s.arcs:
        r, v = arc.state[:3], arc.state[3:]
        normal = np.cross(r, v)
        height = abs(float(normal @ sun)) / np.linalg.norm(normal)
        if np.linalg.norm(r) * height < shadow_radius(s):
            return True
    return False


def _thrust(s: Setting) -> Candidate:
    """Return a thrust along the velocity, searched over when it is on; not the whole arc."""
    start, end = s.interval
    cuts = np.linspace(start, end, _PIECES + 1)
    places = tuple(
        {"thrust_t_on": float(a), "thrust_t_off": float(b)}
        for a, b in itertools.combinations(cuts[1:-1], 2)
    )
    period = 2.0 * np.pi * np.sqrt(s.radius**3 / s.gm)
    return _force(
        "thrust",
        "thrust along the velocity for a while",
        ContinuousThrust(),
        {"thrust_a_V": s.push},
        "propulsion",
        {**places[0], "thrust_width": max(1.0, 5e-3 * period)},
        places=places,
        searched=("thrust_t_on", "thrust_t_off"),
    )


def _lift(s: Setting) -> list[Candidate]:
    if s.body.atmosphere is None:
        return []
    size = {"lift_B": 0.1 * s.ballistic, "side_B": 0.1 * s.ballistic}
    title = "lift and side force of the air"
    return [_force("lift", title, AerodynamicLift(), size, "atmosphere", air(s))]


def air(s: Setting) -> dict[str, float]:
    """Return the air of `ExponentialDrag`: the layer of the card's table at the lowest periapsis.

    Most of the drag of an eccentric orbit is met there.
    """
    if s.body.atmosphere is None:
        return {}
    model = s.dynamics.values
    named = ("drag_rho0", "drag_r0", "drag_H", "drag_omega")
    if all(n in model for n in named):
        return {n: model[n] for n in named}
    layer = s.body.atmosphere.layer(max(s.periapsis - s.body.reference_radius, 1e4))
    rate = EARTH_ROTATION_RATE.value if s.body.name == "earth" else s.body.spin_rate
    return {
        "drag_rho0": layer.density,
        "drag_r0": s.body.reference_radius + layer.altitude,
        "drag_H": layer.scale_height,
        "drag_omega": rate,
    }


def _winds(s: Setting) -> list[Candidate]:
    """Return an error of how fast the air turns, if the model has drag."""
    drag = next((e for e in s.dynamics.effects if isinstance(e, ExponentialDrag)), None)
    rate = s.dynamics.values.get("drag_omega", 0.0)
    if drag is None or rate == 0.0:
        return []
    return [
        _force(
            "air_rotation",
            "error of the rotation of the air (winds)",
            drag,
            {"drag_omega": _WINDS * abs(rate)},
            "atmosphere",
            {"drag_omega": rate},
        )
    ]


def _friction_of_light(s: Setting) -> Candidate:
    return _force(
        "poynting_robertson",
        "Poynting-Robertson drag",
        PoyntingRobertson(),
        {"pr_beta": _BETA * s.reflectivity},
        "radiation",
        {"pr_wind": _WIND},
        positive=("pr_beta",),
    )
