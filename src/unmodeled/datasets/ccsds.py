"""What CCSDS messages share: bytes of a file, lines of keywords, epochs, XML read safely.

Navigation data messages come as lines ``KEYWORD = value`` (KVN) or as XML, with the same keywords
[CCSDS502, CCSDS503].  An epoch is a calendar date or a year and a day of it; its time scale is the
message's TIME_SYSTEM, and a final ``Z`` means UTC.
"""

from __future__ import annotations

import calendar
import gzip
import re
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.parsers import expat

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, nearest
from unmodeled.core.time import TIME_SCALES, elapsed_from_calendar

__all__ = [
    "check_version",
    "elapsed",
    "keywords",
    "read_text",
    "required",
    "time_system",
    "xml_root",
]

_EPOCH = re.compile(
    r"(\d{4})-(?:(\d{2})-(\d{2})|(\d{3}))T(\d{2}):(\d{2}):(\d{2}(?:\.\d*)?)(Z?)", re.ASCII
)
_VERSIONS = ("1.0", "2.0", "3.0")


def read_text(path: Path) -> str:
    """Return the text of a file, plain or gzipped.

    Raises
    ------
    DataError
        If it is missing, empty or damaged.
    """
    try:
        raw = path.read_bytes()
        if raw[:2] == b"\x1f\x8b":
            raw = gzip.decompress(raw)
        # Keywords and numbers are ASCII; a comment in another encoding does no harm.
        text = raw.decode("utf-8-sig", errors="replace")
    except FileNotFoundError as exc:
        raise DataError(f"there is no file {path}", do="check the path") from exc
    except (OSError, EOFError, zlib.error) as exc:
        raise DataError(f"{path.name} cannot be read ({exc})", do="fetch the file again") from exc
    if not text.strip():
        raise DataError(f"{path.name} is empty", do="fetch the file again")
    return text


def keywords(text: str) -> Iterator[tuple[int, str, str]]:
    r"""Yield number, keyword and value of every line that is not blank.

    A line without ``=`` is a keyword alone; a comment's keyword is ``COMMENT``.

    Examples
    --------
    >>> list(keywords("A = 1\n\nCOMMENT b = c\nMETA_START"))
    [(1, 'A', '1'), (3, 'COMMENT', 'b = c'), (4, 'META_START', '')]
    """
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if stripped == "COMMENT" or stripped.startswith("COMMENT "):
            yield number, "COMMENT", stripped[8:]
        elif stripped:
            key, _, value = stripped.partition("=")
            yield number, key.rstrip(), value.lstrip()


def check_version(version: str, message: str, file: str) -> str:
    """Return the version of a message (``"OEM"``, ``"TDM"``) if it can be read."""
    if version not in _VERSIONS:
        raise DataError(
            f'{file}: CCSDS_{message}_VERS is "{version}"', allowed=", ".join(_VERSIONS)
        )
    return version


def time_system(metadata: dict[str, str], file: str) -> str:
    """Return the TIME_SYSTEM of a metadata block if it is a scale of this package."""
    name = metadata["TIME_SYSTEM"].upper()
    if name not in TIME_SCALES:
        raise DataError(
            f'{file}: TIME_SYSTEM is "{metadata["TIME_SYSTEM"]}"',
            allowed=", ".join(TIME_SCALES),
            do="have the producer write one of these",
        )
    return name


def elapsed(
    epochs: Sequence[str], scale: str, places: Sequence[str], file: str
) -> tuple[str, Array]:
    """Turn CCSDS epochs into elapsed seconds.

    Parameters
    ----------
    epochs : sequence of str
        ``2022-02-11T12:00:00.000`` or ``2022-042T12:00:00.000``, with or without ``Z``.
    scale : str
        Their time scale.
    places : sequence of str
        Where each stands, such as ``"line 12"``, for errors.
    file : str
        Name of the file, for errors.

    Returns
    -------
    epoch : str
        The first one, with its scale.
    times : ndarray (n,)
        SI seconds since it.

    Raises
    ------
    DataError
        If an epoch cannot be read, does not exist, or ends in ``Z`` where the scale is not UTC.
    """
    rows = [_row(e, scale, f"{file}, {p}") for e, p in zip(epochs, places, strict=True)]
    try:
        return elapsed_from_calendar(np.array(rows, dtype=np.float64), scale)
    except DataError as exc:
        raise DataError(f"{file}: {exc.found}", allowed=exc.allowed, do=exc.do) from exc


def _row(text: str, scale: str, where: str) -> tuple[int, int, int, int, int, float]:
    found = _EPOCH.fullmatch(text)
    if found is None:
        raise DataError(
            f'{where}: epoch "{text}" cannot be read',
            allowed="2022-02-11T12:00:00.000 or 2022-042T12:00:00.000",
        )
    if found[8] and scale != "UTC":
        raise DataError(
            f'{where}: epoch "{text}" ends in Z, which means UTC, but TIME_SYSTEM is {scale}',
            do="ask the producer which one is meant",
        )
    year, hour, minute, second = int(found[1]), int(found[5]), int(found[6]), float(found[7])
    if found[4]:
        month, day = _month_and_day(year, int(found[4]))
    else:
        month, day = int(found[2]), int(found[3])
    in_year = year > 0 and 1 <= month <= 12
    exists = in_year and 1 <= day <= calendar.monthrange(year, month)[1]
    # A leap second ends a day of UTC.
    longest = 61 if scale == "UTC" and (hour, minute) == (23, 59) else 60
    if not (exists and hour < 24 and minute < 60 and second < longest):
        raise DataError(f'{where}: epoch "{text}" does not exist', do="check the file's producer")
    return year, month, day, hour, minute, second


def _month_and_day(year: int, day: int) -> tuple[int, int]:
    """Day of the year to month and day; month 13 where the year has no such day."""
    month = 1
    while year > 0 and month <= 12 and day > calendar.monthrange(year, month)[1]:
        day -= calendar.monthrange(year, month)[1]
        month += 1
    return month, day


def xml_root(text: str, file: str) -> ET.Element:
    """Parse XML that declares nothing; names lose their namespaces.

    A document type declaration is refused: without one there are no entities to expand, neither
    a billion of them nor one that names a file on this machine.

    Raises
    ------
    DataError
        If the XML is not well formed, or declares a document type.
    """

    def refuse(*_: object) -> None:
        raise DataError(
            f"{file} declares a document type or entities",
            allowed="plain XML",
            do="remove the <!DOCTYPE ...> if you trust the file",
        )

    # An encoding that the declaration names has been undone already.
    data = re.sub(r"^\s*<\?xml[^>]*\?>", "", text).encode()
    try:
        scout = expat.ParserCreate("utf-8")
        scout.StartDoctypeDeclHandler = refuse
        scout.EntityDeclHandler = refuse
        scout.Parse(data, True)
        root = ET.fromstring(data)
    except (ET.ParseError, expat.ExpatError) as exc:
        raise DataError(
            f"{file} is not well-formed XML ({exc})",
            do="it may be cut short: fetch the file again",
        ) from exc
    for element in root.iter():
        element.tag = str(element.tag).rpartition("}")[2]
    return root


def required(metadata: dict[str, str], names: Sequence[str], where: str) -> None:
    """Refuse a metadata block that lacks one of ``names``."""
    for name in names:
        if not metadata.get(name):
            raise DataError(
                f"{where}: {name} is missing",
                allowed=", ".join(names),
                do=nearest(name, [k for k in metadata if k] or names),
            )
