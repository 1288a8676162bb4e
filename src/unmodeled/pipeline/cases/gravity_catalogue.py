"""What a model may lack or mistake of a body's gravity field and of how it is turned."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.models.physics import (
    Effect,
    LinearRadial,
    Mascon,
    PowerLawGravity,
    ScaledField,
    Tesseral,
    Zonal,
)
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.setting import Setting
from unmodeled.pipeline.cases.setting import force_candidate as _force

__all__ = ["gravity_candidates"]

#: As planets and spacecraft see it, with what the solutions differ by: [Park2021].
_J2_OF_THE_SUN = {"J2": (2.2e-7, 0.2e-7)}


def gravity_candidates(s: Setting) -> list[Candidate]:
    """Return errors of GM, spin and pole, harmonics, mascons and published fields."""
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
            _force(
                "zonal_2",
                "zonal harmonic J2",
                Zonal((2,)),
                {"J2": 1e-6},
                "gravity",
                size,
                known=_J2_OF_THE_SUN,
            ),
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


def _fibonacci(count: int) -> Array:
    """Points spread evenly on the unit sphere, (n, 3)."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
