"""Initial conditions of collision-free orbits, drawn from ranges of Keplerian elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, OrbitError, nearest
from unmodeled.core.seeds import Streams
from unmodeled.datasets.elements import ELEMENT_NAMES, kepler_period, state_from_elements
from unmodeled.models.physics import Dynamics

__all__ = [
    "SCREENING_PERIODS",
    "TABLE_3",
    "CollisionFree",
    "checked_ranges",
    "collision_free",
    "require_collision_free",
    "sample_elements",
]

#: [Neamati2022] Table 3: semi-major axis in Brillouin radii, angles in degrees.
TABLE_3: Mapping[str, tuple[float, float]] = {
    "semi_major_axis": (1.25, 3.0),
    "eccentricity": (0.05, 0.75),
    "inclination": (0.0, 180.0),
    "node": (0.0, 180.0),
    "periapsis": (0.0, 180.0),
    "true_anomaly": (0.0, 180.0),
}
#: An orbit is collision-free if it stays outside the Brillouin sphere this many Kepler periods.
SCREENING_PERIODS = 50.0
# Candidates are drawn and screened in blocks of fixed size, so that asking for more orbits
# appends to the list and never changes its beginning.
_BLOCK = 16
_GIVE_UP_AFTER = 2000


@dataclass(frozen=True)
class CollisionFree:
    """Collision-free initial conditions.

    Parameters
    ----------
    elements : DataFrame
        One row an orbit: semi-major axis in Brillouin radii, angles in degrees.
    states : ndarray (n, 6)
        m and m/s, inertial.
    tried : int
        How many candidates were drawn to find them.
    """

    elements: pd.DataFrame
    states: Array
    tried: int


def sample_elements(
    count: int,
    generator: np.random.Generator,
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> pd.DataFrame:
    """Draw elements uniformly and independently from their ranges.

    Parameters
    ----------
    count : int
        Number of rows.
    generator : numpy Generator
        Source of randomness.
    ranges : mapping, optional
        Replaces some of `TABLE_3`.

    Raises
    ------
    ConfigError
        Unknown element, empty range, eccentricity outside [0, 1).
    """
    limits = checked_ranges(ranges)
    low = np.array([limits[name][0] for name in ELEMENT_NAMES])
    high = np.array([limits[name][1] for name in ELEMENT_NAMES])
    # Row by row, so that the first rows do not depend on how many are drawn.
    return pd.DataFrame(
        low + (high - low) * generator.random((count, len(ELEMENT_NAMES))),
        columns=list(ELEMENT_NAMES),
    )


def checked_ranges(
    ranges: Mapping[str, tuple[float, float]] | None,
) -> dict[str, tuple[float, float]]:
    """Return `TABLE_3` with replacements, after checking them; errors as `sample_elements`."""
    limits = dict(TABLE_3)
    for name, pair in (ranges or {}).items():
        if name not in limits:
            raise ConfigError(f'unknown orbital element "{name}"', do=nearest(name, limits))
        low, high = pair
        if not (np.isfinite(low) and np.isfinite(high) and low <= high):
            raise ConfigError(f"range of {name} is {low} to {high}", allowed="low <= high")
        limits[name] = (low, high)
    if not 0 <= limits["eccentricity"][0] <= limits["eccentricity"][1] < 1:
        raise OrbitError(
            "range of eccentricity is {} to {}".format(*limits["eccentricity"]),
            allowed="0 <= e < 1",
        )
    if limits["semi_major_axis"][0] <= 0:
        raise ConfigError("range of semi_major_axis starts at or below 0", allowed="numbers > 0")
    return limits


def states_of(elements: pd.DataFrame, gm: float, radius: float) -> Array:
    """Return states (n, 6) in SI of a table of elements in Brillouin radii and degrees."""
    el = elements[list(ELEMENT_NAMES)].to_numpy(dtype=np.float64).copy()
    el[:, 0] *= radius
    el[:, 2:] = np.deg2rad(el[:, 2:])
    return state_from_elements(el, gm)


def collision_free(
    dynamics: Dynamics,
    radius: float,
    count: int,
    streams: Streams,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    *,
    periods: float = SCREENING_PERIODS,
) -> CollisionFree:
    """Draw orbits until ``count`` of them stay outside the Brillouin sphere.

    The list for a smaller ``count`` is the beginning of the list for a larger one.

    Parameters
    ----------
    dynamics : Dynamics
        The true gravity field, SI.
    radius : float
        Brillouin radius, m.
    count : int
        How many orbits.
    streams : Streams
        Uses the stream ``initial_conditions``.
    ranges : mapping, optional
        Replaces some of `TABLE_3`.
    periods : float
        How many Kepler periods each orbit is followed.

    Raises
    ------
    ConfigError
        If ``count`` is below 1, or a range is wrong.
    OrbitError
        If 2000 candidates in a row hit the body.
    """
    if count < 1:
        raise ConfigError(f"{count} initial conditions are asked for", allowed="1 or more")
    gm = dynamics.values["GM"]
    generator = streams.generator("initial_conditions")
    kept: list[pd.DataFrame] = []
    found = tried = since = 0
    while found < count:
        block = sample_elements(_BLOCK, generator, ranges)
        states = states_of(block, gm, radius)
        free = np.isnan(_entry(dynamics, states, block, radius, periods))
        tried += _BLOCK
        since = 0 if free.any() else since + _BLOCK
        if since >= _GIVE_UP_AFTER:
            raise OrbitError(
                f"none of {since} orbits drawn in a row stays outside {radius:g} m",
                do="raise the range of semi_major_axis or lower that of eccentricity",
            )
        kept.append(block[free])
        found += int(free.sum())
    elements = pd.concat(kept, ignore_index=True).iloc[:count]
    return CollisionFree(elements, states_of(elements, gm, radius), tried)


def require_collision_free(
    dynamics: Dynamics, elements: pd.DataFrame, radius: float, periods: float
) -> Array:
    """Return the states of given elements, or refuse an orbit that hits the body.

    Raises
    ------
    OrbitError
        Naming the orbit and when it comes down.
    """
    states = states_of(elements, dynamics.values["GM"], radius)
    entry = _entry(dynamics, states, elements, radius, periods)
    hit = np.flatnonzero(~np.isnan(entry))
    if len(hit):
        k = int(hit[0])
        period = float(
            kepler_period(elements["semi_major_axis"].iloc[k] * radius, dynamics.values["GM"])
        )
        raise OrbitError(
            f"orbit {k} (a = {elements['semi_major_axis'].iloc[k]:g} Brillouin radii, "
            f"e = {elements['eccentricity'].iloc[k]:g}) hits the body: it enters the Brillouin "
            f"sphere of {radius:g} m after {entry[k] / period:.2f} periods",
            do="raise its semi-major axis or lower its eccentricity",
        )
    return states


def _entry(
    dynamics: Dynamics, states: Array, elements: pd.DataFrame, radius: float, periods: float
) -> Array:
    a = elements["semi_major_axis"].to_numpy(dtype=np.float64) * radius
    return dynamics.first_collision(
        states, periods * kepler_period(a, dynamics.values["GM"]), radius
    )
