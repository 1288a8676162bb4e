"""Reader of tracking data messages of the CCSDS, KVN and XML, versions 1 and 2 [CCSDS503].

The result is one row an observation, in SI, and the metadata of each segment.  Nothing is
corrected: whether light time, troposphere or aberration have been taken out is in
``TdmSegment.corrections_applied``, and corrections that the file lists but did not apply are in
``TdmSegment.meta``, in the file's units.  What the values mean:

* ``range`` is as the file gives it along ``path``, never halved: for ``A > B > A`` it may be the
  way there and back, and producers differ.  RANGE_MODULUS, where not zero, is in ``meta``.
* Angles are along the axes of ``frame`` as the file names it; EME2000 differs from ICRF by 23 mas
  (1.1e-7 rad), which is not taken out.
* ``range_rate`` is instantaneous; ``range_rate_integrated`` is the mean over
  INTEGRATION_INTERVAL.  FREQ_OFFSET is added to frequencies that are received.
* Keywords that are not known are kept with their name in small letters, no unit and the file's
  number, and listed in ``TrackingData.unknown``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from unmodeled.core.errors import DataError
from unmodeled.core.time import seconds_between
from unmodeled.datasets.ccsds import elapsed, read_text, required, time_system
from unmodeled.datasets.tdm_format import RawSegment, meaning, parse, path_words
from unmodeled.datasets.tdm_xml import parse_xml

__all__ = ["TdmSegment", "TrackingData", "read_tdm"]

_COLUMNS = ("time_s", "kind", "value", "unit", "path", "mode", "segment")


@dataclass(frozen=True)
class TdmSegment:
    """What a segment's metadata say of its observations.

    Parameters
    ----------
    time_system : str
        Scale of the file's dates.
    participants : dict
        Number -> name.
    path, mode : str
        As in the table.
    angle_type, frame : str
        ANGLE_TYPE and REFERENCE_FRAME; empty if the file has none.
    range_units : str
        Unit of RANGE in the file, before it was turned into metres.
    timetag : str
        TIMETAG_REF: whether dates are those of transmission or of reception.
    corrections_applied : str
        ``"YES"``, ``"NO"`` or empty.
    meta : dict
        All keywords and their text.
    comments : tuple of str
        Of the metadata and of the data.
    """

    time_system: str
    participants: dict[int, str]
    path: str
    mode: str
    angle_type: str
    frame: str
    range_units: str
    timetag: str
    corrections_applied: str
    meta: dict[str, str]
    comments: tuple[str, ...]


@dataclass(frozen=True)
class TrackingData:
    """Observations and where they come from.

    Parameters
    ----------
    observations : DataFrame
        ``time_s`` (SI seconds since ``epoch``), ``kind``, ``value``, ``unit``, ``path``,
        ``mode``, ``segment`` (index into ``segments``); in the file's order.
    epoch : str
        First date of the file's observations, with its scale.
    segments : tuple of TdmSegment
        Metadata.
    source, version, originator, created : str
        Name of the file and its header.
    unknown : tuple of str
        Keywords that were kept without a unit.
    """

    observations: pd.DataFrame
    epoch: str
    segments: tuple[TdmSegment, ...]
    source: str
    version: str
    originator: str = ""
    created: str = ""
    unknown: tuple[str, ...] = ()


def read_tdm(path: str | Path) -> TrackingData:
    """Read a TDM.

    Parameters
    ----------
    path : str or Path
        The file, KVN or XML (told apart by content), plain or ``.gz``.

    Returns
    -------
    TrackingData
        In SI.

    Raises
    ------
    DataError
        If the file is missing, empty, not a TDM, of an unknown version, cut short or
        malformed; its time system is not one of ours; an observation's meaning is left open (see
        :func:`unmodeled.datasets.tdm_format.meaning`); or dates of one keyword go back.
    """
    path = Path(path)
    text = read_text(path)
    header, raw = (parse_xml if text.lstrip().startswith("<") else parse)(text, path.name)
    tables, segments, unknown = [], [], []
    start = ""
    for number, part in enumerate(raw):
        required(part.meta, ("TIME_SYSTEM", "PARTICIPANT_1"), f"{path.name}, metadata")
        segment = _segment(part, path.name)
        epoch, table, strange = _table(part, segment, path.name)
        start = start or epoch
        shift = seconds_between(start, epoch) if epoch != start else 0.0
        tables.append(table.assign(time_s=table["time_s"] + shift, segment=number))
        segments.append(segment)
        unknown += strange
    return TrackingData(
        pd.concat(tables, ignore_index=True)[list(_COLUMNS)],
        start,
        tuple(segments),
        path.name,
        header["CCSDS_TDM_VERS"],
        header.get("ORIGINATOR", ""),
        header.get("CREATION_DATE", ""),
        tuple(dict.fromkeys(unknown)),
    )


def _segment(part: RawSegment, file: str) -> TdmSegment:
    meta = part.meta
    participants = {
        int(k[12:]): v for k, v in meta.items() if k.startswith("PARTICIPANT_") and k[12:].isdigit()
    }
    return TdmSegment(
        time_system(meta, file),
        participants,
        path_words(meta, f"{file}, metadata"),
        meta.get("MODE", ""),
        meta.get("ANGLE_TYPE", ""),
        meta.get("REFERENCE_FRAME", ""),
        meta.get("RANGE_UNITS", ""),
        meta.get("TIMETAG_REF", ""),
        meta.get("CORRECTIONS_APPLIED", ""),
        dict(meta),
        tuple(part.comments),
    )


def _table(part: RawSegment, segment: TdmSegment, file: str) -> tuple[str, pd.DataFrame, list[str]]:
    places = [f"{part.place} {number}" for number, *_ in part.rows]
    epoch, times = elapsed([e for _, _, e, _ in part.rows], segment.time_system, places, file)
    offset = part.meta.get("FREQ_OFFSET", "0")
    kinds, values, units, unknown = [], [], [], []
    last: dict[str, float] = {}
    for (_, key, _, reading), time, place in zip(part.rows, times, places, strict=True):
        if time < last.get(key, -np.inf):
            raise DataError(
                f"{file}, {place}: dates of {key} go back",
                allowed="dates in order of time, keyword by keyword",
                do="sort the observations",
            )
        last[key] = float(time)
        found = meaning(key, part.meta, f"{file}, {place}")
        if found is None:
            unknown.append(key)
        kind, factor, unit = found or (key.lower(), 1.0, "")
        kinds.append(kind)
        units.append(unit)
        shifted = kind.startswith("receive_frequency")
        values.append(reading * factor + (_number(offset, file) if shifted else 0.0))
    columns = {"time_s": times, "kind": kinds, "value": values, "unit": units}
    table = pd.DataFrame(columns).assign(path=segment.path, mode=segment.mode)
    return epoch, table, unknown


def _number(text: str, file: str) -> float:
    try:
        return float(text.split()[0])
    except (ValueError, IndexError) as exc:
        raise DataError(f'{file}: FREQ_OFFSET is "{text}"', allowed="a number, Hz") from exc
