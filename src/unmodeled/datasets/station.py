"""Where a measurement is made: a place on a rotating body, and its inertial track."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import erfa
import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.earth_orientation import earth_rotation_vector, icrf_from_itrf
from unmodeled.core.errors import DataError
from unmodeled.core.frames import body_fixed_from_inertial
from unmodeled.core.time import seconds_between

__all__ = ["BodyRotation", "Station", "StationTrack", "UniformRotation", "earth_rotation"]

#: (epoch, times (n,)) -> matrices inertial_from_body (n, 3, 3) and the angular velocity (n, 3),
#: rad/s, along inertial axes.
BodyRotation: TypeAlias = Callable[[str, Array], tuple[Array, Array]]

_WGS84 = 1  # erfa's number of the ellipsoid; GRS80 differs by 0.1 mm in the height
_NOWHERE = 1.0  # m: a station this near the centre is a mistake of units or of columns


def earth_rotation(epoch: str, times: Array) -> tuple[Array, Array]:
    """Rotation of the Earth, a `BodyRotation`: :mod:`unmodeled.core.earth_orientation`."""
    if not epoch:
        raise DataError(
            "the Earth's orientation needs the date of time zero",
            do='give epoch="2016-03-13T00:00:00 UTC" or the like',
        )
    turn = icrf_from_itrf(epoch, times)
    return turn, np.einsum("nij,nj->ni", turn, earth_rotation_vector(epoch, times))


@dataclass(frozen=True)
class UniformRotation:
    """A body that spins uniformly about a fixed pole, a `BodyRotation`.

    Parameters
    ----------
    rate : float
        rad/s, right-handed about the pole.
    meridian : float
        Angle of the prime meridian from the equator's x axis at time zero, rad.
    equator_from_icrf : tuple of tuple of float, optional
        Rows: x axis, y axis and pole of the equator along the inertial axes; unity by default
        (the inertial axes' own z is the pole).
    """

    rate: float
    meridian: float = 0.0
    equator_from_icrf: tuple[tuple[float, ...], ...] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
    )

    def __call__(self, epoch: str, times: Array) -> tuple[Array, Array]:
        """Return the matrices and the angular velocity; the epoch is not used."""
        equator = as_array(self.equator_from_icrf, (3, 3), "equator_from_icrf")
        body = body_fixed_from_inertial(times, self.rate, self.meridian) @ equator
        spin = np.broadcast_to(self.rate * equator[2], (len(times), 3))
        return np.swapaxes(body, 1, 2), spin


@dataclass(frozen=True)
class StationTrack:
    """A station at given times, along inertial axes, from the body's centre.

    Parameters
    ----------
    positions, velocities, accelerations : ndarray (n, 3)
        m, m/s, m/s2. The acceleration is that of uniform rotation, omega x v.
    inertial_from_body : ndarray (n, 3, 3)
        Orientation of the body.
    spin : ndarray (n, 3)
        Angular velocity of the body, rad/s.
    north_east_up : ndarray (n, 3, 3)
        Rows: unit vectors of the local horizon.
    """

    positions: Array
    velocities: Array
    accelerations: Array
    inertial_from_body: Array
    spin: Array
    north_east_up: Array

    @classmethod
    def centre(cls, count: int) -> StationTrack:
        """Return the body's centre, at rest; its horizon has no meaning."""
        zero, unit = np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3))
        return cls(zero, zero, zero, unit, zero, unit)


@dataclass(frozen=True, eq=False)
class Station:
    """A place fixed to a rotating body.

    Tides and loading (decimetres to millimetres) are not modelled.

    Parameters
    ----------
    name : str
        As in files and tables.
    position : array_like (3,)
        Metres along body-fixed axes (for the Earth ITRF) from the centre of mass.
    rotation : callable, optional
        The body's rotation; that of the Earth by default. See `BodyRotation`.
    velocity : array_like (3,)
        Drift along body-fixed axes (plate motion), m/s: 3 cm a year are 1e-9.
    position_epoch : str
        Date at which ``position`` holds; needed where ``velocity`` is not zero.
    north_east_up : array_like (3, 3), optional
        Rows: the local horizon along body-fixed axes. By default the vertical is normal to the
        WGS84 ellipsoid on the Earth, radial elsewhere; the deflection of the vertical (up to
        1e-4 rad) is not known.

    Raises
    ------
    DataError
        On a wrong shape, a position at the centre, or a drift without its epoch.

    Examples
    --------
    >>> Station.from_geodetic("equator", 0.0, 90.0, 0.0).position.round(3) + 0.0
    array([      0., 6378137.,       0.])
    """

    name: str
    position: Array
    rotation: BodyRotation | None = None
    velocity: npt.ArrayLike = (0.0, 0.0, 0.0)
    position_epoch: str = ""
    north_east_up: Array | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        where = f"station {self.name}"
        put(self, "position", as_array(self.position, (3,), f"{where}: position"))
        put(self, "velocity", as_array(self.velocity, (3,), f"{where}: velocity"))
        if np.linalg.norm(self.position) < _NOWHERE:
            raise DataError(
                f"{where} lies at the body's centre",
                allowed="a body-fixed position in metres",
                do="for directions from the centre leave the station out",
            )
        if np.any(self.velocity) and not self.position_epoch:
            raise DataError(f"{where} drifts, but position_epoch is not given")
        horizon = self._horizon() if self.north_east_up is None else self.north_east_up
        put(self, "north_east_up", as_array(horizon, (3, 3), f"{where}: north_east_up"))

    @classmethod
    def from_xyz(cls, name: str, x: float, y: float, z: float) -> Station:
        """Return a station on the Earth at ITRF coordinates in metres."""
        return cls(name, np.array([x, y, z]))

    @classmethod
    def from_geodetic(cls, name: str, latitude: float, longitude: float, height: float) -> Station:
        """Return a station on the Earth.

        Parameters
        ----------
        name : str
            Of the station.
        latitude, longitude : float
            Geodetic, WGS84, *degrees*; east is positive.
        height : float
            Above the ellipsoid (not above sea level: up to 105 m apart), m.

        Raises
        ------
        DataError
            If the latitude lies outside -90 .. 90 or the longitude outside -360 .. 360.
        """
        if not (abs(latitude) <= 90 and abs(longitude) <= 360 and np.isfinite(height)):
            raise DataError(
                f"station {name}: latitude {latitude}, longitude {longitude}, height {height}",
                allowed="degrees -90 .. 90, degrees -360 .. 360, metres",
            )
        lon, lat = np.radians(longitude), np.radians(latitude)
        return cls(name, np.asarray(erfa.gd2gc(_WGS84, lon, lat, height), dtype=np.float64))

    def _horizon(self) -> Array:
        if self.rotation is None:
            lon, lat, _ = erfa.gc2gd(_WGS84, self.position)
        else:
            x, y, z = self.position
            lon, lat = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
        sl, cl, sp, cp = np.sin(lon), np.cos(lon), np.sin(lat), np.cos(lat)
        return np.array([[-sp * cl, -sp * sl, cp], [-sl, cl, 0.0], [cp * cl, cp * sl, sp]])

    @property
    def height(self) -> float:
        """Height above the WGS84 ellipsoid, m; stations on the Earth only."""
        return float(erfa.gc2gd(_WGS84, self.position)[2])

    def moved(self, offset: npt.ArrayLike) -> Station:
        """Return a copy moved by ``offset`` (3,) m along body-fixed axes.

        The horizon stays: it is where the instrument was levelled.
        """
        return replace(self, position=self.position + as_array(offset, (3,), "offset"))

    def inertial(self, epoch: str, times: npt.ArrayLike) -> tuple[Array, Array]:
        """Positions and velocities (n, 3) along inertial axes at ``times`` (n,) s after epoch."""
        track = self.track(epoch, times)
        return track.positions, track.velocities

    def track(self, epoch: str, times: npt.ArrayLike) -> StationTrack:
        """Return all that measurements need of the station.

        Parameters
        ----------
        epoch : str
            Date of time zero; not needed by rotations that do not ask for it.
        times : array_like (n,)
            Seconds since it.

        Raises
        ------
        DataError
            If the epoch is missing or lies outside the table of Earth orientation.
        """
        seconds = as_array(times, ("n",), "times")
        turn, spin = (self.rotation or earth_rotation)(epoch, seconds)
        place = np.broadcast_to(self.position, (len(seconds), 3))
        if np.any(self.velocity):
            age = seconds + seconds_between(self.position_epoch, epoch)
            place = place + age[:, None] * np.asarray(self.velocity)
        positions = np.einsum("nij,nj->ni", turn, place)
        velocities = np.cross(spin, positions)
        horizon = np.asarray(self.north_east_up) @ np.swapaxes(turn, 1, 2)
        acceleration = np.cross(spin, velocities)
        return StationTrack(positions, velocities, acceleration, turn, spin, horizon)
