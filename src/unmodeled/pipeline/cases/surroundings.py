"""What surrounds an orbit: where the other bodies are, and how the central one is turned."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.constants import GM_OF
from unmodeled.core.earth_orientation import icrf_from_itrf
from unmodeled.core.ephemeris import Ephemeris, load_ephemeris
from unmodeled.core.errors import ConfigError
from unmodeled.core.kepler_orbit import HeliocentricOrbit
from unmodeled.datasets.bodies import Body, heliocentric_orbits
from unmodeled.datasets.station import BodyRotation, UniformRotation
from unmodeled.models.physics.orientation import Orientation
from unmodeled.models.physics.tracks import Tracks
from unmodeled.pipeline.cases.accepted_values import EARTH_MOON

__all__ = ["CIRCULAR", "Surroundings"]

#: Name of the ephemeris whose Moon goes round in a circle of the mean distance, m.
CIRCULAR = "circular"
_MOON_DISTANCE = 3.844e8
#: Errors of the series as a share of the distance. The Moon's 4 cm are a hundred thousandth of what
#: the analytic ephemeris is wrong by; about the Sun the monthly swing of the Earth is left out.
_NEAR, _FAR = 1e-10, 1e-8
#: Error of the Earth's orientation, rad, and what polar motion adds to it, rad/s: 6e-9 rad a day.
_TURN, _WANDER = 3e-8, 7e-14

#: Other bodies that a known or possible effect may ask for, by central body.
_AROUND = {
    "earth": ("moon", "sun"),
    "moon": ("earth", "sun"),
    "sun": ("venus", EARTH_MOON, "mars", "jupiter", "saturn"),
}


@dataclass(frozen=True)
class Surroundings:
    """Axes of the forces, and what is needed along them.

    Parameters
    ----------
    body : Body
        Central body.
    epoch : str
        Time zero with its scale.
    frame : {"icrf", "body_equator"}
        Inertial axes of the forces.
    ephemeris : str
        ``"analytic"``, the path of a kernel, or ``"circular"``: analytic, but for the Moon, which
        circles the Earth in the plane of the frame's x and y (the restricted three-body problem
        in axes that do not turn).

    Raises
    ------
    ConfigError
        The Earth in its equatorial axes: its data need ICRF. Another body with the circular Moon.
    """

    body: Body
    epoch: str
    frame: Literal["icrf", "body_equator"]
    ephemeris: str = "analytic"

    def __post_init__(self) -> None:
        if self.ephemeris == CIRCULAR and self.body.name != "earth":
            raise ConfigError(
                f"ephemeris is circular and the body is {self.body.name}",
                allowed="circular for the Earth only",
            )
        if self.body.name == "earth" and self.frame != "icrf":
            raise ConfigError(
                "frame is body_equator and the body is the Earth",
                allowed="icrf: the orientation of the Earth is known along ICRF axes",
            )

    @property
    def frame_from_icrf(self) -> Array:
        """Rotation (3, 3) from ICRF axes to those of the forces."""
        return np.eye(3) if self.frame == "icrf" else self.body.pole_matrix()

    def tracks(self, start: float, end: float, needed: tuple[str, ...] = ()) -> Tracks | None:
        """Return where the other bodies are from ``start`` to ``end``, s.

        Parameters
        ----------
        start, end : float
            Interval, s since the epoch.
        needed : tuple of str
            Bodies that the known effects ask for, beyond those that candidates may.

        Returns
        -------
        Tracks or None
            None where the frame's direction in space is unknown and nobody asks.

        Raises
        ------
        ConfigError, DataError
            If a needed body cannot be placed.
        NumericalError
            If the interval is too long for one series.
        """
        names = set(_AROUND.get(self.body.name, ("sun",))) | set(needed)
        if not needed and not self._placed():
            return None
        source = load_ephemeris(
            None if self.ephemeris in ("analytic", CIRCULAR) else Path(self.ephemeris),
            self._small_bodies(),
        )
        turn = self.frame_from_icrf
        positions = {name: self._position(name, source, turn) for name in sorted(names)}
        tolerance = _FAR if self.body.name == "sun" else _NEAR
        return Tracks.fit(positions, start, end, tolerance)

    def orientation(self, start: float, end: float) -> Orientation | None:
        """Return how the body is turned; None if it does not spin."""
        rate = self.body.spin_rate
        if self.body.name == "earth":
            tolerance = _TURN + _WANDER * (end - start)
            return Orientation.fit(self._itrf_from_icrf, rate, start, end, tolerance)
        if not rate:
            return None
        if self.frame == "body_equator":
            return Orientation.of_pole(np.eye(3), rate, self.prime_meridian)
        return Orientation.of_pole(self.body.pole_matrix(), rate, self.prime_meridian)

    @property
    def prime_meridian(self) -> float:
        """Angle of the prime meridian from the equator's node at time zero, rad; 0 if unknown."""
        if self.body.pole is None:
            return 0.0
        turned = self.body.body_fixed_from_icrf(self.epoch, np.zeros(1))[0]
        spun = turned @ self.body.pole_matrix().T
        return float(np.arctan2(spun[0, 1], spun[0, 0]))

    def rotation(self) -> BodyRotation | None:
        """Return the rotation for stations; None for the Earth, which stations know."""
        if self.body.name == "earth":
            return None
        axes = np.eye(3) if self.frame == "body_equator" else self.body.pole_matrix()
        rows = tuple(tuple(float(v) for v in row) for row in axes)
        return UniformRotation(self.body.spin_rate, self.prime_meridian, rows)

    def _placed(self) -> bool:
        """Whether the ephemeris can say where the others are as seen from here, along our axes."""
        known = self.body.name in GM_OF or self.body.heliocentric_orbit is not None
        return known and (self.frame == "icrf" or self.body.pole is not None)

    def _small_bodies(self) -> Mapping[str, HeliocentricOrbit]:
        orbits = dict(heliocentric_orbits())
        if self.body.heliocentric_orbit is not None:
            orbits[self.body.name] = self.body.heliocentric_orbit
        return orbits

    def _position(self, name: str, source: Ephemeris, turn: Array) -> Callable[[Array], Array]:
        def place(times: Array) -> Array:
            def seen(of: str) -> Array:
                return source.position(of, self.body.name, self.epoch, times)

            if name == "moon" and self.ephemeris == CIRCULAR:
                return _circle(times)
            if name == EARTH_MOON:
                share = GM_OF["moon"].value / (GM_OF["moon"].value + GM_OF["earth"].value)
                found = (1.0 - share) * seen("earth") + share * seen("moon")
            else:
                found = seen(name)
            turned: Array = found @ turn.T
            return turned

        return place

    def _itrf_from_icrf(self, times: Array) -> Array:
        turn: Array = np.swapaxes(icrf_from_itrf(self.epoch, times), 1, 2)
        return turn


def _circle(times: Array) -> Array:
    """Geocentric circle of the Moon that two bodies of their masses make, (n, 3) m."""
    total = GM_OF["earth"].value + GM_OF["moon"].value
    angle = np.sqrt(total / _MOON_DISTANCE**3) * times
    circle: Array = _MOON_DISTANCE * np.stack(
        [np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1
    )
    return circle
