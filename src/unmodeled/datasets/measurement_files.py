"""One door to every file of measurements: orbits as measurements, ranges, rates and angles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, check_increasing
from unmodeled.core.errors import ConfigError, DataError, nearest
from unmodeled.core.time import check_scale, parse_epoch, seconds_between
from unmodeled.datasets.measurement_csv import read_measurement_table
from unmodeled.datasets.measurement_geometry import polar_angles
from unmodeled.datasets.measurement_rows import Rows, frame_name, from_icrf, to_icrf
from unmodeled.datasets.measurement_tdm import tdm_rows
from unmodeled.datasets.measurements import Kind, Measurements
from unmodeled.datasets.oem import read_oem
from unmodeled.datasets.sp3_format import read_sp3_table
from unmodeled.datasets.station import Station

__all__ = ["MeasurementSet", "read_measurements"]

_POSITIONS = ("position", "position_velocity")
_TABLES = (".csv", ".parquet")
_SP3, _OEM, _TDM = (".sp3", ".eph"), (".oem",), (".tdm",)
_EITHER = (".kvn", ".xml", ".txt")
_SUFFIXES = (*_TABLES, *_SP3, *_OEM, *_TDM, *_EITHER, ".bsp")


@dataclass(frozen=True)
class MeasurementSet:
    """What one file measured.

    Parameters
    ----------
    measurements : tuple of Measurements
        One for each station; SI seconds since ``epoch``, inertial axes (ICRF).
    epoch : str
        Date of time zero with its scale; empty if neither file nor caller has one.
    source : str
        Name of the file.
    notes : dict
        Facts about the file and about what was done to it.
    """

    measurements: tuple[Measurements, ...]
    epoch: str
    source: str
    notes: dict[str, object] = field(default_factory=dict)

    def __len__(self) -> int:
        return sum(len(m.times) for m in self.measurements)


def read_measurements(
    path: str | Path,
    kind: str,
    *,
    sigma: npt.ArrayLike | None,
    epoch: str | None = None,
    stations: Station | Mapping[str, Station] | None = None,
    satellite: str | None = None,
    frame: str | None = None,
    time_scale: str | None = None,
    label: str | None = None,
    every: int = 1,
    start: str | float | None = None,
    end: str | float | None = None,
    light_time: bool = False,
    gm: float = 0.0,
    astrometric: bool = False,
    round_trip: bool | None = None,
) -> MeasurementSet:
    """Read the measurements of one kind from a file.

    Files: positions and states from OEM (KVN, XML: .oem, .kvn, .xml, .txt) and SP3 (.sp3, .eph);
    ranges, range rates and angles from TDM (.tdm, .kvn, .xml, .txt); any kind from .csv and
    .parquet (:mod:`unmodeled.datasets.measurement_csv`). OEM, SP3 and TDM also gzipped. For SPK
    kernels see :func:`unmodeled.datasets.spk.read_spk`.

    Parameters
    ----------
    path : str or Path
        The file.
    kind : str
        See `Measurements`. It decides what is read: ``"position"`` ignores velocities.
    sigma : array_like or None
        Standard deviation, as in `Measurements`. None only where the file's own columns state it.
    epoch : str, optional
        Time zero of the result, with its scale; the file's first epoch by default. A table whose
        ``t_s`` has no epoch counts from this one.
    stations : Station or mapping of str to Station, optional
        By the names that the file uses. A single station is taken where the file names none.
    satellite : str, optional
        Where an OEM or SP3 file has several.
    frame, time_scale : str, optional
        What the file's axes (ICRF, EME2000, ITRF) and dates *are*, if the file says otherwise.
        A scale replaced in this way is not right across a leap second.
    label : str, optional
        Name in tables; the file's by default, with the station's where there are several.
    every : int
        Take each ``every``-th measurement of a station.
    start, end : str or float, optional
        First and last moment: a date with its scale, or seconds since the result's epoch.
    light_time, gm, astrometric
        As in `Measurements`.
    round_trip : bool, optional
        TDM with path A > B > A: whether the file's numbers are of the whole way (they are halved).

    Returns
    -------
    MeasurementSet
        Elapsed SI seconds whatever the file's time scale, values along ICRF axes; positions that
        were given Earth-fixed have ``axes="earth_fixed"``.

    Raises
    ------
    ConfigError
        On an unknown kind or an option that this file cannot have.
    DataError
        If the file is missing, empty, cut short or malformed, does not hold this kind, states no
        sigma (or two), names a station that is not given, or nothing lies within start and end.
    """
    path = Path(path)
    _check_options(kind, every)
    known = {stations.name: stations} if isinstance(stations, Station) else dict(stations or {})
    rows, notes = _read(path, kind, satellite, known, round_trip, light_time)
    if time_scale is not None or frame is not None:
        rows = [_overridden(r, kind, frame, time_scale, path.name, notes) for r in rows]
    zero = epoch or rows[0].epoch
    if zero:
        parse_epoch(zero)
    if not rows[0].epoch:
        notes["epoch"] = "the file has none" + (
            ": its times count from the caller's" if zero else ""
        )
    several = len({r.station for r in rows}) > 1
    found = []
    for r in rows:
        name = label or path.name
        name = f"{name}, {r.station}" if several else name
        station = _station(r, kind, known, stations, path.name)
        check_increasing(r.times, f"{name}: time")
        noise = _sigma(r, sigma, name)
        values, frame_given = _inertial(r, kind, zero, name)
        times = r.times + (seconds_between(zero, r.epoch) if r.epoch and r.epoch != zero else 0.0)
        keep = _window(times, zero, start, end, every, name)
        found.append(
            Measurements(
                cast(Kind, kind),
                times[keep],
                values[keep],
                noise[keep] if np.shape(noise) == values.shape else noise,
                name,
                station=station,
                epoch=zero,
                light_time=light_time,
                gm=gm,
                ways=r.ways if kind in ("range", "range_rate") else 1,
                astrometric=astrometric,
                axes="earth_fixed" if frame_given == "ITRF" and kind in _POSITIONS else "inertial",
            )
        )
    below = sum(m.below_horizon for m in found)
    if below:
        notes["below_horizon"] = f"{below} elevations below zero"
    return MeasurementSet(tuple(found), zero, path.name, notes)


def _check_options(kind: str, every: int) -> None:
    if kind not in get_args(Kind):
        raise ConfigError(
            f'kind is "{kind}"',
            allowed=", ".join(get_args(Kind)),
            do=nearest(kind, get_args(Kind)),
        )
    if not (isinstance(every, int) and every >= 1):
        raise ConfigError(f"every is {every}", allowed="a whole number >= 1")


def _read(
    path: Path,
    kind: str,
    satellite: str | None,
    stations: Mapping[str, Station],
    round_trip: bool | None,
    light_time: bool,
) -> tuple[list[Rows], dict[str, object]]:
    suffixes = [s.lower() for s in path.suffixes]
    suffix = ([s for s in suffixes[-2:] if s != ".gz"] or [""])[-1]
    if suffix == ".bsp":
        raise ConfigError(
            f"{path.name} is an SPK kernel: it has no times of its own",
            do="use unmodeled.datasets.spk.read_spk with a step; in a case file, give target, "
            "center, start, end and step",
        )
    if suffix not in _SUFFIXES:
        raise DataError(
            f'{path.name} has suffix "{suffix}"',
            allowed=", ".join(_SUFFIXES),
            do=nearest(suffix, _SUFFIXES),
        )
    if suffix in _TABLES:
        return read_measurement_table(path, kind), {"format": suffix[1:].upper()}
    orbit, name = kind in _POSITIONS, path.name
    if orbit and suffix in _TDM:
        raise DataError(f"{name} is tracking data, not {kind}", allowed="ranges and angles")
    if not orbit and suffix in (*_SP3, *_OEM):
        raise DataError(f"{name} is an orbit file, not {kind}", allowed=", ".join(_POSITIONS))
    if not orbit:
        return tdm_rows(path, kind, stations, round_trip, light_time)
    if suffix in _SP3:
        return _sp3(path, kind, satellite)
    return _oem(path, kind, satellite)


def _sp3(path: Path, kind: str, satellite: str | None) -> tuple[list[Rows], dict[str, object]]:
    table = read_sp3_table(path, satellite)
    values = table.positions
    if kind == "position_velocity":
        if table.velocities is None:
            raise DataError(
                f"{path.name} has positions only, not {kind}",
                allowed="position",
                do="smoothed velocities are no measurements",
            )
        values = np.hstack([table.positions, table.velocities])
    return [Rows(table.epoch, table.times, values, frame="ITRF")], dict(table.notes)


def _oem(path: Path, kind: str, satellite: str | None) -> tuple[list[Rows], dict[str, object]]:
    orbit = read_oem(path, satellite=satellite, accelerations=False)
    values = orbit.states if kind == "position_velocity" else orbit.positions
    frame = frame_name(str(orbit.notes["frame_in_file"]), path.name)
    # Back to the file's axes, so that all files go the same way from here (rounding only).
    values = from_icrf(frame, orbit.epoch, orbit.times, values)
    return [Rows(orbit.epoch, orbit.times, values, frame=frame)], dict(orbit.notes)


def _overridden(
    r: Rows,
    kind: str,
    frame: str | None,
    time_scale: str | None,
    file: str,
    notes: dict[str, object],
) -> Rows:
    changed: dict[str, Any] = {}
    if time_scale is not None:
        scale = check_scale(time_scale)
        if not r.epoch:
            raise ConfigError(f"{file} has no epoch: time_scale={scale} has nothing to act on")
        changed["epoch"] = f"{r.epoch.rsplit(' ', 1)[0]} {scale}"
        notes["time_scale"] = f"{scale} by the caller, {r.epoch.rsplit(' ', 1)[1]} in the file"
    if frame is not None:
        if not r.frame:
            raise ConfigError(f"{file}: {kind} has no frame to be replaced")
        changed["frame"] = frame_name(frame, "frame")
        notes["frame"] = f"{changed['frame']} by the caller, {r.frame} in the file"
    return Rows(**(vars(r) | changed))


def _station(
    r: Rows,
    kind: str,
    known: Mapping[str, Station],
    given: Station | Mapping[str, Station] | None,
    file: str,
) -> Station | None:
    if kind in _POSITIONS:
        return None
    if r.station:
        if r.station not in known:
            raise DataError(
                f'{file}: station "{r.station}" is not given',
                allowed=", ".join(known) or "no stations were given",
                do=f'give stations={{"{r.station}": Station.from_geodetic(...)}}',
            )
        return known[r.station]
    if len(known) == 1:
        return next(iter(known.values()))
    if given is None and kind == "right_ascension_declination":
        return None  # from the body's centre
    raise DataError(
        f"{file} names no station, and {len(known)} were given",
        allowed="one station, or a column station",
        do="give stations=Station.from_geodetic(...)",
    )


def _sigma(r: Rows, sigma: npt.ArrayLike | None, name: str) -> Array:
    if sigma is not None and r.sigma is not None:
        raise DataError(
            f"{name}: sigma is stated twice, by the caller and by the file's columns",
            do="give sigma=None to use the file's",
        )
    if sigma is None and r.sigma is None:
        raise DataError(
            f"{name}: sigma is not stated",
            allowed="standard deviations in SI, by the caller or in the file's columns sigma_...",
            do="state the noise: the fit weighs data by it",
        )
    return np.asarray(r.sigma if sigma is None else sigma, dtype=np.float64)


def _inertial(r: Rows, kind: str, zero: str, name: str) -> tuple[Array, str]:
    """Values along ICRF axes, and the frame that they were given in."""
    if kind in _POSITIONS:
        epoch = r.epoch or zero
        if r.frame == "ITRF" and not epoch:
            raise DataError(
                f"{name}: the Earth's orientation needs the date of time zero",
                do='give epoch="2016-03-13T00:00:00 UTC" or the like',
            )
        return to_icrf(r.frame, epoch, r.times, r.values), r.frame
    if kind != "right_ascension_declination" or r.frame == "ICRF":
        return r.values, r.frame
    if r.frame != "EME2000":
        raise DataError(f"{name}: right ascensions along {r.frame}", allowed="ICRF, EME2000")
    ra, dec = r.values.T
    line = np.stack([np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)], axis=1)
    return polar_angles(to_icrf("EME2000", r.epoch, r.times, line)), r.frame


def _window(
    times: Array,
    zero: str,
    start: str | float | None,
    end: str | float | None,
    every: int,
    name: str,
) -> npt.NDArray[np.intp]:
    low, high = (
        default if t is None else _moment(t, zero, name)
        for t, default in ((start, -np.inf), (end, np.inf))
    )
    keep = np.flatnonzero((times >= low) & (times <= high))[::every]
    if len(keep) == 0:
        span = f"{times[0]:.6g} to {times[-1]:.6g} s after {zero or 'time zero'}"
        raise DataError(f"{name}: no measurements between {low:.6g} and {high:.6g} s", allowed=span)
    return keep


def _moment(moment: str | float, zero: str, name: str) -> float:
    if not isinstance(moment, str):
        return float(moment)
    if not zero:
        raise DataError(
            f'{name} has no epoch: "{moment}" cannot be placed', do="give epoch, or seconds"
        )
    return seconds_between(zero, moment)
