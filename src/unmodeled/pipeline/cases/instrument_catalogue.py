"""What instruments, clocks, stations and bookkeeping may have done to the measurements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodeled.datasets.measurement_effects import (
    AngleBias,
    AntennaOffset,
    ClockDrift,
    FrameRotation,
    LightTime,
    MeasurementEffect,
    RangeBias,
    RangeRateBias,
    Refraction,
    RelativisticDelay,
    StationPosition,
    TimeTag,
    Troposphere,
)
from unmodeled.datasets.measurements import Measurements
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.fit_problem import Arc

__all__ = ["instrument_candidates"]

_OF_STATION = (StationPosition, Troposphere, Refraction)
#: Expected sizes, in the units of the parameters.
_SIZES = {
    "range_bias": 10.0,
    "range_rate_bias": 1e-2,
    "angle_bias": 1e-4,
    "clock_drift": 1e-9,
    "time_tag": 1.0,
    "station_position": 10.0,
    "light_time": 1.0,
    "frame_rotation": 1e-3,
    "antenna_offset": 1.0,
    "troposphere": 2.4,
    "refraction": 1.0,
    "relativistic_delay": 1.0,
}
_TITLES = {
    "range_bias": "range bias",
    "range_rate_bias": "range-rate bias",
    "angle_bias": "bias of the angles",
    "clock_drift": "clock drift",
    "time_tag": "time-tag error",
    "station_position": "error of the station's position",
    "light_time": "light time not corrected for",
    "frame_rotation": "axes turned (frame slip)",
    "antenna_offset": "antenna away from the centre of mass",
    "troposphere": "delay in the troposphere",
    "refraction": "refraction",
    "relativistic_delay": "relativistic delay of the signal",
}
#: Zenith delay at sea level and the height in which it falls to a third, m; what vapour adds.
_AIR, _AIR_HEIGHT, _VAPOUR = 2.4, 8000.0, 0.15
#: Coarser ranges (m) and range rates (m/s) than these do not see it.
_SHAPIRO = {"range": 0.1, "range_rate": 1e-6}


def instrument_candidates(arcs: Sequence[Arc]) -> list[Candidate]:
    """Return a candidate for each effect that concerns any of the measurements.

    Biases, clocks and time tags are of one data set (label), position and air of one station; a
    rotation of the axes of all data that are given in axes, an antenna of all data.
    """
    sets = [m for arc in arcs for m in arc.measurements]
    labels = {m.label: m for m in sets}
    stations = sorted({m.station.name for m in sets if m.station is not None})
    effects: list[tuple[MeasurementEffect, str]] = []
    for label in labels:
        for kind in (RangeBias, RangeRateBias, AngleBias, ClockDrift, TimeTag, LightTime):
            effects.append((kind(label), label))
    for name in stations:
        effects.append((StationPosition(name), name))
        effects += [(Troposphere(name), name), (Refraction(name), name)]
    effects += [(FrameRotation(), ""), (AntennaOffset(), "")]
    if any(np.median(m.sigmas) <= _SHAPIRO.get(m.kind, 0.0) for m in sets):
        effects.append((RelativisticDelay(), ""))
    found = []
    for effect, of in effects:
        if not any(effect.concerns(m) for m in sets):
            continue
        alone = not of or (len(labels) == 1 and not isinstance(effect, _OF_STATION))
        names = tuple(p.name for p in effect.parameters)
        found.append(
            Candidate(
                effect.name if alone else f"{effect.name}[{of}]",
                _TITLES[effect.name] + ("" if alone else f" of {of}"),
                effect,
                names,
                dict.fromkeys(names, 0.0),
                (_SIZES[effect.name],) * len(names),
                "instrument",
                known=_known(effect, sets),
            )
        )
    return found


def _known(
    effect: MeasurementEffect, sets: Sequence[Measurements]
) -> dict[str, tuple[float, float]]:
    """Return what physics says of the parameter, with its standard deviation."""
    name = effect.parameters[0].name
    if isinstance(effect, RelativisticDelay):
        return {name: (1.0, 1e-3)}
    if isinstance(effect, Refraction):
        return {name: (1.0, 0.15)}  # pressure, temperature, vapour, and the formula
    if isinstance(effect, LightTime):
        return {name: (1.0, 1e-3)}  # all of the correction is missing
    if isinstance(effect, Troposphere):
        station = next(m.station for m in sets if effect.concerns(m))
        height = station.height if station is not None else 0.0
        return {name: (_AIR * float(np.exp(-height / _AIR_HEIGHT)), _VAPOUR)}
    return {}
