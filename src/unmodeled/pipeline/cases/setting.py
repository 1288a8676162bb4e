"""What decides which candidates make sense, and how large they can be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from unmodeled.core.constants import ASTRONOMICAL_UNIT
from unmodeled.datasets.bodies import Body
from unmodeled.models.physics import Dynamics, Effect
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.spacecraft import Spacecraft
from unmodeled.pipeline.fit_problem import Arc

__all__ = ["Setting", "force_candidate"]

#: Pressure of sunlight at one astronomical unit, for expected sizes only, N/m2.
_SUNLIGHT = 4.56e-6
#: Area over mass that is expected of a spacecraft that is not described, m2/kg.
_AREA_TO_MASS = 0.02


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
    epoch : str
        Time zero with its scale; without it there are no tides of the oceans and the pole.
    """

    body: Body
    dynamics: Dynamics
    arcs: tuple[Arc, ...]
    spacecraft: Spacecraft | None = None
    epoch: str = ""

    @property
    def gm(self) -> float:
        """GM of the model, m3/s2."""
        return self.dynamics.values.get("GM", self.body.gm)

    @property
    def radius(self) -> float:
        """Median distance of the arcs' first states, m."""
        return float(np.median([np.linalg.norm(arc.state[:3]) for arc in self.arcs]))

    @property
    def periapsis(self) -> float:
        """Lowest periapsis of the arcs' first osculating orbits, m."""
        lowest = []
        for arc in self.arcs:
            r, v = arc.state[:3], arc.state[3:]
            h = np.cross(r, v)
            eccentricity = np.linalg.norm(np.cross(v, h) / self.gm - r / np.linalg.norm(r))
            lowest.append(float(h @ h / self.gm / (1.0 + eccentricity)))
        return min(lowest)

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


def force_candidate(
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
