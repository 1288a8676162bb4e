"""The measurement files of a case, along the axes of its forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.errors import ConfigError, DataError
from unmodeled.core.kernel_ephemeris import NAIF_NUMBERS
from unmodeled.datasets.measurement_files import MeasurementSet, read_measurements
from unmodeled.datasets.measurement_geometry import polar_angles
from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.spk import read_spk
from unmodeled.datasets.station import Station
from unmodeled.pipeline.cases.case_config import (
    CaseConfig,
    MeasurementConfig,
    StationConfig,
    parse_vector,
)
from unmodeled.pipeline.cases.cut_arcs import seconds_after
from unmodeled.pipeline.cases.quantities import parse_quantity
from unmodeled.pipeline.cases.surroundings import Surroundings

__all__ = ["read_data", "stations_of"]


_BODY_EQUATOR = "body_equator"
_DIRECTIONS = "right_ascension_declination"
_ORBITS = ("position", "position_velocity")


def read_data(
    config: CaseConfig, around: Surroundings, folders: Sequence[Path]
) -> tuple[Measurements, ...]:
    """Read all measurement files of a case.

    Parameters
    ----------
    config : CaseConfig
        Files, kinds, sigmas and stations.
    around : Surroundings
        Axes of the forces: positions are turned to them.
    folders : sequence of Path
        Where relative file names are looked for, in this order.

    Returns
    -------
    tuple of Measurements
        SI, seconds since the case's epoch.

    Raises
    ------
    ConfigError
        If a frame does not fit the kind or the body.
    DataError
        If a file is missing or wrong; see `read_measurements`.
    """
    stations = stations_of(config, around)
    sets: list[Measurements] = []
    for entry in config.measurements:
        path = _found(entry.file, folders)
        equatorial = entry.frame == _BODY_EQUATOR
        _check_frame(entry, around)
        if entry.is_kernel:
            sampled = _sampled(entry, path, config, around)
            sets += [_turned(m, around.frame_from_icrf) for m in sampled.measurements]
            continue
        read = read_measurements(
            path,
            entry.kind,
            sigma=None if entry.sigma_in_file else entry.sigmas(),
            epoch=config.epoch,
            stations=stations[entry.station] if entry.station else stations or None,
            satellite=entry.satellite,
            frame=None if equatorial else entry.frame,
            time_scale=entry.time_scale,
            label=entry.label,
            every=entry.every,
            start=None if entry.start is None else _moment(entry.start, config, entry),
            end=None if entry.end is None else _moment(entry.end, config, entry),
            light_time=entry.light_time,
            gm=around.body.gm if entry.light_time else 0.0,
            astrometric=entry.astrometric,
            round_trip=entry.round_trip,
        )
        in_axes = entry.kind in (*_ORBITS, _DIRECTIONS)
        turn = around.frame_from_icrf if in_axes and not equatorial else np.eye(3)
        if equatorial and around.frame != _BODY_EQUATOR:
            turn = around.body.pole_matrix().T
        sets += [_turned(m, turn) for m in read.measurements]
    return tuple(sets)


def _sampled(
    entry: MeasurementConfig, path: Path, config: CaseConfig, around: Surroundings
) -> MeasurementSet:
    """Read a kernel where the case says; its centre must be the body of the case."""
    if entry.target is None or entry.center is None:
        raise ConfigError(f"{entry.file}: target or center is not stated")  # checked before
    numbers = NAIF_NUMBERS.get(around.body.name)
    if numbers is not None and entry.center not in numbers:
        raise ConfigError(
            f"center of {entry.file} is {entry.center}, and the body is {around.body.name}",
            allowed=" or ".join(str(n) for n in numbers),
        )
    if entry.light_time:
        raise ConfigError(
            f"{entry.file} ({entry.kind}) has no light time in it", do='drop the key "light_time"'
        )
    if entry.sigma_in_file:
        raise ConfigError(
            f"sigma of {entry.file} is file, and a kernel states none", do="state a number"
        )
    return read_spk(
        path,
        entry.kind,
        target=entry.target,
        center=entry.center,
        sigma=entry.sigmas(),
        start=_moment(entry.start, config, entry),
        end=_moment(entry.end, config, entry),
        step=parse_quantity(entry.step, "s", f"step of {entry.file}"),
        epoch=config.epoch,
        label=entry.label,
    )


def _check_frame(entry: MeasurementConfig, around: Surroundings) -> None:
    where = f"{entry.file} ({entry.kind})"
    if entry.kind == _DIRECTIONS and entry.astrometric and around.frame != "icrf":
        raise ConfigError(
            f"{where}, reduced against stars, in a case whose frame is {around.frame}",
            allowed="astrometric: true with frame: icrf only (observers on the Earth)",
        )
    if entry.frame is None:
        return
    if entry.kind not in (*_ORBITS, _DIRECTIONS):
        raise ConfigError(f"{where} has no frame", do='drop the key "frame"')
    if entry.kind == _DIRECTIONS and entry.frame.upper() in ("ITRF", "ITRS"):
        raise ConfigError(
            f"frame of {where} is {entry.frame}",
            allowed="ICRF, EME2000 (23 mas from it), body_equator",
            do="turn right ascensions along axes of date, or Earth-fixed ones, to ICRF first",
        )
    if entry.frame.upper() in ("ITRF", "ITRS") and around.body.name != "earth":
        raise ConfigError(
            f"frame of {where} is {entry.frame}, and the body is {around.body.name}",
            allowed="ICRF, EME2000, body_equator",
        )


def _found(name: str, folders: Sequence[Path]) -> Path:
    path = Path(name)
    tried = [path] if path.is_absolute() else [folder / path for folder in folders]
    for candidate in tried:
        if candidate.exists():
            return candidate
    raise DataError(
        f"there is no measurement file {name}",
        allowed="looked for as " + ", ".join(str(t) for t in tried),
        do="check the path, or name the folder of the data",
    )


def _moment(given: object, config: CaseConfig, entry: MeasurementConfig) -> float:
    return seconds_after(given, config.epoch, f"start or end of {entry.file}")


def _turned(m: Measurements, turn: Array) -> Measurements:
    """Positions or directions along other axes; noise that is not the same on all is refused."""
    if np.array_equal(turn, np.eye(3)):
        return m
    if m.kind == _DIRECTIONS:
        return _turned_directions(m, turn)
    groups = m.sigmas.reshape(len(m.times), -1, 3)
    if np.any(groups != groups[:, :, :1]):
        raise DataError(
            f"{m.label}: sigma differs between the axes, and the axes are turned",
            allowed="one sigma for all three",
            do="give the positions along the axes of the case's frame",
        )
    values = m.values.reshape(len(m.times), -1, 3) @ turn.T
    return replace(m, values=values.reshape(m.values.shape))


def _turned_directions(m: Measurements, turn: Array) -> Measurements:
    if np.any(m.sigmas[:, 0] != m.sigmas[:, 1]):
        raise DataError(
            f"{m.label}: sigma differs between right ascension and declination, and the axes are "
            "turned",
            allowed="one sigma for both, along the great circle",
            do="use a case with frame: icrf",
        )
    a, d = m.values.T
    lines = np.stack([np.cos(a) * np.cos(d), np.sin(a) * np.cos(d), np.sin(d)], axis=1)
    return replace(m, values=polar_angles(lines @ turn.T))


def stations_of(config: CaseConfig, around: Surroundings) -> dict[str, Station]:
    """Return the stations of a case.

    Raises
    ------
    ConfigError
        If a coordinate has a wrong unit.
    """
    return {name: _station(name, s, around) for name, s in config.stations.items()}


def _station(name: str, given: StationConfig, around: Surroundings) -> Station:
    where = f"stations.{name}"
    rotation = around.rotation()
    if given.xyz is not None:
        return Station(name, np.array(parse_vector(given.xyz, "m", f"{where}.xyz")), rotation)
    latitude = parse_quantity(given.latitude, "rad", f"{where}.latitude")
    longitude = parse_quantity(given.longitude, "rad", f"{where}.longitude")
    height = parse_quantity(given.height, "m", f"{where}.height")
    if rotation is None:
        return Station.from_geodetic(name, np.degrees(latitude), np.degrees(longitude), height)
    # Other bodies: a sphere of the reference radius.
    r = around.body.reference_radius + height
    c = np.cos(latitude)
    place = np.array([c * np.cos(longitude), c * np.sin(longitude), np.sin(latitude)])
    return Station(name, r * place, rotation)
