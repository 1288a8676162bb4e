"""The text of SP3 files: from lines to one satellite's table, Earth-fixed, in SI.

See :mod:`unmodeled.datasets.sp3` for what the format means and what is repaired.
"""

from __future__ import annotations

import datetime
import gzip
import warnings
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import DataError, UnmodeledWarning, nearest
from unmodeled.core.time import elapsed_from_calendar

__all__ = ["Sp3Table", "read_sp3_table"]

# Offset to add to the file's clock to get one of our scales.  Galileo and QZSS time follow GPS
# time within nanoseconds; BeiDou time is 14 s behind it; GLONASS files are tagged in UTC.
_SYSTEMS = {
    "GPS": ("GPS", 0.0),
    "GAL": ("GPS", 0.0),
    "QZS": ("GPS", 0.0),
    "IRN": ("GPS", 0.0),
    "BDT": ("GPS", 14.0),
    "UTC": ("UTC", 0.0),
    "GLO": ("UTC", 0.0),
    "TAI": ("TAI", 0.0),
    "CCC": ("GPS", 0.0),
}
_ABSENT = 999_999.0


@dataclass(frozen=True)
class Sp3Table:
    """One satellite's records as the file has them, in SI and Earth-fixed axes.

    Parameters
    ----------
    epoch : str
        The first record's date with its scale.
    times : ndarray (n,)
        SI seconds since it.
    positions : ndarray (n, 3)
        Metres, ITRF.
    velocities : ndarray (n, 3) or None
        m/s relative to the rotating Earth; None for a file of positions.
    satellite : str
        Identifier.
    notes : dict
        Version, agency, frame, time system, and what had to be repaired.
    """

    epoch: str
    times: Array
    positions: Array
    velocities: Array | None
    satellite: str
    notes: dict[str, object] = field(default_factory=dict)


def read_sp3_table(path: str | Path, satellite: str | None = None) -> Sp3Table:
    """Read one satellite's records, Earth-fixed, without turning or smoothing them.

    Parameters
    ----------
    path, satellite
        As in :func:`read_sp3`.

    Raises
    ------
    DataError
        As in :func:`read_sp3`.
    """
    name = Path(path).name
    lines = _lines(Path(path))
    header, body = _header(lines, name)
    chosen = _choose(header.satellites, satellite, name)
    records = _records(lines[body:], body, chosen, header, name)
    calendar = np.array([r[0] for r in records], dtype=np.float64)
    scale, shift = _SYSTEMS[header.system]
    if shift:
        calendar = _shifted(calendar, shift)
    epoch, times = elapsed_from_calendar(calendar, scale)
    values = np.array([r[1] for r in records], dtype=np.float64)
    velocities = values[:, 3:] * 0.1 if values.shape[1] == 6 else None
    positions = values[:, :3] * 1e3
    notes = header.notes
    if velocities is not None:
        velocities = _checked_velocities(times, positions, velocities, notes, name)
    return Sp3Table(epoch, times, positions, velocities, chosen, {**notes, "satellite": chosen})


@dataclass
class _Header:
    version: str = ""
    mode: str = ""
    promised: int = 0
    system: str = "CCC"
    satellites: list[str] = field(default_factory=list)
    notes: dict[str, object] = field(default_factory=dict)


def _lines(path: Path) -> list[str]:
    try:
        raw = path.read_bytes()
        if raw[:2] == b"\x1f\x8b":
            raw = gzip.decompress(raw)
    except FileNotFoundError as exc:
        raise DataError(f"there is no file {path}", do="check the path") from exc
    except (OSError, EOFError, zlib.error) as exc:
        raise DataError(f"{path.name} cannot be read ({exc})", do="fetch the file again") from exc
    if not raw.strip():
        raise DataError(f"{path.name} is empty", do="fetch the file again")
    return raw.decode("ascii", errors="replace").splitlines()


def _header(lines: list[str], name: str) -> tuple[_Header, int]:
    first = lines[0]
    if len(first) < 40 or first[0] != "#" or first[1] not in "abcd" or first[2] not in "PV":
        raise DataError(
            f'{name} is not an SP3 file: it begins "{first[:20]}"',
            allowed='a first line like "#cV2016  3 13 ...", version a to d, P or V',
        )
    head = _Header(first[1], first[2])
    promised = first[32:39].strip()
    head.promised = int(promised) if promised.isdigit() else 0
    seen = False
    for number, line in enumerate(lines):  # noqa: B007 - returned: where the records begin
        if line.startswith("+ "):
            # Fixed columns: identifiers of three characters from column 10; blanks mean GPS.
            labels = [line[k : k + 3] for k in range(9, min(len(line), 60), 3)]
            head.satellites += [_label(w) for w in labels if w.strip() not in ("", "0", "00")]
        elif line.startswith("%c") and not seen:
            seen = True
            system = line.split()[3].upper() if len(line.split()) > 3 else "CCC"
            if system not in _SYSTEMS:
                raise DataError(
                    f'{name} has time system "{system}"',
                    allowed=", ".join(sorted(_SYSTEMS)),
                    do=nearest(system, _SYSTEMS),
                )
            head.system = system
        elif line.startswith("*"):
            break
    else:
        raise DataError(f"{name} ends within its header", do="fetch the file again")
    head.notes = {
        "format": f"SP3-{head.version}",
        "agency": first[56:60].strip(),
        "earth_frame": first[46:51].strip(),
        "time_system": "GPS" if head.system == "CCC" else head.system,
    }
    return head, number


def _label(word: str) -> str:
    """``"  1"`` and ``"G 1"`` both become ``"G01"``."""
    letter, digits = (word[0], word[1:]) if word[0].isalpha() else ("G", word)
    return letter.upper() + digits.strip().zfill(2)


def _choose(known: list[str], wanted: str | None, name: str) -> str:
    if not known:
        raise DataError(f"{name} lists no satellites", do="fetch the file again")
    if wanted is None:
        if len(known) > 1:
            raise DataError(
                f"{name} has {len(known)} satellites",
                allowed=", ".join(known),
                do="choose one with the option satellite",
            )
        return known[0]
    label = _label(wanted.strip().rjust(3) if wanted.strip().isdigit() else wanted.strip())
    if label not in known:
        raise DataError(f'{name} has no satellite "{wanted}"', do=nearest(label, known))
    return label


_Record = tuple[tuple[float, ...], list[float]]


def _records(
    lines: list[str], offset: int, satellite: str, header: _Header, name: str
) -> list[_Record]:
    records: list[_Record] = []
    absent = epochs = 0
    when: tuple[float, ...] = ()
    position: list[float] | None = None
    ended = False
    for number, line in enumerate(lines, start=offset + 1):
        mark = line[:1]
        if mark == "*":
            when, position = _when(line, number, name), None
            epochs += 1
        elif line.startswith("EOF"):
            ended = True
            break
        elif mark in ("P", "V") and len(line) > 3 and _label(line[1:4]) == satellite:
            values = _numbers(line, number, name)
            if mark == "P":
                position = values if any(values) else None
                absent += position is None
                if position and header.mode == "P":
                    records.append((when, position))
            elif position is not None:
                if any(values) and max(map(abs, values)) < _ABSENT:
                    records.append((when, position + values))
                else:
                    absent += 1
                position = None
    if not ended and epochs < header.promised:
        raise DataError(
            f"{name} is cut short: it has {epochs} of {header.promised} epochs and no EOF line",
            do="fetch the file again",
        )
    if not records:
        raise DataError(f"{name} has no usable record of satellite {satellite}")
    header.notes["samples_absent"] = absent
    return records


def _when(line: str, number: int, name: str) -> tuple[float, ...]:
    try:
        year, month, day, hour, minute = (int(w) for w in line[1:].split()[:5])
        second = float(line.split()[-1])
        if len(line[1:].split()) != 6:
            raise ValueError
        # Real files carry "0 60" for "1  0"; a 60th second stays, it may be a leap second.
        start = datetime.datetime(year, month, day) + datetime.timedelta(hours=hour, minutes=minute)
    except (ValueError, OverflowError) as exc:
        raise DataError(
            f'{name}, line {number}: epoch "{line.strip()}" cannot be read',
            allowed="* year month day hour minute second",
            do="fetch the file again",
        ) from exc
    return (start.year, start.month, start.day, start.hour, start.minute, second)


def _numbers(line: str, number: int, name: str) -> list[float]:
    try:
        # Fixed columns of 14: two long numbers may touch.
        values = [float(line[k : k + 14]) for k in (4, 18, 32)]
        if len(line.rstrip()) < 46 or not np.all(np.isfinite(values)):
            raise ValueError
    except ValueError as exc:
        raise DataError(
            f'{name}, line {number}: record "{line.strip()}" is cut short or not numeric',
            allowed="three numbers of 14 columns",
            do="fetch the file again",
        ) from exc
    return values


def _shifted(calendar: Array, seconds: float) -> Array:
    rows = []
    for year, month, day, hour, minute, second in calendar:
        moved = datetime.datetime(
            int(year), int(month), int(day), int(hour), int(minute)
        ) + datetime.timedelta(minutes=float((second + seconds) // 60))
        rest = (second + seconds) % 60
        rows.append([moved.year, moved.month, moved.day, moved.hour, moved.minute, rest])
    return np.array(rows)


def _checked_velocities(
    times: Array, positions: Array, velocities: Array, notes: dict[str, object], name: str
) -> Array:
    """Compare with central differences; put a factor of ten right, refuse anything else."""
    if len(times) < 3:
        return velocities
    step = (times[2:] - times[:-2])[:, None]
    rough = (positions[2:] - positions[:-2]) / step
    middle = velocities[1:-1]
    ratio = float(np.median(np.sum(rough * middle, axis=1) / np.sum(middle**2, axis=1)))
    if abs(ratio - 1) < 0.2:
        return velocities
    if abs(ratio / 10 - 1) < 0.2:
        warnings.warn(
            f"{name} gives velocities in m/s where SP3 says dm/s; read as m/s",
            UnmodeledWarning,
            stacklevel=4,
        )
        notes["velocity_unit"] = "m/s (the file breaks the format, which says dm/s)"
        return velocities * 10
    raise DataError(
        f"{name}: velocities do not fit the positions (their differences are {ratio:.3g} times "
        "as large)",
        allowed="Earth-fixed velocities in dm/s",
        do="check the file's producer",
    )
