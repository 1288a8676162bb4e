"""Measurement effects: biases, clocks, stations, light time, axes and units; list of all.

Without them in the catalogue physics is blamed for an instrument's errors.  Each class is one
effect, and its docstring is the effect's card.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.core.constants import SPEED_OF_LIGHT
from unmodeled.core.parameters import Parameter
from unmodeled.datasets.antenna_offset import AntennaOffset
from unmodeled.datasets.measurement_effect import MeasurementEffect, constant_columns
from unmodeled.datasets.measurements import Measurements
from unmodeled.datasets.refraction import Refraction
from unmodeled.datasets.relativistic_delay import RelativisticDelay
from unmodeled.datasets.troposphere import Troposphere

__all__ = [
    "MEASUREMENT_EFFECTS",
    "AngleBias",
    "AntennaOffset",
    "ClockDrift",
    "FrameRotation",
    "LightTime",
    "MeasurementEffect",
    "RangeBias",
    "RangeRateBias",
    "Refraction",
    "RelativisticDelay",
    "Scale",
    "StationPosition",
    "TimeTag",
    "TimeTagDrift",
    "Troposphere",
]

_C = SPEED_OF_LIGHT.value
_POSITIONS = ("position", "position_velocity")
_RANGING = ("range", "range_rate")
_ANGLES = ("right_ascension_declination", "azimuth_elevation")


class _Bias(MeasurementEffect):
    """Adds its parameters to the prediction."""

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        return replace(m, bias=np.asarray(m.bias) + np.array(values))

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return unity."""
        return constant_columns(m, np.ones(len(m.times)))


@dataclass(frozen=True)
class RangeBias(_Bias):
    """Constant error of a range: rho + b.

    Size: millimetres (laser), metres (radio, uncalibrated delays). Confused with: the station's
    height, GM (through the size of the orbit: db/rho = dGM/3GM), clock offset (c dt).
    Source: [MontenbruckGill2000] chapter 6.
    """

    name: ClassVar[str] = "range_bias"
    kinds: ClassVar[tuple[str, ...]] = ("range",)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The bias, m."""
        return (self._parameter("range_bias", "m", 1.0, "added to ranges"),)


@dataclass(frozen=True)
class RangeRateBias(_Bias):
    """Constant error of a range rate: d rho/dt + b.

    Size: relative frequency offset of the oscillators times c: 1e-12 is 0.3 mm/s.
    Confused with: `ClockDrift` of range rates (the same), a radial drift of a distant spacecraft.
    Source: [MontenbruckGill2000] chapter 6.
    """

    name: ClassVar[str] = "range_rate_bias"
    kinds: ClassVar[tuple[str, ...]] = ("range_rate",)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The bias, m/s."""
        return (self._parameter("range_rate_bias", "m s-1", 1e-3, "added to range rates"),)


@dataclass(frozen=True)
class AngleBias(_Bias):
    """Constant pointing error of both angles, along the great circles.

    The first is the shift along the parallel: the error of the angle itself is that over the
    cosine of the second. Size: 1e-5 rad (telescope), 1e-4 (antenna). Confused with:
    `FrameRotation`, the station's position, aberration (1e-4 rad), refraction (elevation only).
    Source: [MontenbruckGill2000] chapter 6.
    """

    name: ClassVar[str] = "angle_bias"
    kinds: ClassVar[tuple[str, ...]] = _ANGLES

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Shift along the parallel and upwards, rad."""
        return (
            self._parameter("angle_bias_1", "rad", 1e-5, "right ascension (azimuth) x cosine"),
            self._parameter("angle_bias_2", "rad", 1e-5, "declination (elevation)"),
        )


class _Time(MeasurementEffect):
    """Evaluates the prediction at other times than the tags."""

    kinds: ClassVar[tuple[str, ...]] = (*_POSITIONS, *_RANGING, *_ANGLES)

    @abstractmethod
    def _factors(self, m: Measurements) -> Array:
        """Return d time / d parameter, (n,)."""

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        return m.shifted(values[0] * self._factors(m))

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return the prediction's total rate in time, weighted."""
        rate = m.time_derivative(states, accelerations)
        columns: Array = (rate * self._factors(m)[:, None])[:, :, None]
        return columns


@dataclass(frozen=True)
class TimeTag(_Time):
    """All tags are off: what is tagged t was measured at t + dt.

    The station goes along, and data that were given along Earth-fixed axes were also turned
    with the Earth of the wrong moment: their derivative is v - omega x r. Size: microseconds (GNSS
    clock) to 1 ms; slips of a time scale are whole seconds, see
    :func:`unmodeled.datasets.slips.explain_time_offset`. Confused with: motion along the orbit
    (d_along = v dt) and, for a circular orbit in inertial axes, with the initial state entirely:
    it shows only through what depends on the date (station, Earth's rotation, Sun and Moon).
    Source: [MontenbruckGill2000] chapter 6.
    """

    name: ClassVar[str] = "time_tag"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The offset, s."""
        return (self._parameter("time_tag", "s", 1e-3, "measured at tag + this"),)

    def _factors(self, m: Measurements) -> Array:
        return np.ones(len(m.times))


@dataclass(frozen=True)
class TimeTagDrift(_Time):
    """The clock that tags runs wrong: measured at t + rate (t - first tag).

    Size: 1e-11 (quartz, oven) to 1e-6 (plain quartz). Confused with: an error of the mean motion
    (GM, semi-major axis: d n/n = rate), drag at first order.
    Source: [MontenbruckGill2000] chapter 6.
    """

    name: ClassVar[str] = "time_tag_drift"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The rate, s/s."""
        return (self._parameter("time_tag_drift", "s s-1", 1e-9, "tags run slow by this"),)

    def _factors(self, m: Measurements) -> Array:
        return m.since


@dataclass(frozen=True)
class ClockDrift(MeasurementEffect):
    """The clock that measures delays drifts: one-way range + c d (t - first tag), rate + c d.

    Size: 1e-12 grows to 26 m in a day and shifts rates by 0.3 mm/s. Confused with: a range-rate
    bias, a radial drift of a distant spacecraft, a constant radial acceleration over short arcs.
    Source: [MontenbruckGill2000] section 6.2.
    """

    name: ClassVar[str] = "clock_drift"
    kinds: ClassVar[tuple[str, ...]] = _RANGING

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Relative frequency error, s/s."""
        return (self._parameter("clock_drift", "s s-1", 1e-12, "relative drift of the clock"),)

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        size = _C * values[0]
        if m.kind == "range":
            return replace(m, bias_rate=np.asarray(m.bias_rate) + size)
        return replace(m, bias=np.asarray(m.bias) + size)

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return c (t - first tag), or c for rates."""
        return constant_columns(m, _C * (m.since if m.kind == "range" else np.ones(len(m.times))))


@dataclass(frozen=True)
class StationPosition(MeasurementEffect):
    """The station stands elsewhere: position + d, along body-fixed axes (ITRF).

    All data sets of one station share it. Its horizon stays as it was levelled. Size: millimetres
    (surveyed), 0.1 m (tide, loading left out), 100 m (datum mistaken). Confused with: range bias
    (height), time tag and Earth rotation (east: 465 m/s at the equator), angle bias.
    Source: [MontenbruckGill2000] chapter 6, [IERS2010] chapter 7.
    """

    name: ClassVar[str] = "station_position"
    kinds: ClassVar[tuple[str, ...]] = (*_RANGING, *_ANGLES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The shift, m."""
        return tuple(
            self._parameter(f"station_{axis}", "m", 1.0, f"shift along body-fixed {axis}")
            for axis in "xyz"
        )

    def concerns(self, m: Measurements) -> bool:
        """Whether the measurements were made at this station (any, if none is named)."""
        return m.kind in self.kinds and m.station is not None and self.of in ("", m.station.name)

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        if m.station is None:
            return m
        return replace(m, station=m.station.moved(values))

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return the derivative by the position, the velocity omega x r included."""
        turn = m.track.inertial_from_body
        spun = np.cross(m.track.spin[:, None], np.swapaxes(turn, 1, 2))
        moved = np.concatenate([turn, np.swapaxes(spun, 1, 2)], axis=1)
        columns: Array = m.station_partials(states) @ moved
        return columns


@dataclass(frozen=True)
class LightTime(MeasurementEffect):
    """A share of the light-time correction is missing (or was made twice: -1).

    Prediction + s (with light time - without). Size: v tau = v rho / c: 25 m at 1000 km, 300 m
    for GPS, against the same share of a velocity. Confused with: a time tag of -rho/c (the same
    where the range hardly changes), an along-track shift.
    Source: [MontenbruckGill2000] section 6.2.
    """

    name: ClassVar[str] = "light_time"
    kinds: ClassVar[tuple[str, ...]] = (*_RANGING, *_ANGLES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The share, without unit."""
        return (self._parameter("light_time", "1", 1.0, "share of the correction to be added"),)

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        return replace(m, light_time=float(m.light_time) + values[0])

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return the difference that the correction makes."""
        without = replace(m, light_time=False).residuals(states)
        columns: Array = (without - replace(m, light_time=True).residuals(states))[:, :, None]
        return columns


@dataclass(frozen=True)
class FrameRotation(MeasurementEffect):
    r"""The data's axes are turned by a rotation vector: they read r - theta x r (exactly turned).

    Size: frame bias of EME2000 1.1e-7 rad; precession (mean of date read as ICRF) 2.4e-4 rad a
    year about the pole of the ecliptic; nutation 8e-5; see
    :func:`unmodeled.datasets.slips.explain_rotation`. Confused with: the initial state (a turned
    orbit plane) entirely for a spherical field; separated by the field's own axes, Sun and Moon.
    Source: [IERS2010] chapter 5.
    """

    name: ClassVar[str] = "frame_rotation"
    kinds: ClassVar[tuple[str, ...]] = (*_POSITIONS, "right_ascension_declination")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Rotation vector along inertial axes, rad."""
        return tuple(
            self._parameter(f"frame_rotation_{axis}", "rad", 1e-7, f"axes turned about {axis}")
            for axis in "xyz"
        )

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        return replace(m, rotation=np.asarray(m.rotation) + np.array(values))

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return the derivative by the rotation vector."""
        return m.rotation_partials(states)


@dataclass(frozen=True)
class Scale(MeasurementEffect):
    """Positions (velocities, ranges) in a wrong unit of length: prediction times 1 + s.

    Size: 1e-9 (scale of terrestrial frames), 2e-6 (US survey foot), 1.6e-8 (TDB- against
    TCB-compatible lengths). Velocities and range rates scale along. Confused with: GM, entirely
    so for positions on a Keplerian orbit (s = dGM/3GM); range bias.
    Source: [IERS2010] chapter 4.
    """

    name: ClassVar[str] = "scale"
    kinds: ClassVar[tuple[str, ...]] = (*_POSITIONS, *_RANGING)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Relative error of the unit."""
        return (
            Parameter(
                self._named("scale"),
                unit="1",
                scale=1e-8,
                lower=-0.999_999,
                description="predictions are longer by this share",
            ),
        )

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        return replace(m, scale=m.scale + values[0])

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return the prediction without factor and bias."""
        plain = replace(m, scale=1.0, bias=None, bias_rate=None, corrections=())
        return plain.predicted(states)[:, :, None]


#: All of them, in the order of tables.
MEASUREMENT_EFFECTS: tuple[type[MeasurementEffect], ...] = (
    RangeBias,
    RangeRateBias,
    AngleBias,
    TimeTag,
    TimeTagDrift,
    ClockDrift,
    StationPosition,
    LightTime,
    FrameRotation,
    Scale,
    AntennaOffset,
    Troposphere,
    Refraction,
    RelativisticDelay,
)
