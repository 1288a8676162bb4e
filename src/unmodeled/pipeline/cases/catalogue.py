"""The whole catalogue as candidates: what could be missing from a model about this body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodeled.core.constants import ASTRONOMICAL_UNIT, EARTH_ROTATION_RATE, GM_OF, RADIUS_OF
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.measurement_effects import MeasurementEffect
from unmodeled.models.physics import (
    Albedo,
    ConstantInertial,
    ConstantRTN,
    Dynamics,
    Effect,
    ExponentialDrag,
    ImpulsiveManoeuvre,
    LenseThirring,
    LinearRadial,
    Mascon,
    NonGravitationalA123,
    PowerLawGravity,
    ScaledField,
    Schwarzschild,
    SolarRadiationPressure,
    SolidTide,
    Tesseral,
    ThirdBody,
    Zonal,
)
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.instrument_catalogue import instrument_candidates
from unmodeled.pipeline.cases.spacecraft import Spacecraft
from unmodeled.pipeline.fit_problem import Arc

__all__ = ["Setting", "candidate_by_name", "default_candidates"]

#: Pressure of sunlight at one astronomical unit, for expected sizes only, N/m2.
_SUNLIGHT = 4.56e-6
#: Area over mass that is expected of a spacecraft that is not described, m2/kg.
_AREA_TO_MASS = 0.02
_MANOEUVRE_EPOCHS = 48
#: Parameters of the body's orientation, which every effect in body axes shares.
_TURNING = frozenset({"spin_rate", "prime_meridian", "pole_x", "pole_y"})


@dataclass(frozen=True)
class Setting:
    """What decides which candidates make sense, and how large they can be.

    Parameters
    ----------
    body : Body
        Central body.
    dynamics : Dynamics
        The known model.
    arcs : tuple of Arc
        What was measured.
    spacecraft : Spacecraft, optional
        Its area and mass.
    """

    body: Body
    dynamics: Dynamics
    arcs: tuple[Arc, ...]
    spacecraft: Spacecraft | None = None

    @property
    def gm(self) -> float:
        """GM of the model, m3/s2."""
        return self.dynamics.values.get("GM", self.body.gm)

    @property
    def radius(self) -> float:
        """Median distance of the arcs' first states, m."""
        return float(np.median([np.linalg.norm(arc.state[:3]) for arc in self.arcs]))

    @property
    def interval(self) -> tuple[float, float]:
        """First and last measurement, s."""
        times = [m.times for arc in self.arcs for m in arc.measurements]
        return float(min(t[0] for t in times)), float(max(t[-1] for t in times))

    @property
    def reflectivity(self) -> float:
        """Expected Cr A / m, m2/kg."""
        if self.spacecraft is None:
            return 1.3 * _AREA_TO_MASS
        return self.spacecraft.reflectivity * self.spacecraft.area / self.spacecraft.mass

    @property
    def ballistic(self) -> float:
        """Expected Cd A / m, m2/kg."""
        if self.spacecraft is None:
            return 2.2 * _AREA_TO_MASS
        return self.spacecraft.drag_coefficient * self.spacecraft.area / self.spacecraft.mass

    @property
    def push(self) -> float:
        """Expected size of a small push: three times that of sunlight here, m/s2."""
        distance = ASTRONOMICAL_UNIT.value
        if self.body.name == "sun":
            distance = self.radius
        elif self.dynamics.tracks and "sun" in self.dynamics.tracks.coefficients:
            sun = self.dynamics.tracks.position("sun", np.array([self.interval[0]]))
            distance = float(np.linalg.norm(sun))
        return 3.0 * _SUNLIGHT * self.reflectivity * (ASTRONOMICAL_UNIT.value / distance) ** 2

    @property
    def bodies(self) -> tuple[str, ...]:
        """Other bodies whose place is known."""
        tracks = self.dynamics.tracks
        return tuple(tracks.coefficients) if tracks else ()


def default_candidates(
    body: Body,
    dynamics: Dynamics,
    arcs: Sequence[Arc],
    spacecraft: Spacecraft | None = None,
    instruments: Sequence[MeasurementEffect] = (),
) -> tuple[Candidate, ...]:
    """Return everything in the catalogue that makes sense here and that the model lacks.

    Parameters
    ----------
    body, dynamics, arcs, spacecraft
        As in `Setting`.
    instruments : sequence of MeasurementEffect
        Known effects of the measurements.
    """
    s = Setting(body, dynamics, tuple(arcs), spacecraft)
    forces = [*_gravity(s), *_bodies(s), *_radiation(s), *_relativity(s), *_pushes(s)]
    present = {term for effect in dynamics.effects for term in effect.terms}
    fresh = [_of_the_model(c, dynamics) for c in forces if _is_new(c, present, dynamics)]
    names = {p.name for effect in instruments for p in effect.parameters}
    measured = [
        c for c in instrument_candidates(s.arcs) if not names & {p.name for p in c.parameters}
    ]
    return (*fresh, *measured)


def candidate_by_name(name: str, candidates: Sequence[Candidate]) -> Candidate:
    """Return the candidate of a name.

    Raises
    ------
    ConfigError
        If there is none; the nearest is suggested.
    """
    found = {c.name: c for c in candidates}
    if name not in found:
        raise ConfigError(
            f'there is no candidate "{name}" for this case',
            allowed=", ".join(found) or "none is left",
            do=nearest(name, found),
        )
    return found[name]


def _is_new(candidate: Candidate, present: set[str], dynamics: Dynamics) -> bool:
    effect = candidate.effect
    if not isinstance(effect, Effect):
        return True
    if not effect.terms & present:
        return True
    # An error of a parameter that the model has; those of accepted values have none.
    known = set(candidate.estimate) <= set(dynamics.values)
    return known and effect.terms <= present and not candidate.known


def _of_the_model(candidate: Candidate, dynamics: Dynamics) -> Candidate:
    """Turn a candidate that the model has already into an error of its parameters."""
    names = set(candidate.estimate)
    values = dynamics.values
    present = {term for effect in dynamics.effects for term in effect.terms}
    terms = candidate.effect.terms if isinstance(candidate.effect, Effect) else frozenset()
    if not names <= set(values) or not terms <= present:
        return candidate
    own = next(e for e in dynamics.effects if names <= {p.name for p in e.parameters} | _TURNING)
    title = candidate.title
    return replace(
        candidate,
        effect=own,
        title=title if title.startswith("error") else f"error of the {title}",
        values={n: values[n] for n in candidate.estimate},
    )


def _force(
    name: str,
    title: str,
    effect: Effect,
    estimate: Mapping[str, float],
    family: str,
    values: Mapping[str, float] | None = None,
    **more: object,
) -> Candidate:
    """Return a force with its estimated parameters, zero if absent, and their expected sizes."""
    filled = dict.fromkeys(estimate, 0.0) | dict(values or {})
    return Candidate(
        name,
        title,
        effect,
        tuple(estimate),
        filled,
        tuple(estimate.values()),
        family,
        **more,  # type: ignore[arg-type]
    )


def _gravity(s: Setting) -> list[Candidate]:
    values = s.dynamics.values
    point = next((e for e in s.dynamics.effects if "GM" in {p.name for p in e.parameters}), None)
    found: list[Candidate] = []
    if point is not None:
        share = 1e-7 if s.body.name in ("earth", "moon", "mars", "sun") else 1e-2
        found.append(
            _force("gm_error", "error of GM", point, {"GM": share * s.gm}, "gravity", {"GM": s.gm})
        )
    if s.body.name == "sun":
        size = {"R_ref": s.body.reference_radius}
        return [
            *found,
            _force("zonal_2", "zonal harmonic J2", Zonal((2,)), {"J2": 1e-6}, "gravity", size),
            _force(
                "power_law",
                "gravity that falls as r^-(2+d)",
                PowerLawGravity(),
                {"power_law_delta": 1e-7},
                "gravity",
                {"power_law_r0": s.radius},
            ),
            _force(
                "ring",
                "outer ring or shell, force growing with distance",
                LinearRadial(),
                {"linear_radial_k": 1e-19},
                "gravity",
            ),
        ]
    field = {"R_ref": values.get("R_ref", s.body.reference_radius)}
    # Kaula's rule, [Kaula1966]: 1e-5 / n^2 on the Earth; small bodies are a thousand times rougher.
    rough = {"earth": 1e-5, "moon": 1.5e-4, "mars": 1.3e-4}.get(s.body.name, 3e-2)
    shape = s.body.zonal_unnormalised()
    for n in range(2, 7):
        size = max(np.sqrt(2 * n + 1) * rough / n**2, 3.0 * abs(shape.get(n, 0.0)))
        title = f"zonal harmonic J{n}"
        found.append(_force(f"zonal_{n}", title, Zonal((n,)), {f"J{n}": size}, "gravity", field))
    if "spin_rate" in values:
        for n in range(2, 5):
            for m in range(1, n + 1):
                found.append(
                    _force(
                        f"tesseral_{n}_{m}",
                        f"tesseral harmonic C{n}{m}, S{n}{m}",
                        Tesseral(n, m),
                        {f"C_{n}_{m}": rough / n**2, f"S_{n}_{m}": rough / n**2},
                        "gravity",
                        field,
                    )
                )
        found += _orientation(s, point)
        if s.body.name != "earth":
            found.append(_mascon(s))
    if s.body.gravity_field == "egm2008":
        found += _fields(s)
    return found


def _fields(s: Setting) -> list[Candidate]:
    """Return the parts of the published field that a model may lack as a whole."""
    found = []
    for part, low, high in (("tesserals", 2, 16), ("all", 17, 24)):
        effect = ScaledField(degree=high, order=high, part=part, min_degree=low)
        scale = next(p.name for p in effect.parameters if p.name.endswith("_scale"))
        title = f"tesserals of EGM2008 to degree {high}" if low == 2 else "EGM2008, degrees 17-24"
        found.append(
            _force(
                f"egm2008_{part}_{low}_{high}",
                title,
                effect,
                {scale: 1.0},
                "gravity",
                known={scale: (1.0, 0.01)},
            )
        )
    return found


def _orientation(s: Setting, effect: Effect | None) -> list[Candidate]:
    """Errors of spin rate and pole, of all forces in body axes together."""
    in_body = next((e for e in s.dynamics.effects if e.axes == "body"), None)
    if in_body is None or effect is None:
        return []
    values = s.dynamics.values
    span = max(s.interval[1] - s.interval[0], 1.0)
    found = []
    spins = any(not e.terms <= _ZONAL_TERMS for e in s.dynamics.effects if e.axes == "body")
    if spins:
        found.append(
            _force(
                "spin_rate_error",
                "error of the rotation rate",
                in_body,
                {"spin_rate": 1e-2 / span},
                "gravity",
                {"spin_rate": values["spin_rate"]},
            )
        )
    if "pole_x" in values:
        size = {"pole_x": 1e-2, "pole_y": 1e-2}
        now = {k: values[k] for k in size}
        found.append(_force("pole_error", "error of the pole", in_body, size, "gravity", now))
    return found


_ZONAL_TERMS = frozenset({"point_mass", *(f"gravity C({n},0)" for n in range(40))})


def _mascon(s: Setting) -> Candidate:
    """Return a mass concentration, searched over a grid of places below the surface."""
    depth = 0.75 * s.body.reference_radius
    points = _fibonacci(72) * depth
    places = tuple(
        {f"mascon1_{k}": float(v) for k, v in zip("xyz", point, strict=True)} for point in points
    )
    return _force(
        "mascon",
        "mass concentration",
        Mascon(),
        {"mascon1_GM": 1e-2 * s.gm},
        "gravity",
        dict(places[0]),
        places=places,
        searched=("mascon1_x", "mascon1_y", "mascon1_z"),
    )


def _bodies(s: Setting) -> list[Candidate]:
    names = [n for n in s.bodies if n in GM_OF and n != s.body.name]
    found = []
    for name in names:
        gm = GM_OF[name].value
        key = f"GM_{name}"
        found.append(
            _force(
                f"third_body_{name}",
                f"attraction of {'the ' if name in ('sun', 'moon') else ''}{name.capitalize()}",
                ThirdBody(name),
                {key: gm},
                "third body",
                known={key: (gm, 1e-6 * gm)},
            )
        )
    raising = tuple(n for n in ("moon", "sun") if n in names)
    k2 = s.body.love_number_k2
    if raising and k2 and s.body.name != "sun":
        values = {f"GM_{n}": s.dynamics.values.get(f"GM_{n}", GM_OF[n].value) for n in raising}
        values["R_ref"] = s.dynamics.values.get("R_ref", s.body.reference_radius)
        found.append(
            _force(
                "solid_tide",
                "solid tide",
                SolidTide(raising),
                {"tide_k2": 0.3},
                "third body",
                values,
                known={"tide_k2": (k2, 0.02)},
            )
        )
    return found


def _radiation(s: Setting) -> list[Candidate]:
    if s.body.name == "sun" or "sun" not in s.bodies:
        return []
    shadow = {
        "shadow_radius": RADIUS_OF[s.body.name].value
        if s.body.name in RADIUS_OF
        else s.body.brillouin_radius
    }
    found = [
        _force(
            "srp",
            "solar radiation pressure",
            SolarRadiationPressure(),
            {"srp_CrA_m": 2.0 * s.reflectivity},
            "radiation",
            shadow,
        )
    ]
    if s.body.name in ("earth", "moon", "mars"):
        effect = Albedo()
        name = effect.parameters[0].name
        found.append(
            _force("albedo", "light from the body", effect, {name: s.reflectivity}, "radiation")
        )
    return found


def _relativity(s: Setting) -> list[Candidate]:
    key = "schwarzschild_scale"
    found = [
        _force(
            "relativity",
            "first post-Newtonian term",
            Schwarzschild(),
            {key: 1.0},
            "relativity",
            known={key: (1.0, 1e-4)},
        )
    ]
    if s.body.name == "earth":
        key = "lense_thirring_scale"
        found.append(
            _force(
                "lense_thirring",
                "frame dragging",
                LenseThirring(),
                {key: 1.0},
                "relativity",
                # Angular momentum of the Earth per unit mass, [IERS2010] section 10.3.
                {"lense_thirring_J": 9.8e8},
                known={key: (1.0, 0.01)},
            )
        )
    return found


def _pushes(s: Setting) -> list[Candidate]:
    found = []
    if s.body.atmosphere is not None:
        altitude = max(s.radius - s.body.reference_radius, 1e4)
        layer = s.body.atmosphere.layer(altitude)
        rate = EARTH_ROTATION_RATE.value if s.body.name == "earth" else s.body.spin_rate
        found.append(
            _force(
                "drag",
                "atmospheric drag",
                ExponentialDrag(),
                {"drag_B": 3.0 * s.ballistic},
                "atmosphere",
                {
                    "drag_rho0": layer.density,
                    "drag_r0": s.body.reference_radius + layer.altitude,
                    "drag_H": layer.scale_height,
                    "drag_omega": rate,
                },
            )
        )
    if s.body.name == "sun":
        sizes = {"A1": 1e-11, "A2": 1e-13, "A3": 1e-12}
        words = {"A1": "radial", "A2": "transverse (Yarkovsky)", "A3": "normal"}
        nulls = dict.fromkeys(sizes, 0.0) | {"nongrav_r0": ASTRONOMICAL_UNIT.value}
        return [
            Candidate(
                f"nongravitational_{name}",
                f"non-gravitational {words[name]} acceleration {name}",
                NonGravitationalA123(),
                (name,),
                nulls,
                (size,),
                "non-gravitational",
            )
            for name, size in sizes.items()
        ]
    words = {"R": "radial", "T": "transverse", "N": "normal"}
    nulls = {f"rtn_a_{k}": 0.0 for k in "RTN"}
    for k, word in words.items():
        found.append(
            Candidate(
                f"constant_{word}",
                f"constant {word} push",
                ConstantRTN(),
                (f"rtn_a_{k}",),
                nulls,
                (s.push,),
                "non-gravitational",
            )
        )
    found.append(
        _force(
            "constant_inertial",
            "push constant in inertial space",
            ConstantInertial(),
            {f"inertial_a_{k}": s.push for k in "xyz"},
            "non-gravitational",
        )
    )
    found.append(_manoeuvre(s))
    return found


def _manoeuvre(s: Setting) -> Candidate:
    start, end = s.interval
    # The outermost epochs are left out: a kick there is a change of the initial state.
    epochs = np.linspace(start, end, _MANOEUVRE_EPOCHS + 2)[1:-1]
    period = 2.0 * np.pi * np.sqrt(s.radius**3 / s.gm)
    speed = np.sqrt(s.gm / s.radius)
    places = tuple({"manoeuvre1_t0": float(t)} for t in epochs)
    return _force(
        "manoeuvre",
        "impulsive manoeuvre",
        ImpulsiveManoeuvre(),
        {f"manoeuvre1_dv_{k}": 1e-5 * speed for k in "RTN"},
        "propulsion",
        {"manoeuvre1_t0": places[0]["manoeuvre1_t0"], "manoeuvre1_width": max(1.0, 2e-4 * period)},
        places=places,
        searched=("manoeuvre1_t0",),
    )


def _fibonacci(count: int) -> np.ndarray:
    """Points spread evenly on the unit sphere, (n, 3)."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
