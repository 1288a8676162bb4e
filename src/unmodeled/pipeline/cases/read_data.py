"""The measurement files of a case, along the axes of its forces."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.station import Station
from unmodeled.pipeline.cases.case_config import CaseConfig, StationConfig, parse_vector
from unmodeled.pipeline.cases.quantities import parse_quantity
from unmodeled.pipeline.cases.surroundings import Surroundings

__all__ = ["read_data", "stations_of"]


def read_data(
    config: CaseConfig, around: Surroundings, folders: Sequence[Path]
) -> tuple[Measurements, ...]:
    """Read all files. (Waits for measurement_files.)"""
    raise NotImplementedError


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
