"""CCSDS tracking data messages in XML: the same segments and keywords as in KVN [CCSDS503]."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from unmodeled.core.errors import DataError
from unmodeled.datasets.ccsds import check_version, xml_root
from unmodeled.datasets.tdm_format import RawSegment, check_filled, not_tdm, observation

__all__ = ["parse_xml"]

#: Units are fixed by the keyword; the attribute may only repeat them.  Angles: deg.
_UNITS = {
    "ANGLE_1": "deg",
    "ANGLE_2": "deg",
    "DOPPLER_INSTANTANEOUS": "km/s",
    "DOPPLER_INTEGRATED": "km/s",
}


def parse_xml(text: str, file: str) -> tuple[dict[str, str], list[RawSegment]]:
    """Return the header's keywords and the segments of a TDM in XML.

    Observations are numbered from 1 in each segment.

    Raises
    ------
    DataError
        If the XML is malformed or cut short, has no ``<tdm>``, an unknown version, an observation
        without date or with more than one reading, a unit that the keyword does not have, or a
        segment without observations.
    """
    root = xml_root(text, file)
    messages = [e for e in root.iter() if e.tag == "tdm"]
    if not messages:
        raise not_tdm("".join(f"<{e.tag}>" for e in [root, *root[:1]]), file)
    header: dict[str, str] = {}
    raw: list[RawSegment] = []
    for message in messages:
        header["CCSDS_TDM_VERS"] = check_version(message.get("version", ""), "TDM", file)
        for item in message.iterfind("header/*"):
            header.setdefault(item.tag, _text(item))
        raw += [_segment(s, file) for s in message.iterfind("body/segment")]
    check_filled(raw, file)
    return header, raw


def _segment(element: ET.Element, file: str) -> RawSegment:
    found = RawSegment(place="observation")
    for item in element.iterfind("metadata/*"):
        if item.tag == "COMMENT":
            found.comments.append(_text(item))
        else:
            found.meta[item.tag] = _text(item)
    number = 0
    for item in element.iterfind("data/*"):
        if item.tag == "COMMENT":
            found.comments.append(_text(item))
        elif item.tag == "observation":
            number += 1
            ranges = found.meta.get("RANGE_UNITS", "km")
            found.rows.append(_observation(item, number, ranges, f"{file}, observation {number}"))
        else:
            raise DataError(
                f"{file}: <{item.tag}> is out of place", allowed="<observation>, <COMMENT>"
            )
    return found


def _observation(
    element: ET.Element, number: int, ranges: str, where: str
) -> tuple[int, str, str, float]:
    epochs = [e for e in element if e.tag == "EPOCH"]
    readings = [e for e in element if e.tag not in ("EPOCH", "COMMENT")]
    if len(epochs) != 1 or len(readings) != 1:
        tags = ", ".join(e.tag for e in element) or "nothing"
        raise DataError(
            f"{where} has {tags}",
            allowed="one EPOCH and one reading",
            do="the file may be cut short: fetch it again",
        )
    key, unit = readings[0].tag, readings[0].get("units")
    wanted = ranges if key == "RANGE" else _UNITS.get(key, unit)
    if unit is not None and unit != wanted:
        raise DataError(f'{where}: {key} has units "{unit}"', allowed=wanted or "")
    return observation(number, key, f"{_text(epochs[0])} {_text(readings[0])}", where)


def _text(element: ET.Element) -> str:
    return (element.text or "").strip()
