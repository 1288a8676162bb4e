"""What instruments, clocks, stations and bookkeeping may have done to the measurements."""

from __future__ import annotations

from collections.abc import Sequence

from unmodeled.datasets.measurement_effects import (
    AngleBias,
    ClockDrift,
    FrameRotation,
    LightTime,
    MeasurementEffect,
    RangeBias,
    RangeRateBias,
    StationPosition,
    TimeTag,
)
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.fit_problem import Arc

__all__ = ["instrument_candidates"]

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
}


def instrument_candidates(arcs: Sequence[Arc]) -> list[Candidate]:
    """Return a candidate for each effect that concerns any of the measurements.

    Biases, clocks and time tags are of one data set (label), positions of one station; a rotation
    of the axes of all data that are given in axes.
    """
    sets = [m for arc in arcs for m in arc.measurements]
    labels = {m.label: m for m in sets}
    stations = sorted({m.station.name for m in sets if m.station is not None})
    effects: list[tuple[MeasurementEffect, str]] = []
    for label in labels:
        for kind in (RangeBias, RangeRateBias, AngleBias, ClockDrift, TimeTag, LightTime):
            effects.append((kind(label), label))
    effects += [(StationPosition(name), name) for name in stations]
    effects.append((FrameRotation(), ""))
    found = []
    for effect, of in effects:
        if not any(effect.concerns(m) for m in sets):
            continue
        alone = not of or (len(labels) == 1 and not isinstance(effect, StationPosition))
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
            )
        )
    return found
