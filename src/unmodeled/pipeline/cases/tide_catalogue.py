"""Tides of the Earth that a model may lack beside the plain solid tide."""

from __future__ import annotations

from unmodeled.core.constants import GM_OF
from unmodeled.models.physics import Effect, FineSolidTide, OceanTide, PoleTide
from unmodeled.pipeline.cases.accepted_values import tidal_values
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.setting import Setting, force_candidate

__all__ = ["tide_candidates"]

#: Effect, title, how well its scale of 1 is known: frequencies of the solid tide, the main waves of
#: the oceans, and a mean pole on which the conventions changed their mind.
_TIDES: tuple[tuple[Effect, str, float], ...] = (
    (FineSolidTide(), "fine part of the solid tide (order, lag, frequency)", 0.05),
    (OceanTide(), "tide of the oceans", 0.2),
    (PoleTide(), "pole tide", 0.3),
)


def tide_candidates(s: Setting) -> list[Candidate]:
    """Return the tides of the Earth, where it turns and time zero is known."""
    values = s.dynamics.values
    if s.body.name != "earth" or not s.epoch or "spin_rate" not in values:
        return []
    surveyed = {f"GM_{n}": GM_OF[n].value for n in ("sun", "moon")}
    surveyed |= {"GM": s.gm, "R_ref": s.body.reference_radius, **tidal_values(s.epoch)}
    found = []
    for effect, title, sigma in _TIDES:
        if not set(effect.bodies) <= set(s.bodies):
            continue
        names = [p.name for p in effect.parameters]
        scale = names[0]
        fixed = {n: values.get(n, surveyed[n]) for n in names[1:]}
        found.append(
            force_candidate(
                effect.name,
                title,
                effect,
                {scale: 1.0},
                "third body" if effect.name != "pole_tide" else "gravity",
                fixed,
                known={scale: (1.0, sigma)},
            )
        )
    return found
