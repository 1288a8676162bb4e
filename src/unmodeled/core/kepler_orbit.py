"""Two-body motion about the Sun from osculating elements."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.constants import ASTRONOMICAL_UNIT, GM_OF, OBLIQUITY_J2000
from unmodeled.core.errors import NumericalError, OrbitError
from unmodeled.core.frames import inertial_from_perifocal, rotation_about_x
from unmodeled.core.time import parse_epoch, seconds_between

__all__ = ["HeliocentricOrbit", "solve_kepler"]

_MOST_STEPS = 60


@dataclass(frozen=True)
class HeliocentricOrbit:
    """An ellipse about the Sun, as JPL prints it for small bodies.

    Planets are left out, so the ellipse drifts from the true orbit. Against an integration with all
    planets: Bennu 5e-5 au after half a year, 1e-3 au after one and 0.03 au after eight; Eros 8e-4
    au after one and 4e-3 au after ten; a close approach to a planet ends it at once. Give elements
    whose epoch lies within a year of the data, or a kernel of the body.

    Parameters
    ----------
    epoch : str
        Instant of the elements with its scale, e.g. ``"2011-01-01T00:00:00 TDB"``.
    semi_major_axis : float
        m.
    eccentricity : float
        0 <= e < 1.
    inclination, node, perihelion : float
        To the ecliptic and equinox of J2000, rad.
    mean_anomaly : float
        At the epoch, rad.

    Raises
    ------
    OrbitError
        If a value is not finite, the axis is not positive, or the orbit is not bound.
    DataError
        If the epoch cannot be read.

    Notes
    -----
    Mean motion sqrt(GM/a3) with the Sun's GM, [MontenbruckGill2000] section 2.2. The ecliptic is
    turned to ICRF axes about x by ``OBLIQUITY_J2000``, as JPL Horizons does.
    """

    epoch: str
    semi_major_axis: float
    eccentricity: float
    inclination: float
    node: float
    perihelion: float
    mean_anomaly: float

    def __post_init__(self) -> None:
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            if not math.isfinite(value):
                raise OrbitError(f"{field.name} is {value}", allowed="a finite number")
        if not self.semi_major_axis > 0:
            raise OrbitError(f"semi-major axis {self.semi_major_axis:g} m", allowed="a number > 0")
        if not 0 <= self.eccentricity < 1:
            raise OrbitError(f"eccentricity {self.eccentricity:g}", allowed="0 <= e < 1")
        parse_epoch(self.epoch)

    @classmethod
    def from_degrees(
        cls,
        epoch: str,
        semi_major_axis_au: float,
        eccentricity: float,
        inclination_deg: float,
        node_deg: float,
        perihelion_deg: float,
        mean_anomaly_deg: float,
    ) -> HeliocentricOrbit:
        """Return the orbit of elements in au and degrees, the units of JPL's tables."""
        angles = (inclination_deg, node_deg, perihelion_deg, mean_anomaly_deg)
        return cls(
            epoch,
            semi_major_axis_au * ASTRONOMICAL_UNIT.value,
            eccentricity,
            *(math.radians(angle) for angle in angles),
        )

    @property
    def mean_motion(self) -> float:
        """Rad/s."""
        return math.sqrt(GM_OF["sun"].value / self.semi_major_axis**3)

    @property
    def period(self) -> float:
        """Sidereal period, s."""
        return 2 * math.pi / self.mean_motion

    @property
    def normal(self) -> Array:
        """Unit vector of the orbital angular momentum along ICRF axes, (3,)."""
        normal: Array = self._icrf_from_perifocal[:, 2]
        return normal

    def position(self, epoch: str, times: npt.ArrayLike) -> Array:
        """Return heliocentric positions (n, 3) along ICRF axes, m.

        Parameters
        ----------
        epoch : str
            Time zero with its scale.
        times : array_like (n,)
            SI seconds since it.

        Raises
        ------
        DataError
            If the epoch or the times cannot be read.
        """
        seconds = as_array(times, ("n",), "times") + seconds_between(self.epoch, epoch)
        e = self.eccentricity
        anomaly = solve_kepler(self.mean_anomaly + self.mean_motion * seconds, e)
        plane = np.stack(
            [np.cos(anomaly) - e, math.sqrt(1 - e * e) * np.sin(anomaly), np.zeros_like(anomaly)],
            axis=1,
        )
        position: Array = self.semi_major_axis * plane @ self._icrf_from_perifocal.T
        return position

    @property
    def _icrf_from_perifocal(self) -> Array:
        ecliptic = inertial_from_perifocal(self.inclination, self.node, self.perihelion)
        turned: Array = rotation_about_x(-OBLIQUITY_J2000.value) @ ecliptic
        return turned


def solve_kepler(mean_anomaly: npt.ArrayLike, eccentricity: float) -> Array:
    """Solve M = E - e sin E for the eccentric anomaly.

    Parameters
    ----------
    mean_anomaly : array_like (n,)
        Rad, any revolution.
    eccentricity : float
        0 <= e < 1.

    Returns
    -------
    ndarray (n,)
        E in the revolution of M, rad, to rounding.

    Raises
    ------
    OrbitError
        If the orbit is not bound.
    NumericalError
        If the iteration does not converge.

    Examples
    --------
    >>> float(solve_kepler([0.0], 0.9)[0])
    0.0
    """
    if not 0 <= eccentricity < 1:
        raise OrbitError(f"eccentricity {eccentricity:g}", allowed="0 <= e < 1")
    mean = as_array(mean_anomaly, ("n",), "mean anomaly")
    turns = 2 * math.pi * np.round(mean / (2 * math.pi))
    m = mean - turns
    # Newton from E = pi sign(M) never leaves the convex side, so it converges for every e < 1.
    anomaly = math.pi * np.sign(m)
    # Near the perihelion rounding of the excess is magnified by 1 / (1 - e).
    enough = 4e-15 / (1 - eccentricity)
    for _ in range(_MOST_STEPS):
        excess = anomaly - eccentricity * np.sin(anomaly) - m
        step = excess / (1 - eccentricity * np.cos(anomaly))
        anomaly = anomaly - step
        if np.all(np.abs(step) < enough):
            solved: Array = anomaly + turns
            return solved
    raise NumericalError(
        f"Kepler's equation did not converge (e = {eccentricity})", do="check the elements"
    )
