"""The text of CCSDS tracking data messages: segments, keywords, their kinds and units [CCSDS503].

See :mod:`unmodeled.datasets.tdm` for the reader.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from unmodeled.core.constants import SPEED_OF_LIGHT
from unmodeled.core.errors import DataError
from unmodeled.datasets.ccsds import check_version, keywords

__all__ = [
    "ANGLES",
    "RawSegment",
    "check_filled",
    "meaning",
    "not_tdm",
    "observation",
    "parse",
    "path_words",
]

_DEGREE = math.pi / 180
#: ANGLE_TYPE -> kinds of ANGLE_1 and ANGLE_2.
ANGLES = {
    "RADEC": ("right_ascension", "declination"),
    "AZEL": ("azimuth", "elevation"),
    "XEYN": ("x_east", "y_north"),
    "XSYE": ("x_south", "y_east"),
}
_RANGE = {"km": 1e3, "s": SPEED_OF_LIGHT.value}
# Keyword -> kind, factor to the unit, unit.
_KNOWN = {
    "DOPPLER_INSTANTANEOUS": ("range_rate", 1e3, "m/s"),
    "DOPPLER_INTEGRATED": ("range_rate_integrated", 1e3, "m/s"),
    "TRANSMIT_FREQ": ("transmit_frequency", 1.0, "Hz"),
    "RECEIVE_FREQ": ("receive_frequency", 1.0, "Hz"),
    "DOR": ("delta_one_way_range", 1.0, "s"),
    "VLBI_DELAY": ("vlbi_delay", 1.0, "s"),
    "CLOCK_BIAS": ("clock_bias", 1.0, "s"),
    "CLOCK_DRIFT": ("clock_drift", 1.0, "s/s"),
    "CARRIER_POWER": ("carrier_power", 1.0, "dBW"),
    "PC_N0": ("carrier_to_noise", 1.0, "dBHz"),
    "PR_N0": ("ranging_to_noise", 1.0, "dBHz"),
    "MAG": ("magnitude", 1.0, "mag"),
    "RCS": ("radar_cross_section", 1.0, "m2"),
    "STEC": ("slant_electron_content", 1e16, "1/m2"),
    "TROPO_DRY": ("troposphere_dry", 1.0, "m"),
    "TROPO_WET": ("troposphere_wet", 1.0, "m"),
    "PRESSURE": ("pressure", 100.0, "Pa"),
    "RHUMIDITY": ("relative_humidity", 0.01, "1"),
    "TEMPERATURE": ("temperature", 1.0, "K"),
}


@dataclass
class RawSegment:
    """One segment as the file has it; a row is number of ``place``, keyword, epoch, reading."""

    meta: dict[str, str] = field(default_factory=dict)
    comments: list[str] = field(default_factory=list)
    rows: list[tuple[int, str, str, float]] = field(default_factory=list)
    place: str = "line"


def parse(text: str, file: str) -> tuple[dict[str, str], list[RawSegment]]:
    """Return the header's keywords and the segments of a TDM in KVN, or raise ``DataError``."""
    lines = list(keywords(text))
    first = next((line for line in lines if line[1] != "COMMENT"), lines[0])
    if first[1] != "CCSDS_TDM_VERS":
        raise not_tdm(first[1], file)
    check_version(first[2], "TDM", file)
    header: dict[str, str] = {}
    raw: list[RawSegment] = []
    part = "header"
    for number, key, value in lines:
        if (part, key) in (("header", "META_START"), ("between", "META_START")):
            part = "metadata"
            raw.append(RawSegment())
        elif (part, key) == ("metadata", "META_STOP"):
            part = "waiting"
        elif (part, key) == ("waiting", "DATA_START"):
            part = "data"
        elif (part, key) == ("data", "DATA_STOP"):
            part = "between"
        elif key == "COMMENT":
            if raw:
                raw[-1].comments.append(value)
        elif part == "header":
            header[key] = value
        elif part == "metadata":
            raw[-1].meta[key] = value
        elif part == "data":
            raw[-1].rows.append(observation(number, key, value, f"{file}, line {number}"))
        else:
            raise DataError(
                f'{file}, line {number}: "{key}" is out of place',
                allowed="META_START, META_STOP, DATA_START, DATA_STOP in this order",
            )
    if part not in ("between", "header"):
        raise DataError(f"{file} ends within its {part}", do="it is cut short: fetch it again")
    check_filled(raw, file)
    return header, raw


def not_tdm(begin: str, file: str) -> DataError:
    """Return the error for a file of another kind."""
    return DataError(
        f'{file} is not a TDM in KVN or XML: it begins "{begin[:30]}"',
        allowed="a first line CCSDS_TDM_VERS = 2.0, or XML with <tdm> in it",
        do="read orbits with unmodeled.read_trajectory",
    )


def check_filled(raw: list[RawSegment], file: str) -> None:
    """Refuse a message without segments, or with one that has no observations."""
    if not raw or not all(r.rows for r in raw):
        raise DataError(f"{file} has no observations in a segment", do="fetch the file again")


def observation(number: int, key: str, value: str, where: str) -> tuple[int, str, str, float]:
    """Read date and number of one observation; ``where`` is its place, for errors."""
    words = value.split()
    try:
        epoch, text = words
        reading = float(text)
        if not math.isfinite(reading):
            raise ValueError
    except ValueError as exc:
        raise DataError(
            f'{where}: "{key} = {value}" is cut short or not a finite number',
            allowed="KEYWORD = date number",
            do="remove or repair this observation",
        ) from exc
    return number, key, epoch, reading


def meaning(keyword: str, meta: dict[str, str], where: str) -> tuple[str, float, str] | None:
    """Kind, factor to the unit and unit of a data keyword; None if it is unknown.

    Parameters
    ----------
    keyword : str
        Such as ``"ANGLE_1"``.
    meta : dict
        The segment's metadata, which decides what angles and ranges mean.
    where : str
        File and line, for errors.

    Raises
    ------
    DataError
        If the metadata leave the meaning open: no or an unknown ANGLE_TYPE, right ascensions
        without REFERENCE_FRAME, ranges in range units.
    """
    if keyword in ("ANGLE_1", "ANGLE_2"):
        kind = meta.get("ANGLE_TYPE", "").upper()
        if kind not in ANGLES:
            raise DataError(f'{where}: ANGLE_TYPE is "{kind}"', allowed=", ".join(ANGLES))
        if kind == "RADEC" and not meta.get("REFERENCE_FRAME"):
            raise DataError(
                f"{where}: right ascensions without REFERENCE_FRAME",
                allowed="such as EME2000",
                do="ask the producer which equator and equinox are meant",
            )
        return ANGLES[kind][int(keyword[-1]) - 1], _DEGREE, "rad"
    if keyword == "RANGE":
        unit = meta.get("RANGE_UNITS", "km")
        if unit.lower() not in _RANGE:
            raise DataError(
                f'{where}: RANGE_UNITS is "{unit}"',
                allowed="km, s; a range unit (RU) depends on the station's ranging code",
                do="have the producer convert the ranges",
            )
        return "range", _RANGE[unit.lower()], "m"
    stem, _, number = keyword.rpartition("_")
    if number.isdigit() and stem in ("TRANSMIT_FREQ", "RECEIVE_FREQ"):
        kind, factor, unit = _KNOWN[stem]
        return f"{kind}_{number}", factor, unit
    return _KNOWN.get(keyword)


def path_words(meta: dict[str, str], where: str) -> str:
    """Write the signal's path with the participants' names, ``"A > B > A"``.

    A single difference is the second path minus the first.

    Raises
    ------
    DataError
        If a path names a participant that the metadata do not.
    """
    one, two = (_path(meta, key, where) for key in ("PATH_1", "PATH_2"))
    return f"({two}) - ({one})" if one and two else _path(meta, "PATH", where)


def _path(meta: dict[str, str], key: str, where: str) -> str:
    names = []
    for number in meta.get(key, "").replace(" ", "").split(","):
        name = meta.get(f"PARTICIPANT_{number}")
        if number and name is None:
            raise DataError(
                f'{where}: {key} = "{meta[key]}" names participant {number}, which is missing',
                allowed=", ".join(k for k in meta if k.startswith("PARTICIPANT_")),
            )
        names.append(name or "")
    return " > ".join(names)
