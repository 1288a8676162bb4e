"""The text of CCSDS orbit ephemeris messages: from KVN or XML to segments, in the file's units.

See :mod:`unmodeled.datasets.oem` for what the message means and what is done with it.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

from unmodeled.core.errors import DataError, nearest
from unmodeled.datasets.ccsds import check_version, keywords, read_text, required, xml_root

__all__ = ["OemFile", "OemSegment", "choose_object", "read_oem_file"]

_MANDATORY = (
    "OBJECT_NAME",
    "OBJECT_ID",
    "CENTER_NAME",
    "REF_FRAME",
    "TIME_SYSTEM",
    "START_TIME",
    "STOP_TIME",
)
_STATE = (
    ("X", "km"),
    ("Y", "km"),
    ("Z", "km"),
    ("X_DOT", "km/s"),
    ("Y_DOT", "km/s"),
    ("Z_DOT", "km/s"),
)
_ACCELERATION = tuple((f"{c}_DDOT", "km/s**2") for c in "XYZ")


@dataclass
class OemSegment:
    """One metadata block with its states, as the file has them.

    Parameters
    ----------
    meta : dict
        Keyword -> value.
    epochs : list of str
        One a state.
    values : list of list of float
        Position km, velocity km/s and, in all states or none, acceleration km/s2.
    places : list of str
        Where each state stands, for errors.
    comments : list of str
        Of the metadata and of the data, in order.
    covariances : int
        Number of covariance matrices, which are not read.
    """

    meta: dict[str, str] = field(default_factory=dict)
    epochs: list[str] = field(default_factory=list)
    values: list[list[float]] = field(default_factory=list)
    places: list[str] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)
    covariances: int = 0

    def add(self, epoch: str, words: list[str], place: str, file: str) -> None:
        """Append a state of 6 or 9 numbers."""
        where = f"{file}, {place}"
        if len(words) not in (6, 9) or (self.values and len(words) != len(self.values[0])):
            raise DataError(
                f"{where}: a state has {len(words)} numbers",
                allowed="6 (position, velocity) or 9 (and acceleration), the same in a segment",
                do="the file may be cut short: fetch it again",
            )
        try:
            values = [float(w) for w in words]
        except ValueError:
            values = [math.nan]
        if not all(map(math.isfinite, values)):
            raise DataError(
                f'{where}: "{" ".join(words)}" are not finite numbers',
                do="remove or repair this state",
            )
        self.epochs.append(epoch)
        self.values.append(values)
        self.places.append(place)

    def check(self, file: str) -> None:
        """Refuse a segment without its metadata or without states."""
        required(self.meta, _MANDATORY, f"{file}, metadata")
        if not self.epochs:
            raise DataError(
                f"{file} has metadata of {self.meta['OBJECT_NAME']} without states",
                do="it may be cut short: fetch the file again",
            )


@dataclass
class OemFile:
    """A message: version, notation (``"KVN"`` or ``"XML"``), header and segments."""

    version: str
    notation: str
    header: dict[str, str] = field(default_factory=dict)
    comments: list[str] = field(default_factory=list)
    segments: list[OemSegment] = field(default_factory=list)


def read_oem_file(path: str | Path) -> OemFile:
    """Read the segments of an OEM, KVN or XML, plain or gzipped; no unit or frame is changed.

    Raises
    ------
    DataError
        As in :func:`unmodeled.datasets.oem.read_oem`.
    """
    path = Path(path)
    text = read_text(path)
    found = _xml(text, path.name) if text.lstrip().startswith("<") else _kvn(text, path.name)
    if not found.segments:
        raise DataError(f"{path.name} has no segments", do="it may be cut short: fetch it again")
    for segment in found.segments:
        segment.check(path.name)
    return found


def choose_object(segments: list[OemSegment], wanted: str | None, file: str) -> list[OemSegment]:
    """Return the segments of one object, by OBJECT_ID or OBJECT_NAME, or of the only one."""
    objects = {s.meta["OBJECT_ID"]: s.meta["OBJECT_NAME"] for s in segments}
    if wanted is None:
        if len(objects) > 1:
            raise DataError(
                f"{file} has {len(objects)} objects",
                allowed=", ".join(f"{k} ({v})" for k, v in objects.items()),
                do="choose one with the option satellite",
            )
        return segments
    label = wanted.strip().casefold()
    found = [k for k, v in objects.items() if label in (k.casefold(), v.casefold())]
    if len(found) != 1:
        raise DataError(
            f'{file} has {len(found) or "no"} object(s) "{wanted}"',
            do=nearest(wanted, [*objects, *objects.values()])
            if not found
            else "choose by identifier: " + ", ".join(found),
        )
    return [s for s in segments if s.meta["OBJECT_ID"] == found[0]]


def _not_oem(begin: str, file: str) -> DataError:
    return DataError(
        f'{file} is not an OEM: it begins "{begin[:30].strip()}"',
        allowed="a first line CCSDS_OEM_VERS = 2.0, or XML with <oem> in it",
        do="read tracking data with unmodeled.datasets.tdm.read_tdm"
        if "TDM" in begin.upper()
        else "check the file's format",
    )


def _kvn(text: str, file: str) -> OemFile:
    lines = list(keywords(text))
    first = next((n for n, line in enumerate(lines) if line[1] != "COMMENT"), 0)
    if lines[first][1] != "CCSDS_OEM_VERS":
        raise _not_oem(lines[first][1], file)
    found = OemFile(check_version(lines[first][2], "OEM", file), "KVN")
    part = "header"
    for number, key, value in lines:
        segment = found.segments[-1] if found.segments else None
        if key == "META_START" and part in ("header", "data"):
            part = "metadata"
            found.segments.append(OemSegment())
        elif key == "META_STOP" and part == "metadata":
            part = "data"
        elif key == "COVARIANCE_START" and part == "data":
            part = "covariance"
        elif key == "COVARIANCE_STOP" and part == "covariance":
            part = "data"
        elif key == "COMMENT":
            (found.comments if segment is None else segment.comments).append(value)
        elif part == "header":
            found.header[key] = value
        elif segment is not None and part == "metadata":
            segment.meta[key] = value
        elif segment is not None and part == "covariance":
            segment.covariances += key == "EPOCH"
        elif segment is not None and not value:
            epoch, *words = key.split()
            segment.add(epoch, words, f"line {number}", file)
        else:
            raise DataError(
                f'{file}, line {number}: "{key}" is out of place',
                allowed="states, COMMENT, COVARIANCE_START or META_START",
            )
    if part in ("metadata", "covariance"):
        raise DataError(f"{file} ends within its {part}", do="it is cut short: fetch it again")
    return found


def _xml(text: str, file: str) -> OemFile:
    root = xml_root(text, file)
    messages = [e for e in root.iter() if e.tag == "oem"]
    if not messages:
        raise _not_oem("".join(f"<{e.tag}>" for e in [root, *root[:1]]), file)
    versions = {check_version(m.get("version", ""), "OEM", file) for m in messages}
    found = OemFile(max(versions), "XML")
    for message in messages:
        for element in message.iterfind("header/*"):
            text = _text(element)
            if element.tag == "COMMENT":
                found.comments.append(text)
            else:
                found.header[element.tag] = text
        found.segments += [_xml_segment(s, file) for s in message.iterfind("body/segment")]
    return found


def _xml_segment(element: ET.Element, file: str) -> OemSegment:
    segment = OemSegment()
    for item in element.iterfind("metadata/*"):
        if item.tag == "COMMENT":
            segment.comments.append(_text(item))
        else:
            segment.meta[item.tag] = _text(item)
    for item in element.iterfind("data/*"):
        if item.tag == "COMMENT":
            segment.comments.append(_text(item))
        elif item.tag == "covarianceMatrix":
            segment.covariances += 1
        elif item.tag == "stateVector":
            _xml_state(segment, item, file)
    return segment


def _xml_state(segment: OemSegment, element: ET.Element, file: str) -> None:
    place = f"state {len(segment.epochs) + 1}"
    fields = {e.tag: e for e in element}
    wanted = _STATE + (_ACCELERATION if "X_DDOT" in fields else ())
    for name, unit in (("EPOCH", ""), *wanted):
        if name not in fields:
            raise DataError(f"{file}, {place}: {name} is missing", do="check the file's producer")
        given = fields[name].get("units", unit)
        if given != unit:
            raise DataError(f'{file}, {place}: {name} has units "{given}"', allowed=unit)
    words = [_text(fields[name]) for name, _ in wanted]
    segment.add(_text(fields["EPOCH"]), words, place, file)


def _text(element: ET.Element) -> str:
    return (element.text or "").strip()
