"""Time scales: named epochs, elapsed seconds and conversions that are right over leap seconds.

An epoch is text, ``"2016-03-13T00:00:00 UTC"``: an ISO date and the name of its scale, because a
date without a scale is ambiguous by up to 69 s.  The times of a trajectory are *elapsed* SI
seconds since its epoch, counted in TAI; a day of UTC with a leap second has 86,401 of them.

GPS time is TAI - 19 s [IS-GPS-200].  All tables (leap seconds, Earth orientation) come from the
installed packages ``pyerfa`` and ``astropy-iers-data``; the network is never asked.
"""

from __future__ import annotations

import functools
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import erfa
import numpy as np
import numpy.typing as npt
from astropy.time import Time, TimeDelta
from astropy.utils import iers

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, UnmodeledWarning, nearest

__all__ = [
    "TIME_SCALES",
    "check_scale",
    "convert_epoch",
    "elapsed_from_calendar",
    "elapsed_from_dates",
    "parse_epoch",
    "seconds_between",
    "terrestrial_time",
]

#: Scales that an epoch may name.
TIME_SCALES = ("UTC", "TAI", "TT", "TDB", "GPS")

# GPS time runs with TAI and was equal to UTC on 1980-01-06, when TAI - UTC was 19 s.
_TAI_MINUS_GPS = 19.0
_ISO = re.compile(r"\d{4}-\d{2}-\d{2}(T\d{2}:\d{2}(:\d{2}(\.\d*)?)?)?Z?")
# Before 1972 UTC ran at another rate than TAI and stepped by fractions of a second.
_FIRST_UTC = "1972-01-01"


@contextmanager
def _offline() -> Iterator[None]:
    """No download, no complaint about the age of the installed tables; both undone at the end."""
    with (
        iers.conf.set_temp("auto_download", False),
        iers.conf.set_temp("auto_max_age", None),
        warnings.catch_warnings(),
    ):
        # The range of UTC is checked here, with a text that says what to do.
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        yield


def parse_epoch(text: str) -> Time:
    """Read an ISO epoch with its time scale.

    Parameters
    ----------
    text : str
        For example ``"2016-03-13T00:00:00 UTC"``; a final ``Z`` stands for UTC.

    Returns
    -------
    astropy.time.Time
        In the named scale; a GPS epoch in TAI, 19 s added.

    Raises
    ------
    DataError
        If the date cannot be read, the scale is missing or unknown, or a UTC date lies before
        1972.

    Examples
    --------
    >>> parse_epoch("2016-03-13T00:00:00 GPS").isot
    '2016-03-13T00:00:19.000'
    """
    words = text.split()
    if len(words) == 1 and text.strip().endswith("Z"):
        words.append("UTC")
    if len(words) == 3 and "T" not in words[0]:
        words = [f"{words[0]}T{words[1]}", words[2]]
    if len(words) != 2 or not _ISO.fullmatch(words[0]):
        raise DataError(
            f'epoch "{text}" cannot be read',
            allowed="an ISO date and a time scale",
            do='write it like "2016-03-13T00:00:00 UTC"',
        )
    return _time([words[0]], words[1], text)[0]


def convert_epoch(text: str, scale: str) -> str:
    """Return the same instant with another scale's date, to the nanosecond.

    Examples
    --------
    >>> convert_epoch("2016-03-13T00:00:00 UTC", "TT")
    '2016-03-13T00:01:08.184 TT'
    """
    return _format(parse_epoch(text), check_scale(scale))


def check_scale(scale: str) -> str:
    """Return the scale's name in capitals, or raise ``DataError`` with the nearest known name."""
    name = scale.upper()
    if name not in TIME_SCALES:
        raise DataError(
            f'time scale "{scale}" is unknown',
            allowed=", ".join(TIME_SCALES),
            do=nearest(name, TIME_SCALES),
        )
    return name


def seconds_between(start: str, end: str) -> float:
    """SI seconds from one epoch to another, in whatever scales they are given.

    Examples
    --------
    >>> seconds_between("2016-12-31T00:00:00 UTC", "2017-01-01T00:00:00 UTC")
    86401.0
    """
    with _offline():
        return float(_seconds(parse_epoch(end), parse_epoch(start)))


def elapsed_from_dates(
    dates: Sequence[str], scale: str, epoch: str = ""
) -> tuple[str, npt.NDArray[np.float64]]:
    """Turn ISO dates into elapsed seconds.

    Parameters
    ----------
    dates : sequence of str
        ISO dates, all in ``scale``; a final ``Z`` is allowed where the scale is UTC.
    scale : str
        Their time scale.
    epoch : str
        Time zero; the first date if empty.

    Returns
    -------
    epoch : str
        The epoch in use.
    times : ndarray (n,)
        SI seconds since it.

    Raises
    ------
    DataError
        If a date or the scale cannot be read; dates are numbered from 1.
    """
    name = check_scale(scale)
    for number, date in enumerate(dates, start=1):
        if not _ISO.fullmatch(date.strip().replace(" ", "T")):
            raise DataError(
                f'date {number}, "{date}", cannot be read',
                allowed='an ISO date like "2016-03-13T00:00:00.000"',
            )
    stamps = _time([d.strip().replace(" ", "T") for d in dates], name, dates[0])
    return _elapsed(stamps, name, epoch)


def elapsed_from_calendar(calendar: npt.ArrayLike, scale: str) -> tuple[str, Array]:
    """Turn rows of year, month, day, hour, minute, second into elapsed seconds.

    Parameters
    ----------
    calendar : array_like (n, 6)
        Numbers that are already in range (60 <= second < 61 only within a leap second).
    scale : str
        Their time scale.

    Returns
    -------
    epoch : str
        The first row's date.
    times : ndarray (n,)
        SI seconds since it.

    Raises
    ------
    DataError
        If a row is not a date, or the scale is unknown.
    """
    name = check_scale(scale)
    rows = np.asarray(calendar, dtype=np.float64)
    year, month, day, hour, minute = (rows[:, k].astype(int) for k in range(5))
    with _offline():
        try:
            one, two = erfa.dtf2d(
                b"UTC" if name == "UTC" else b"TAI", year, month, day, hour, minute, rows[:, 5]
            )
        except erfa.ErfaError as exc:
            raise DataError(f"the table has a date that does not exist ({exc})") from exc
        stamps = Time(one, two, format="jd", scale="tai" if name == "GPS" else name.lower())
        if name == "GPS":
            stamps = stamps + TimeDelta(_TAI_MINUS_GPS, format="sec")
    _check_utc(stamps, name)
    return _elapsed(stamps, name, "")


def terrestrial_time(epoch: str, times: npt.ArrayLike) -> Time:
    """Instants ``times`` (n,) s after ``epoch``, in TT.

    Two doubles carry each, so that nothing is lost over centuries.
    """
    with _offline():
        seconds = np.asarray(times, dtype=np.float64)
        return parse_epoch(epoch).tt + TimeDelta(seconds, format="sec", scale="tt")


def _time(dates: list[str], scale: str, text: str) -> Time:
    name = check_scale(scale)
    plain = [d[:-1] if d.endswith("Z") else d for d in dates]
    if name != "UTC" and plain != dates:
        raise DataError(
            f'epoch "{text}" ends in Z, which means UTC, but names {name}',
            do="leave out the Z or the scale",
        )
    with _offline():
        try:
            stamps = Time(plain, scale="tai" if name == "GPS" else name.lower())
            if name == "GPS":
                stamps = stamps + TimeDelta(_TAI_MINUS_GPS, format="sec")
        except ValueError as exc:
            raise DataError(
                f'epoch "{text}" is not a date',
                do='write it like "2016-03-13T00:00:00 UTC"',
            ) from exc
    _check_utc(stamps, name)
    return stamps


def _elapsed(stamps: Time, scale: str, epoch: str) -> tuple[str, Array]:
    with _offline():
        start = parse_epoch(epoch) if epoch else stamps[0]
        return epoch or _format(start, scale), np.atleast_1d(_seconds(stamps, start))


def _seconds(end: Time, start: Time) -> Any:
    # The difference of two dates carries about 1e-11 s of rounding, and 120 s should read 120.
    return np.round((end.tai - start.tai).to_value("sec"), 10)


def _format(stamp: Time, scale: str) -> str:
    with _offline():
        if scale == "GPS":
            shifted = stamp.tai - TimeDelta(_TAI_MINUS_GPS, format="sec")
        else:
            shifted = getattr(stamp, scale.lower())
        # A copy: the precision of the caller's object stays what it was.
        whole, _, fraction = Time(shifted, precision=9).isot.partition(".")
        fraction = fraction.rstrip("0")
        return f"{whole}.{fraction} {scale}" if fraction else f"{whole} {scale}"


@functools.cache
def _leap_table_end() -> float:
    """Return the modified Julian date up to which leap seconds are announced."""
    with _offline():
        return float(iers.LeapSeconds.auto_open().expires.mjd)


def _check_utc(stamps: Time, scale: str) -> None:
    if scale != "UTC":
        return
    with _offline():
        first, last = float(np.min(stamps.mjd)), float(np.max(stamps.mjd))
        if first < Time(_FIRST_UTC).mjd:
            raise DataError(
                f"UTC date {Time(first, format='mjd').isot} lies before {_FIRST_UTC}, when UTC "
                "began to run in SI seconds",
                do="give the date in TAI or TT",
            )
        beyond = last > _leap_table_end()
    if beyond:
        warnings.warn(
            "a UTC date lies beyond the installed table of leap seconds; none is assumed there",
            UnmodeledWarning,
            stacklevel=4,
        )
