"""The whole catalogue as candidates: what could be missing from a model about this body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, RADIUS_OF
from unmodeled.core.errors import ConfigError, nearest
from unmodeled.datasets.bodies import Body
from unmodeled.datasets.measurement_effects import MeasurementEffect
from unmodeled.models.physics import (
    Albedo,
    ConstantInertial,
    ConstantRTN,
    DeSitter,
    Dynamics,
    Effect,
    ExponentialDrag,
    ImpulsiveManoeuvre,
    LenseThirring,
    NonGravitationalA123,
    Schwarzschild,
    SolarRadiationPressure,
    SolidTide,
    ThirdBody,
)
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.gravity_catalogue import gravity_candidates
from unmodeled.pipeline.cases.instrument_catalogue import instrument_candidates
from unmodeled.pipeline.cases.push_catalogue import (
    air,
    occulter,
    push_candidates,
    shadow_radius,
)
from unmodeled.pipeline.cases.setting import Setting
from unmodeled.pipeline.cases.setting import force_candidate as _force
from unmodeled.pipeline.cases.spacecraft import Spacecraft
from unmodeled.pipeline.cases.tide_catalogue import tide_candidates
from unmodeled.pipeline.cases.unknown_bodies import unknown_bodies
from unmodeled.pipeline.fit_problem import Arc

__all__ = ["candidate_by_name", "default_candidates"]

_MANOEUVRE_EPOCHS = 48
#: Parameters of the body's orientation, which every effect in body axes shares.
_TURNING = frozenset({"spin_rate", "prime_meridian", "pole_x", "pole_y"})


def default_candidates(
    body: Body,
    dynamics: Dynamics,
    arcs: Sequence[Arc],
    spacecraft: Spacecraft | None = None,
    instruments: Sequence[MeasurementEffect] = (),
    epoch: str = "",
) -> tuple[Candidate, ...]:
    """Return everything in the catalogue that makes sense here and that the model lacks.

    Parameters
    ----------
    body, dynamics, arcs, spacecraft, epoch
        As in `Setting`.
    instruments : sequence of MeasurementEffect
        Known effects of the measurements.
    """
    s = Setting(body, dynamics, tuple(arcs), spacecraft, epoch)
    forces = [
        *gravity_candidates(s),
        *_bodies(s),
        *tide_candidates(s),
        *_radiation(s),
        *_relativity(s),
        *_pushes(s),
        *push_candidates(s),
        *unknown_bodies(s),
    ]
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
        positive=(),
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
                positive=(key,),
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
                positive=("tide_k2",),
            )
        )
    return found


def _radiation(s: Setting) -> list[Candidate]:
    if s.body.name == "sun" or "sun" not in s.bodies:
        return []
    shadow, other = {"shadow_radius": shadow_radius(s)}, occulter(s)
    if other:
        shadow["occulter_radius"] = RADIUS_OF[other].value
    found = [
        _force(
            "srp",
            "solar radiation pressure",
            SolarRadiationPressure(occulter=other),
            {"srp_CrA_m": 2.0 * s.reflectivity},
            "radiation",
            shadow,
            positive=("srp_CrA_m",),
        )
    ]
    if s.body.name in ("earth", "moon", "mars"):
        effect = Albedo()
        name = effect.parameters[0].name
        found.append(
            _force(
                "albedo",
                "light from the body",
                effect,
                {name: s.reflectivity},
                "radiation",
                positive=(name,),
            )
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
            positive=(key,),
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
                positive=(key,),
            )
        )
    if s.body.name == "earth" and "sun" in s.bodies:
        key = "de_sitter_scale"
        gm = {"GM_sun": s.dynamics.values.get("GM_sun", GM_OF["sun"].value)}
        found.append(
            _force(
                "de_sitter",
                "geodetic precession",
                DeSitter(),
                {key: 1.0},
                "relativity",
                gm,
                known={key: (1.0, 0.01)},
            )
        )
    return found


def _pushes(s: Setting) -> list[Candidate]:
    found = []
    if s.body.atmosphere is not None:
        found.append(
            _force(
                "drag",
                "atmospheric drag",
                ExponentialDrag(),
                {"drag_B": 3.0 * s.ballistic},
                "atmosphere",
                air(s),
                positive=("drag_B",),
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
