"""Bodies that nobody has seen, looked for on circles about the Sun."""

from __future__ import annotations

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.constants import GM_OF
from unmodeled.models.physics import UnknownPerturber
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.setting import Setting, force_candidate

__all__ = ["unknown_bodies"]

#: Radii of the circles over that of the orbit: as Neptune's over Uranus's, to either side.
_NEAREST, _FARTHEST = 1.2, 2.6
_LONGITUDES, _LEAST_RADII = 24, 6
#: Neighbouring circles part by no more than this at the ends of the data, rad: a longitude's step.
_STEP = 2.0 * np.pi / _LONGITUDES
#: More places than this are no search any more: the motion is known to too many turns.
_MOST = 480


def unknown_bodies(s: Setting) -> list[Candidate]:
    """Return an outer planet, searched over distance and longitude; none if the grid is too fine.

    The mass is linear. Places are circles in the ecliptic outside the orbit, their longitudes in
    the middle of the data; over many revolutions of the orbit neighbouring circles must lie too
    near each other to be searched.

    Parameters
    ----------
    s : Setting
        Of an orbit about the Sun.
    """
    if s.body.name != "sun":
        return []
    start, end = s.interval
    size = _size(s)
    slow, fast = (np.sqrt(s.gm / (k * size) ** 3) for k in (_FARTHEST, _NEAREST))
    radii = max(_LEAST_RADII, int(np.ceil((fast - slow) * 0.5 * (end - start) / _STEP)) + 1)
    if radii * _LONGITUDES > _MOST:
        return []
    # Even in the rate: what the data see is where the body is at either end.
    distances = (s.gm / np.linspace(fast, slow, radii) ** 2) ** (1.0 / 3.0)
    longitudes = np.arange(_LONGITUDES) * _STEP
    places = tuple(
        {"perturber1_a": float(a), "perturber1_longitude": float(angle)}
        for a in distances
        for angle in longitudes
    )
    return [
        force_candidate(
            "unknown_perturber",
            "unknown planet farther out (its direction is found; its distance against its mass "
            "is not)",
            UnknownPerturber(),
            {"perturber1_GM": GM_OF["neptune"].value},
            "third body",
            {**places[0], "perturber1_t0": 0.5 * (start + end)},
            places=places,
            searched=("perturber1_a", "perturber1_longitude"),
            positive=("perturber1_GM",),
        )
    ]


def _size(s: Setting) -> float:
    """Semi-major axis of the arcs' first states, median, m; their distance where it is none."""
    states = np.array([arc.state for arc in s.arcs])
    r: Array = np.linalg.norm(states[:, :3], axis=1)
    inverse = 2.0 / r - np.sum(states[:, 3:] ** 2, axis=1) / s.gm
    return float(np.median(np.where(inverse > 0, 1.0 / np.maximum(inverse, 1e-30), r)))
