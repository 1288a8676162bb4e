"""Names for offsets that are no accident: slips of a time scale or of a reference frame."""

from __future__ import annotations

from collections.abc import Iterator

import erfa
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from unmodeled.core.arrays import Array, as_array
from unmodeled.core.errors import DataError
from unmodeled.core.time import parse_epoch, seconds_between, terrestrial_time

__all__ = ["explain_rotation", "explain_time_offset"]

_SIGMAS = 4.0
# A slip is exact, but a fitted offset also holds the rest of a model's errors.
_TIME_FLOOR = 0.05
_ANGLE_FLOOR = 2e-8  # rad, 4 mas: below it celestial poles themselves differ
_SCALES = ("UTC", "TAI", "TT", "GPS", "BDT")
_BDT_MINUS_GPS = -14.0  # BeiDou time began with UTC in 2006, when TAI - UTC was 33 s


def explain_time_offset(dt: float, sigma: float, epoch: str) -> str | None:
    """Name the slip of a time scale that an offset of all time tags looks like.

    Parameters
    ----------
    dt : float
        Estimate of ``TimeTag``: what is tagged t was measured at t + dt, s.
    sigma : float
        Its standard deviation, s.
    epoch : str
        A date of the data with its scale; leap seconds are those of that date.

    Returns
    -------
    str or None
        One sentence, or None if no slip lies within 4 sigma (or 0.05 s), or if the offset is not
        4 sigma away from zero.

    Raises
    ------
    DataError
        If the epoch cannot be read, or dt or sigma are not finite.

    Examples
    --------
    >>> explain_time_offset(-69.18, 0.01, "2022-02-11T12:00:00 UTC")
    'the offset of -69.18 s is -(TT - UTC) = -69.184 s: dates in TT seem to be read as UTC.'
    """
    if not (np.isfinite(dt) and np.isfinite(sigma) and sigma >= 0):
        raise DataError(f"time offset {dt} s with sigma {sigma} s", allowed="finite, sigma >= 0")
    reach = max(_SIGMAS * sigma, _TIME_FLOOR)
    if abs(dt) <= reach:
        return None
    found = min(_time_slips(epoch), key=lambda slip: abs(slip[0] - dt))
    if abs(found[0] - dt) > reach:
        return None
    return f"the offset of {dt:.6g} s is {found[1]} = {found[0]:.6g} s: {found[2]}."


def _time_slips(epoch: str) -> Iterator[tuple[float, str, str]]:
    date = parse_epoch(epoch).utc.isot
    # The same digits in another scale: how much earlier that instant is.
    ahead = {s: seconds_between(f"{date} {s}", f"{date} UTC") for s in _SCALES[:-1]}
    ahead["BDT"] = ahead["GPS"] + _BDT_MINUS_GPS
    for one in _SCALES:
        for other in _SCALES:
            size = ahead[one] - ahead[other]
            if size > 0:
                what = f"{one} - {other}"
                yield -size, f"-({what})", f"dates in {one} seem to be read as {other}"
                yield size, what, f"dates in {other} seem to be read as {one}"
    yield 1.0, "one second", "a leap second seems to be counted that was not there"
    yield -1.0, "minus one second", "a leap second seems to be missing"


def explain_rotation(angles: npt.ArrayLike, sigmas: npt.ArrayLike, epoch: str) -> str | None:
    """Name the mistaken frame that a rotation of the data's axes looks like.

    Parameters
    ----------
    angles : array_like (3,)
        Estimate of ``FrameRotation``: rotation vector from ICRF axes to the data's, rad.
    sigmas : array_like (3,)
        Standard deviations, rad.
    epoch : str
        A date of the data with its scale.

    Returns
    -------
    str or None
        One sentence, or None if no known frame lies within 4 sigma (or 2e-8 rad) in all three
        components, or if the rotation is not 4 sigma away from zero in any.

    Raises
    ------
    DataError
        If the epoch cannot be read, or a number is not finite.
    """
    theta = as_array(angles, (3,), "angles")
    reach = np.maximum(_SIGMAS * as_array(sigmas, (3,), "sigmas"), _ANGLE_FLOOR)
    if np.all(np.abs(theta) <= reach):
        return None
    found = min(_frame_slips(epoch), key=lambda slip: np.max(np.abs(slip[0] - theta) / reach))
    if np.any(np.abs(found[0] - theta) > reach):
        return None
    size = np.linalg.norm(theta)
    return f"the rotation by {size:.6g} rad is that of {found[1]}."


def _frame_slips(epoch: str) -> Iterator[tuple[Array, str]]:
    tt = terrestrial_time(epoch, 0.0)
    when = float(tt.jd1), float(tt.jd2)
    bias, _, mean = erfa.bp06(*when)
    true = erfa.pnm06a(*when)
    # TEME: the true equator with x along the mean equinox, the equation of equinoxes away.
    uniform = erfa.rz(-erfa.ee06a(*when), true)
    frames = [
        (mean, "the mean equator and equinox of date"),
        (true, "the true equator and equinox of date"),
        (uniform, "TEME (true equator, mean equinox of date)"),
    ]
    for matrix, name in frames:
        yield _vector(matrix), f"axes of {name} read as ICRF"
        yield _vector(bias.T @ matrix), f"axes of {name} read as EME2000"
    yield _vector(bias), "the frame bias: EME2000 (J2000) axes read as ICRF"
    yield _vector(bias.T), "the frame bias: ICRF axes read as EME2000 (J2000)"


def _vector(data_from_icrf: Array) -> Array:
    """Rotation vector of axes: components turn the other way."""
    vector: Array = -Rotation.from_matrix(data_from_icrf).as_rotvec()
    return vector
