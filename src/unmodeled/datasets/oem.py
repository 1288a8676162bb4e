"""Reader of orbit ephemeris messages of the CCSDS, KVN and XML, versions 1 to 3 [CCSDS502].

Own reader.  PyPI ``oem`` 0.4.5 (MIT, Python >= 3.8, needs lxml and defusedxml) and
``orbit-formats`` 0.5.0 (MIT, Python >= 3.10, needs sgp4 and xsdata) both refuse NASA's files of the
ISS, one for the XML root ``ndm``, one for version 2.0 within it; neither turns frames.

What the format means, and what is done with it:

* Positions are km, velocities km/s, accelerations (optional) km/s2; epochs are calendar dates or
  days of the year in the scale that TIME_SYSTEM names.
* ICRF and GCRF are the inertial axes of this package.  EME2000 (J2000), the mean equator and
  equinox of J2000.0, differs from them by the constant frame bias, 23 mas (1.1e-7 rad, 0.8 m at
  the height of the ISS) [IERS2010, ch. 5]; it is taken out.
* ITRF states are Earth-fixed, velocities relative to the rotating Earth; they are turned with
  :mod:`unmodeled.core.earth_orientation`.  Realisations (ITRF97 ... ITRF2020) are not told apart
  (centimetres).  Accelerations in ITRF are left out: the standard does not say what they include.
* TEME and other frames of date are refused.
* A new segment means: do not interpolate across (a manoeuvre).  Segments of one object are joined
  and smoothed one by one; gaps stay.  States outside USEABLE_START_TIME .. USEABLE_STOP_TIME only
  help an interpolation and are left out.  Where a segment begins with the epoch at which the one
  before ended, the earlier state is left out.
* Comments, where producers list manoeuvres, masses and areas, are kept in the notes.  Covariances
  are not read, and the notes say how many there were.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from pathlib import Path

import erfa
import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array
from unmodeled.core.earth_orientation import inertial_from_earth_fixed
from unmodeled.core.errors import DataError
from unmodeled.core.time import seconds_between
from unmodeled.datasets.ccsds import elapsed, time_system
from unmodeled.datasets.oem_format import OemFile, OemSegment, choose_object, read_oem_file
from unmodeled.datasets.smoother import with_accelerations
from unmodeled.datasets.trajectory import Trajectory

__all__ = ["read_oem"]

_ICRF = re.compile(r"(ICRF|GCRF)-?\d?")
_EME2000 = ("EME2000", "J2000")
_ITRF = re.compile(r"ITRF[-_ ]?(\d{2}|\d{4})?")
_FRAMES = "ICRF, GCRF, EME2000 (J2000), ITRF with or without a year"
_J2000 = 2_451_545.0
# Elapsed seconds of the same date in two segments differ by rounding only.
_SAME_EPOCH = 1e-6


def read_oem(
    path: str | Path,
    *,
    satellite: str | None = None,
    center: str | None = None,
    accelerations: bool = True,
) -> Trajectory:
    """Read one object of an OEM as a trajectory.

    Parameters
    ----------
    path : str or Path
        The file, KVN or XML (told apart by content), plain or ``.gz``.
    satellite : str, optional
        OBJECT_ID or OBJECT_NAME; needed where the file has several objects.
    center : str, optional
        The CENTER_NAME that is expected; the file's own is in the notes in any case.
    accelerations : bool
        Whether the smoother adds accelerations where the file has none.

    Returns
    -------
    Trajectory
        SI, inertial (ICRF) axes, from the centre of the body that the notes name.

    Raises
    ------
    DataError
        If the file is missing, empty, not an OEM, of an unknown version, cut short or malformed;
        has several objects or none of that name; changes its centre, frame or time system; or
        has a centre, frame or time system that cannot be used.
    """
    name = Path(path).name
    file = read_oem_file(path)
    segments = choose_object(file.segments, satellite, name)
    meta = segments[0].meta
    for key in ("CENTER_NAME", "REF_FRAME", "TIME_SYSTEM"):
        values = sorted({s.meta[key].upper() for s in segments})
        if len(values) > 1:
            raise DataError(
                f"{name} has segments of {meta['OBJECT_NAME']} with {key} {', '.join(values)}",
                allowed="one and the same in all segments",
                do="write one file for each",
            )
    _check_center(meta["CENTER_NAME"], center, name)
    notes = _notes(file, segments)
    pieces = _pieces(segments, name, notes)
    given = all(p.accelerations is not None for p in pieces)
    if not given:
        pieces = [replace(p, accelerations=None) for p in pieces]
        if accelerations:
            pieces = [with_accelerations(p) for p in pieces]
    return _joined(pieces, notes)


def _check_center(center: str, wanted: str | None, file: str) -> None:
    if wanted is not None and center.casefold() != wanted.strip().casefold():
        raise DataError(f'{file}: CENTER_NAME is "{center}"', allowed=wanted)
    if "BARYCENTER" in center.upper() or center.upper() in ("SSB", "EMB"):
        raise DataError(
            f'{file}: CENTER_NAME is "{center}"',
            allowed="a body: a trajectory counts from its centre of mass",
            do="have the producer write the orbit about its body",
        )


def _notes(file: OemFile, segments: list[OemSegment]) -> dict[str, object]:
    meta = segments[0].meta
    notes: dict[str, object] = {
        "format": f"CCSDS OEM {file.version} ({file.notation})",
        "originator": file.header.get("ORIGINATOR", ""),
        "created": file.header.get("CREATION_DATE", ""),
        "satellite": f"{meta['OBJECT_ID']} ({meta['OBJECT_NAME']})",
        "center": meta["CENTER_NAME"],
        "frame_in_file": meta["REF_FRAME"],
        "time_system": meta["TIME_SYSTEM"],
        "segments": len(segments),
    }
    comments = [c for c in file.comments + [c for s in segments for c in s.comments] if c.strip()]
    if comments:
        notes["comments"] = comments
    skipped = sum(s.covariances for s in segments)
    if skipped:
        notes["covariances"] = f"{skipped} in the file, not read"
    return notes


def _pieces(segments: list[OemSegment], file: str, notes: dict[str, object]) -> list[Trajectory]:
    """One trajectory a segment, all from the first one's epoch, none overlapping the next."""
    start, pieces, left_out = "", [], 0
    kept: list[tuple[OemSegment, Array, Array]] = []
    for segment in segments:
        epoch, times = _times(segment, file)
        start = start or epoch
        times = times + (seconds_between(start, epoch) if epoch != start else 0.0)
        usable = _usable(segment, times, start, file)
        if kept and _touch(kept[-1][1], times[usable]):
            kept[-1] = (kept[-1][0], kept[-1][1][:-1], kept[-1][2][:-1])
            left_out += 1
        left_out += int(np.sum(~usable))
        kept.append((segment, times[usable], np.array(segment.values)[usable]))
    for (_, before, _), (segment, after, _) in itertools.pairwise(kept):
        if len(before) and len(after) and after[0] < before[-1]:
            raise DataError(
                f"{file}, {segment.places[0]}: a segment begins before the one ahead of it ends",
                allowed="segments in order of time that share one epoch at most",
                do="sort the segments, or write one file for each",
            )
    if left_out:
        notes["states_left_out"] = left_out
    for segment, times, values in kept:
        turned = _inertial(segment, start, times, values * 1e3, notes, file)
        pieces.append(Trajectory(times, *turned, source=file, epoch=start))
    return pieces


def _touch(before: Array, after: Array) -> bool:
    return len(before) > 0 and len(after) > 0 and abs(after[0] - before[-1]) < _SAME_EPOCH


def _times(segment: OemSegment, file: str) -> tuple[str, Array]:
    scale = time_system(segment.meta, file)
    epoch, times = elapsed(segment.epochs, scale, segment.places, file)
    steps = np.diff(times)
    if np.any(steps <= 0):
        k = int(np.argmax(steps <= 0))
        raise DataError(
            f"{file}, {segment.places[k + 1]}: time "
            + ("repeats" if steps[k] == 0 else "goes back"),
            allowed="strictly increasing times within a segment",
            do="sort the states and remove duplicates",
        )
    stop = _moment(segment, "STOP_TIME", epoch, file)
    # Less than a step is missing where the producer's grid does not meet its own end.
    if len(steps) and stop - times[-1] >= max(steps[-1], np.median(steps)):
        raise DataError(
            f"{file} is cut short: states of {segment.meta['OBJECT_NAME']} end "
            f"{stop - times[-1]:.6g} s before STOP_TIME {segment.meta['STOP_TIME']}",
            do="fetch the file again",
        )
    return epoch, times


def _usable(segment: OemSegment, times: Array, epoch: str, file: str) -> npt.NDArray[np.bool_]:
    inside = np.ones(len(times), dtype=bool)
    if "USEABLE_START_TIME" in segment.meta:
        inside &= times >= _moment(segment, "USEABLE_START_TIME", epoch, file)
    if "USEABLE_STOP_TIME" in segment.meta:
        inside &= times <= _moment(segment, "USEABLE_STOP_TIME", epoch, file)
    return inside


def _moment(segment: OemSegment, key: str, epoch: str, file: str) -> float:
    """Seconds from the epoch to a date of the metadata."""
    scale = time_system(segment.meta, file)
    return seconds_between(epoch, elapsed([segment.meta[key]], scale, [key], file)[0])


def _inertial(
    segment: OemSegment, epoch: str, times: Array, si: Array, notes: dict[str, object], file: str
) -> tuple[Array, Array, Array | None]:
    """Positions, velocities and accelerations (or None) along ICRF axes."""
    frame = segment.meta["REF_FRAME"].upper()
    r, v, a = si[:, :3], si[:, 3:6], si[:, 6:] if si.shape[1] == 9 else None
    if _ICRF.fullmatch(frame):
        return r, v, a
    if frame in _EME2000:
        notes["frame"] = "EME2000 turned to ICRF axes by the frame bias"
        bias = erfa.bp06(_J2000, 0.0)[0]  # EME2000 from ICRF: a row vector times it goes back
        return r @ bias, v @ bias, None if a is None else a @ bias
    if _ITRF.fullmatch(frame) and segment.meta["CENTER_NAME"].upper() == "EARTH":
        notes["frame"] = "ITRF turned to inertial axes with the installed Earth orientation"
        if a is not None:
            notes["accelerations_in_file"] = "not used: Earth-fixed"
        return *inertial_from_earth_fixed(epoch, times, r, v), None
    raise DataError(
        f'{file}: REF_FRAME is "{segment.meta["REF_FRAME"]}" about {segment.meta["CENTER_NAME"]}',
        allowed=_FRAMES + " (about the Earth)",
        do="have the producer write the orbit in one of these",
    )


def _joined(pieces: list[Trajectory], notes: dict[str, object]) -> Trajectory:
    sigma = 0.0
    made = [p.notes["accelerations"] for p in pieces if "accelerations" in p.notes]
    if made:
        medians = np.repeat([m["median_sigma_m_s2"] for m in made], [len(p) for p in pieces])
        sigma = float(np.median(medians))
        notes["accelerations"] = made[0] | {
            "median_sigma_m_s2": sigma,
            "largest_sigma_m_s2": max(m["largest_sigma_m_s2"] for m in made),
            "degrees": sorted({d for m in made for d in m["degrees"]}),
            "widths": [min(m["widths"][0] for m in made), max(m["widths"][1] for m in made)],
        }
    accelerations = [p.accelerations for p in pieces if p.accelerations is not None]
    return Trajectory(
        np.concatenate([p.times for p in pieces]),
        np.concatenate([p.positions for p in pieces]),
        np.concatenate([p.velocities for p in pieces]),
        np.concatenate(accelerations) if accelerations else None,
        source=pieces[0].source,
        epoch=pieces[0].epoch,
        acceleration_sigma=sigma,
        notes=notes,
    )
