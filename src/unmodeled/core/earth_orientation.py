"""The Earth's orientation: from the rotating ITRF to inertial axes, for positions and velocities.

Celestial pole and origin after IAU 2006/2000A_R06 [IERS2010, ch. 5], Earth rotation angle,
polar motion, UT1 and celestial pole offsets.  "ICRF" here means axes: those of the GCRS, with the
origin at the Earth's centre of mass.  The daily table is interpolated by a cubic spline: straight
lines would bend at midnight, which turns into jumps of 1e-6 m/s in the velocity of a satellite.
What the pole and UT1 do within a day is not in such tables and added (`core.subdaily_rotation`).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import astropy_iers_data  # type: ignore[import-untyped]
import erfa
import numpy as np
import numpy.typing as npt
from astropy.utils import iers
from scipy.interpolate import CubicSpline

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.errors import DataError
from unmodeled.core.subdaily_rotation import subdaily_rotation
from unmodeled.core.time import terrestrial_time

__all__ = [
    "EarthOrientation",
    "days_since_j2000",
    "earth_rotation_vector",
    "icrf_from_itrf",
    "inertial_from_earth_fixed",
    "installed_earth_orientation",
    "pole_at",
]

_MJD_ZERO = 2_400_000.5
_MJD_J2000 = 51_544.5
_DAY = 86_400.0
_TT_MINUS_TAI = 32.184
# Nodes of the celestial pole, a day apart over this number: the shortest nutation periods are
# days, and a cubic spline through nodes 3 h apart errs by less than 1e-12 rad.
_NODES_PER_DAY = 8
_STENCIL = 10.0


@dataclass(frozen=True)
class EarthOrientation:
    """A daily table of Earth orientation.

    Parameters
    ----------
    mjd : ndarray (n,)
        Modified Julian dates in UTC, increasing.
    ut1_minus_utc : ndarray (n,)
        Seconds.
    pole_x, pole_y : ndarray (n,)
        Polar motion, rad.
    offset_x, offset_y : ndarray (n,)
        Celestial pole offsets dX, dY to IAU 2006/2000A, rad.
    source : str
        Where the table comes from.
    subdaily : bool
        True: tides of a day and less are to be added, as to every table of daily values of the
        IERS.

    Raises
    ------
    DataError
        If a column is not finite or has another length, or the dates do not increase.
    """

    mjd: Array
    ut1_minus_utc: Array
    pole_x: Array
    pole_y: Array
    offset_x: Array
    offset_y: Array
    source: str = ""
    subdaily: bool = True

    def __post_init__(self) -> None:
        n = len(self.mjd)
        for name in ("mjd", "ut1_minus_utc", "pole_x", "pole_y", "offset_x", "offset_y"):
            column = as_array(getattr(self, name), (n,), f"Earth orientation {name}")
            object.__setattr__(self, name, column)
        check_increasing(self.mjd, "Earth orientation mjd")

    def at(self, utc: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Interpolate: UT1 - TAI (s), pole x, y and offsets dX, dY (rad), each (n,).

        Parameters
        ----------
        utc : ndarray (n,)
            Modified Julian dates, UTC.

        Raises
        ------
        DataError
            If a date lies outside the table.
        """
        if len(utc) and not (self.mjd[0] <= utc.min() and utc.max() <= self.mjd[-1]):
            first, last = (_date(m) for m in (self.mjd[0], self.mjd[-1]))
            raise DataError(
                f"dates {_date(utc.min())} to {_date(utc.max())} lie outside the table of Earth "
                "orientation",
                allowed=f"{first} to {last}",
                do="update the package astropy-iers-data (pip install -U astropy-iers-data)",
            )
        a, b, c, d, e = self._spline(utc).T
        return a, b, c, d, e

    @functools.cached_property
    def _spline(self) -> CubicSpline:
        # UT1 - TAI has no leap seconds, so a smooth curve may cross them.
        ut1_minus_tai = self.ut1_minus_utc - _tai_minus_utc(self.mjd)
        columns = (ut1_minus_tai, self.pole_x, self.pole_y, self.offset_x, self.offset_y)
        return CubicSpline(self.mjd, np.stack(columns, axis=1))


@functools.cache
def installed_earth_orientation() -> EarthOrientation:
    """Return the table of the installed package ``astropy-iers-data`` (IERS Bulletin A and B).

    Final values to about a month before the package's date, predictions for a year after it; no
    network.  Offsets that are not predicted any more are taken as zero (below 1 mas, 5e-9 rad).
    """
    table = iers.IERS_A.open(astropy_iers_data.IERS_A_FILE)

    def column(name: str, unit: str) -> Array:
        values = table[name].to_value(unit)
        return np.asarray(np.ma.filled(np.ma.asarray(values), np.nan), dtype=np.float64)

    return EarthOrientation(
        mjd=column("MJD", "d"),
        ut1_minus_utc=column("UT1_UTC", "s"),
        pole_x=column("PM_x", "rad"),
        pole_y=column("PM_y", "rad"),
        offset_x=np.nan_to_num(column("dX_2000A", "rad")),
        offset_y=np.nan_to_num(column("dY_2000A", "rad")),
        source="astropy-iers-data",
    )


def icrf_from_itrf(
    epoch: str, times: npt.ArrayLike, table: EarthOrientation | None = None
) -> Array:
    """Rotation from Earth-fixed (ITRF) to inertial (GCRS) axes.

    Parameters
    ----------
    epoch : str
        Time zero with its scale, e.g. ``"2016-03-13T00:00:00 UTC"``.
    times : array_like (n,)
        SI seconds since the epoch, in any order.
    table : EarthOrientation, optional
        The installed one by default.

    Returns
    -------
    ndarray (n, 3, 3)
        ``v_icrf = R @ v_itrf``.

    Raises
    ------
    DataError
        If the epoch cannot be read, or a date lies outside the table.
    """
    seconds = as_array(times, ("n",), "times")
    return _Orientation(epoch, seconds, table).matrices(seconds)


def inertial_from_earth_fixed(
    epoch: str,
    times: npt.ArrayLike,
    positions: npt.ArrayLike,
    velocities: npt.ArrayLike,
    table: EarthOrientation | None = None,
) -> tuple[Array, Array]:
    """Turn Earth-fixed states into inertial ones.

    Parameters
    ----------
    epoch, times, table
        As in :func:`icrf_from_itrf`.
    positions : array_like (n, 3)
        Metres, ITRF.
    velocities : array_like (n, 3)
        Metres per second *relative to the rotating frame*, components along ITRF axes.

    Returns
    -------
    positions, velocities : ndarray (n, 3)
        Along inertial (GCRS) axes; the velocity is relative to inertial axes,
        ``R v + dR/dt r`` = ``R (v + omega x r)``.
    """
    seconds = as_array(times, ("n",), "times")
    n = len(seconds)
    r = as_array(positions, (n, 3), "positions")
    v = as_array(velocities, (n, 3), "velocities")
    orientation = _Orientation(epoch, seconds, table)
    rotation = orientation.matrices(seconds)
    turned = _apply(rotation, v) + _apply(orientation.rates(seconds), r)
    return _apply(rotation, r), turned


def earth_rotation_vector(
    epoch: str, times: npt.ArrayLike, table: EarthOrientation | None = None
) -> Array:
    """Angular velocity of the Earth, rad/s, ITRF components, (n, 3).

    The vector that is consistent with :func:`icrf_from_itrf`: it holds the excess length of day,
    precession, nutation and polar motion.
    """
    seconds = as_array(times, ("n",), "times")
    orientation = _Orientation(epoch, seconds, table)
    spin = np.swapaxes(orientation.matrices(seconds), 1, 2) @ orientation.rates(seconds)
    # R^T dR/dt is the cross-product matrix of omega; its symmetric part is rounding.
    half = (spin - np.swapaxes(spin, 1, 2)) / 2
    return np.stack([half[:, 2, 1], half[:, 0, 2], half[:, 1, 0]], axis=1)


def days_since_j2000(epoch: str, table: EarthOrientation | None = None) -> float:
    """Return how far an epoch lies after J2000.0 (12 h) on the clock of the turning Earth, UT1, d.

    Raises
    ------
    DataError
        If the epoch cannot be read, or lies outside the table.
    """
    tai, found = _at_epoch(epoch, table)
    return (tai[0] - _MJD_J2000) + tai[1] + float(found[0][0]) / _DAY


def pole_at(epoch: str, table: EarthOrientation | None = None) -> tuple[float, float]:
    """Return the daily pole (x, y) at an epoch, rad.

    Raises
    ------
    DataError
        If the epoch cannot be read, or lies outside the table.
    """
    _, found = _at_epoch(epoch, table)
    return float(found[1][0]), float(found[2][0])


def _at_epoch(
    epoch: str, table: EarthOrientation | None
) -> tuple[tuple[float, float], tuple[Array, ...]]:
    """TAI as a modified Julian date in two parts, and the columns of the table."""
    start = terrestrial_time(epoch, 0.0)
    tai = float(start.jd1) - _MJD_ZERO, float(start.jd2) - _TT_MINUS_TAI / _DAY
    whole = np.array([tai[0] + tai[1]])
    utc = whole - _tai_minus_utc(whole) / _DAY
    return tai, (table or installed_earth_orientation()).at(utc)


class _Orientation:
    """Rotations on one span of time: the slow part as a spline, the fast part exactly."""

    def __init__(self, epoch: str, seconds: Array, table: EarthOrientation | None) -> None:
        self.table = table or installed_earth_orientation()
        start = terrestrial_time(epoch, 0.0)
        self.jd = (float(start.jd1), float(start.jd2))
        low, high = (seconds.min(), seconds.max()) if len(seconds) else (0.0, 0.0)
        margin = _DAY / _NODES_PER_DAY
        count = max(8, int((high - low) / margin) + 4)
        nodes = np.linspace(low - margin, high + margin, count)
        pole = np.stack(erfa.xys06a(self.jd[0], self.jd[1] + nodes / _DAY), axis=1)
        self.pole = CubicSpline(nodes, pole)

    def matrices(self, seconds: Array) -> Array:
        tt = (self.jd[0], self.jd[1] + seconds / _DAY)
        tai = (tt[0] - _MJD_ZERO, tt[1] - _TT_MINUS_TAI / _DAY)
        utc = tai[0] + tai[1] - _tai_minus_utc(tai[0] + tai[1]) / _DAY
        ut1_minus_tai, xp, yp, dx, dy = self.table.at(utc)
        if self.table.subdaily:
            more = subdaily_rotation(*tt)
            xp, yp, ut1_minus_tai = xp + more[:, 0], yp + more[:, 1], ut1_minus_tai + more[:, 2]
        ut1 = (tt[0], tai[1] + ut1_minus_tai / _DAY)
        x, y, s = self.pole(seconds).T
        celestial = erfa.c2ixys(x + dx, y + dy, s)
        itrf_from_icrf = erfa.c2tcio(
            celestial, erfa.era00(*ut1), erfa.pom00(xp, yp, erfa.sp00(*tt))
        )
        rotation: Array = np.ascontiguousarray(np.swapaxes(itrf_from_icrf, 1, 2))
        return rotation

    def rates(self, seconds: Array) -> Array:
        # Fourth-order central differences: truncation omega^5 h^4 / 30 = 7e-19 rad/s, rounding
        # about 1e-16 rad / h; both below 1e-9 m/s at the distance of GPS satellites.
        h = _STENCIL
        near = self.matrices(seconds + h) - self.matrices(seconds - h)
        far = self.matrices(seconds + 2 * h) - self.matrices(seconds - 2 * h)
        rates: Array = (8 * near - far) / (12 * h)
        return rates


def _apply(matrices: Array, vectors: Array) -> Array:
    turned: Array = np.einsum("nij,nj->ni", matrices, vectors)
    return turned


def _tai_minus_utc(mjd: Array) -> Array:
    """Leap seconds at modified Julian dates; within seconds of a leap either value will do."""
    leaps = erfa.leap_seconds.get()
    starts = np.asarray(erfa.cal2jd(leaps["year"], leaps["month"], 1)[1], dtype=np.float64)
    values = leaps["tai_utc"].astype(np.float64)
    offsets: Array = values[np.clip(np.searchsorted(starts, mjd, side="right") - 1, 0, None)]
    return offsets


def _date(mjd: float) -> str:
    year, month, day, _ = erfa.jd2cal(_MJD_ZERO, float(mjd))
    return f"{int(year):04d}-{int(month):02d}-{int(day):02d}"
