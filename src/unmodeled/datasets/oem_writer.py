"""Writer of orbit ephemeris messages of the CCSDS, KVN, version 2.0 [CCSDS502].

Axes are ICRF, positions are printed to 1e-9 km (1e-6 m), velocities to 1e-12 km/s (1e-9 m/s),
epochs to 1e-9 s: a time between two nanoseconds moves by at most half of one.
"""

from __future__ import annotations

import datetime
import textwrap
import warnings
from collections.abc import Sequence
from pathlib import Path

import erfa
import numpy as np
from astropy.time import Time, TimeDelta

from unmodeled.core.errors import DataError
from unmodeled.core.time import check_scale, terrestrial_time
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["write_oem"]

# The standard allows 254 characters a line.
_WIDTH = 200


def write_oem(
    trajectory: Trajectory,
    path: str | Path,
    *,
    object_name: str,
    object_id: str,
    center_name: str,
    originator: str = "UNMODELED",
    time_system: str | None = None,
    creation_date: str | None = None,
    comments: Sequence[str] = (),
    accelerations: bool = False,
) -> Path:
    """Write a trajectory as one segment of an OEM.

    Parameters
    ----------
    trajectory : Trajectory
        In the inertial frame, with an epoch.
    path : str or Path
        The file to write; ``.oem`` is what :func:`unmodeled.read_trajectory` knows.
    object_name, object_id, center_name : str
        Such as ``"ISS"``, ``"1998-067-A"``, ``"EARTH"``; the trajectory does not know them.
    originator : str
        Who made it.
    time_system : str, optional
        UTC, TAI, TT, TDB or GPS; the epoch's own scale by default.
    creation_date : str, optional
        UTC, ``"2024-01-31T12:00:00"``; now by default.
    comments : sequence of str
        Written into the metadata.
    accelerations : bool
        Whether to write accelerations too, km/s2, if the trajectory has them.

    Returns
    -------
    Path
        ``path``.

    Raises
    ------
    DataError
        If the trajectory is not inertial or has no epoch, a text is empty or not ASCII, or the
        suffix promises XML.
    """
    path = Path(path)
    label = trajectory.source or "trajectory"
    if path.suffix.lower() in (".xml", ".gz"):
        raise DataError(f'{path.name} has suffix "{path.suffix}"', allowed=".oem: plain KVN")
    if trajectory.frame != "inertial":
        raise DataError(f"{label} is in the {trajectory.frame} frame", allowed="inertial")
    if not trajectory.epoch:
        raise DataError(f"{label} has no epoch", do="give one, an OEM has dates only")
    own = "UTC" if trajectory.epoch.endswith("Z") else trajectory.epoch.split()[-1]
    scale = check_scale(time_system or own)
    dates = _dates(trajectory, scale)
    now = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%S")
    fields = {
        "CCSDS_OEM_VERS": "2.0",
        "CREATION_DATE": creation_date or now,
        "ORIGINATOR": originator,
        "META_START": "",
        "OBJECT_NAME": object_name,
        "OBJECT_ID": object_id,
        "CENTER_NAME": center_name.upper(),
        "REF_FRAME": "ICRF",
        "TIME_SYSTEM": scale,
        "START_TIME": dates[0],
        "STOP_TIME": dates[-1],
        "META_STOP": "",
    }
    lines = []
    for key, value in fields.items():
        if key.startswith("META_"):
            lines += ["", key] if key == "META_START" else [key, ""]
            if key == "META_START":
                lines += [f"COMMENT {w}" for c in comments for w in textwrap.wrap(c, _WIDTH)]
        else:
            lines.append(f"{key} = {_word(value, key)}")
    block = np.hstack([trajectory.positions, trajectory.velocities]) / 1e3
    states = [
        "".join(f" {x:.9f}" for x in row[:3]) + "".join(f" {x:.12f}" for x in row[3:])
        for row in block.tolist()
    ]
    if accelerations and trajectory.accelerations is not None:
        extra = (trajectory.accelerations / 1e3).tolist()
        states = [s + "".join(f" {x:.15e}" for x in a) for s, a in zip(states, extra, strict=True)]
    lines += [date + state for date, state in zip(dates, states, strict=True)]
    text = "\n".join(lines) + "\n"
    if not text.isascii():
        raise DataError(f"{path.name}: a name or comment is not ASCII", do="spell it in ASCII")
    path.write_text(text, encoding="ascii", newline="\n")
    return path


def _dates(trajectory: Trajectory, scale: str) -> list[str]:
    stamps = terrestrial_time(trajectory.epoch, trajectory.times)
    with warnings.catch_warnings():
        # Dates beyond the table of leap seconds; reading the epoch has warned of them.
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        if scale == "GPS":
            shifted = stamps.tai - TimeDelta(19.0, format="sec")
        else:
            shifted = getattr(stamps, scale.lower())
        return [str(d) for d in Time(shifted, precision=9).isot]


def _word(value: str, key: str) -> str:
    word = " ".join(value.split())
    if not word:
        raise DataError(f"{key} is empty", allowed="a text", do="say what the orbit is of")
    return word
