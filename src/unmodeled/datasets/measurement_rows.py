"""Rows of a measurement file, before they become measurements: what every reader returns."""

from __future__ import annotations

from dataclasses import dataclass

import erfa
import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.earth_orientation import (
    earth_rotation_vector,
    icrf_from_itrf,
    inertial_from_earth_fixed,
)
from unmodeled.core.errors import DataError, nearest
from unmodeled.core.frames import turned

__all__ = ["Rows", "frame_name", "from_icrf", "to_icrf"]

_J2000 = 2_451_545.0
_FRAMES = {
    "ICRF": "ICRF",
    "GCRF": "ICRF",
    "GCRS": "ICRF",
    "INERTIAL": "ICRF",
    "EME2000": "EME2000",
    "J2000": "EME2000",
    "ITRF": "ITRF",
    "ITRS": "ITRF",
}


@dataclass
class Rows:
    """Readings of one station (or of none) in SI.

    Parameters
    ----------
    epoch : str
        Date of time zero with its scale; empty if the file has none.
    times : ndarray (n,)
        SI seconds since it.
    values : ndarray (n, k)
        SI, along the axes of ``frame``.
    sigma : ndarray (n, k) or None
        Standard deviations, where the file states them.
    frame : str
        ``"ICRF"``, ``"EME2000"`` or ``"ITRF"``; empty where no axes matter.
    station : str
        Its name; empty if the file names none.
    ways : int
        Of ranges.
    """

    epoch: str
    times: Array
    values: Array
    sigma: Array | None = None
    frame: str = ""
    station: str = ""
    ways: int = 1


def frame_name(text: str, where: str) -> str:
    """Return the frame that a name of it means: ``"ICRF"``, ``"EME2000"`` or ``"ITRF"``.

    Raises
    ------
    DataError
        If the frame is unknown, or one of date.
    """
    word = text.strip().upper().replace("_", "-")
    stem = (
        word.rstrip("0123456789").rstrip("-") if word.startswith(("ITRF", "ICRF", "GCRF")) else ""
    )
    for name in (word, stem):
        if name in _FRAMES:
            return _FRAMES[name]
    raise DataError(
        f'{where}: frame "{text}" cannot be used',
        allowed="ICRF (GCRF), EME2000 (J2000), ITRF",
        do=nearest(word, _FRAMES),
    )


def to_icrf(frame: str, epoch: str, times: Array, values: Array) -> Array:
    """Turn positions (n, 3), or positions and velocities (n, 6), from a frame to ICRF axes.

    Velocities in ITRF are relative to the rotating Earth [CCSDS502].
    """
    r, v = values[:, :3], values[:, 3:]
    if frame == "EME2000":
        bias = _bias()
        return np.hstack([r @ bias, v @ bias]) if v.size else r @ bias
    if frame == "ITRF" and v.size:
        return np.hstack(inertial_from_earth_fixed(epoch, times, r, v))
    if frame == "ITRF":
        return turned(icrf_from_itrf(epoch, times), r)
    return values


def from_icrf(frame: str, epoch: str, times: Array, values: Array) -> Array:
    """Undo `to_icrf`."""
    r, v = values[:, :3], values[:, 3:]
    if frame == "EME2000":
        bias = _bias().T
        return np.hstack([r @ bias, v @ bias]) if v.size else r @ bias
    if frame == "ITRF":
        back = np.swapaxes(icrf_from_itrf(epoch, times), 1, 2)
        r = turned(back, r)
        if not v.size:
            return r
        return np.hstack([r, turned(back, v) - np.cross(earth_rotation_vector(epoch, times), r)])
    return values


def _bias() -> Array:
    """EME2000 from ICRF: a row vector times it goes from EME2000 to ICRF."""
    return np.asarray(erfa.bp06(_J2000, 0.0)[0], dtype=np.float64)
