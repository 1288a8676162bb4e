"""Rows of measurements from tracking data messages: pairs of angles, stations, round trips."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.constants import SPEED_OF_LIGHT
from unmodeled.core.errors import DataError
from unmodeled.datasets.measurement_rows import Rows, frame_name
from unmodeled.datasets.tdm import TdmSegment, read_tdm

__all__ = ["tdm_rows"]

_PAIRS = {
    "right_ascension_declination": ("right_ascension", "declination"),
    "azimuth_elevation": ("azimuth", "elevation"),
}
_RANGING = ("range", "range_rate")
# Two dates of one observation differ by rounding only.
_SAME = 1e-6


def tdm_rows(
    path: Path,
    kind: str,
    stations: Collection[str],
    round_trip: bool | None,
    light_time: bool,
) -> tuple[list[Rows], dict[str, object]]:
    """Read the observations of one kind, a set a station, and notes.

    Parameters
    ----------
    path : Path
        The message, KVN or XML.
    kind : str
        A kind of measurement other than positions.
    stations : collection of str
        Names of known stations.
    round_trip : bool, optional
        For paths A > B > A: whether ranges and rates are of the whole way and must be halved.
    light_time : bool
        Whether light time will be modelled: times are then brought to reception.

    Raises
    ------
    DataError
        If the message cannot be read, has no such observations, names no known station (or
        several), leaves open whether a range is halved, has angles without their partner, an
        integrated range rate without its interval, or times that cannot be brought to reception.
    """
    data = read_tdm(path)
    sets: dict[tuple[str, int, str], list[tuple[Array, Array]]] = {}
    notes: dict[str, object] = {
        "format": f"CCSDS TDM {data.version}",
        "originator": data.originator,
    }
    for number, segment in enumerate(data.segments):
        table = data.observations[data.observations["segment"] == number]
        where = f"{path.name}, segment {number + 1}"
        times, values = _readings(table, segment, kind, where, notes)
        if len(times) == 0:
            continue
        station = _station(segment, stations, where)
        ways = _ways(segment, station, light_time, where)
        if kind in _RANGING and ways == 2:
            if round_trip is None:
                raise DataError(
                    f"{where}: path {segment.path}; a {kind} may be of the whole way or half of it",
                    allowed="round_trip=True (it is halved) or round_trip=False",
                    do="ask the producer: files differ",
                )
            values = values / 2 if round_trip else values
        if light_time and segment.timetag.upper().startswith("TRANSMIT"):
            if kind != "range":
                raise DataError(
                    f"{where}: {kind} tagged at transmission", allowed="tags of reception"
                )
            times = times + values[:, 0] * ways / SPEED_OF_LIGHT.value
            notes["times"] = "moved from transmission to reception by the range"
        if segment.corrections_applied:
            notes["corrections_applied"] = segment.corrections_applied
        frame = frame_name(segment.frame, where) if kind.startswith("right") else ""
        ways = ways if kind in _RANGING else 1
        sets.setdefault((station, ways, frame), []).append((times, values))
    if not sets:
        raise DataError(
            f"{path.name} has no {kind}",
            allowed=", ".join(dict.fromkeys(data.observations["kind"])),
            do="ask for a kind that is in the file",
        )
    found = []
    for (station, ways, frame), parts in sets.items():
        times, values = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.argsort(times, kind="stable")  # passes need not be in order
        found.append(Rows(data.epoch, times[order], values[order], None, frame, station, ways))
    return found, notes


def _readings(
    table: pd.DataFrame, segment: TdmSegment, kind: str, where: str, notes: dict[str, object]
) -> tuple[Array, Array]:
    if kind in _PAIRS:
        one, two = (_of(table, name) for name in _PAIRS[kind])
        same = len(one[0]) == len(two[0]) and np.all(np.abs(one[0] - two[0]) < _SAME)
        if not same:
            raise DataError(
                f"{where}: {len(one[0])} {_PAIRS[kind][0]}, {len(two[0])} {_PAIRS[kind][1]}, or "
                "at other times",
                allowed="both angles at each time",
                do="remove single angles",
            )
        return one[0], np.column_stack([one[1], two[1]])
    times, values = _of(table, kind)
    if kind == "range_rate" and len(times) == 0:
        times, values = _of(table, "range_rate_integrated")
        if len(times):
            times = times + _to_middle(segment, where)
            notes["range_rate"] = "integrated, taken as instantaneous at the interval's middle"
    return times, values[:, None]


def _of(table: pd.DataFrame, name: str) -> tuple[Array, Array]:
    chosen = table[table["kind"] == name]
    return chosen["time_s"].to_numpy(np.float64), chosen["value"].to_numpy(np.float64)


def _to_middle(segment: TdmSegment, where: str) -> float:
    """Seconds from the tag to the middle of the interval of integration."""
    text = segment.meta.get("INTEGRATION_INTERVAL", "")
    reference = segment.meta.get("INTEGRATION_REF", "").upper()
    share = {"START": 0.5, "MIDDLE": 0.0, "END": -0.5}.get(reference)
    try:
        interval = float(text.split()[0])
    except (ValueError, IndexError):
        interval = -1.0
    if share is None or not interval > 0:
        raise DataError(
            f'{where}: INTEGRATION_INTERVAL is "{text}", INTEGRATION_REF is "{reference}"',
            allowed="seconds, and START, MIDDLE or END",
        )
    return share * interval


def _station(segment: TdmSegment, stations: Collection[str], where: str) -> str:
    names = list(segment.participants.values())
    on_path = [n for n in dict.fromkeys(segment.path.split(" > ")) if n in names] or names
    found = [n for n in on_path if n in stations]
    receiver = segment.path.split(" > ")[-1] or names[0]
    if not found:
        raise DataError(
            f"{where}: none of its participants {', '.join(names)} is a known station",
            allowed=", ".join(stations) or "no stations were given",
            do=f'give stations={{"{receiver}": Station.from_geodetic(...)}}',
        )
    if len(found) > 1:
        raise DataError(f"{where}: path {segment.path} has {len(found)} stations", allowed="one")
    return found[0]


def _ways(segment: TdmSegment, station: str, light_time: bool, where: str) -> int:
    legs = segment.path.split(" > ") if segment.path else []
    if segment.path.startswith("(") or len(legs) > 3 or (len(legs) == 3 and legs[0] != legs[2]):
        raise DataError(
            f"{where}: path {segment.path} cannot be used", allowed="A > B, or A > B > A"
        )
    if light_time and (not legs or legs[-1] != station):
        raise DataError(
            f'{where}: path "{segment.path}" does not end at station {station}',
            allowed="signals that the station receives, where light time is modelled",
        )
    return 2 if len(legs) == 3 else 1
