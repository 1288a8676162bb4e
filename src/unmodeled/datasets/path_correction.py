"""What a signal meets on its way: small corrections of a range, its rate or an elevation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar, TypeAlias

import heyoka as hy
import numpy as np

from unmodeled.core.arrays import Array
from unmodeled.datasets.measurement_effect import MeasurementEffect
from unmodeled.datasets.measurements import Measurements

__all__ = ["Link", "PathCorrection", "PathEffect"]

_Triple: TypeAlias = tuple[hy.expression, hy.expression, hy.expression]
#: Columns of the compiled function: value, by state, by station, rate at a fixed state.
_STATE, _STATION, _RATE = slice(1, 7), slice(7, 13), 13


@dataclass(frozen=True)
class Link:
    """Both ends of a signal's path as symbols, m, along inertial axes.

    Parameters
    ----------
    craft, station, up : tuple of expression
        Positions from the body's centre, and the unit vector of the station's vertical.
    """

    craft: _Triple
    station: _Triple
    up: _Triple

    @property
    def line(self) -> _Triple:
        """From the station to the spacecraft."""
        (x, y, z), (a, b, c) = self.craft, self.station
        return x - a, y - b, z - c

    @property
    def distance(self) -> hy.expression:
        """Length of the line."""
        return length(self.line)

    @property
    def sine_of_elevation(self) -> hy.expression:
        """Sine of the elevation above the horizon."""
        (x, y, z), (a, b, c) = self.line, self.up
        return (x * a + y * b + z * c) / self.distance


def length(v: _Triple) -> hy.expression:
    """Return the length of a vector."""
    return hy.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@dataclass(frozen=True)
class PathCorrection(ABC):
    """A correction that both ends of the path decide, for each unit of its parameter.

    Both ends are taken at the time of reception: what light time changes of a correction of metres
    is a hundred thousandth of it. Range rates get the derivative in time, a range of two ways the
    mean of both. Derivatives are compiled from the symbols, exact.
    """

    @abstractmethod
    def expression(self, link: Link) -> hy.expression:
        """Return the correction: m for ranges, rad for elevations."""

    def value(self, m: Measurements, states: Array) -> Array:
        """Return what is added to the reading, (n, k)."""
        return self._in_rows(m, self._evaluated(m, states)[:1])[:, :, 0]

    def state_columns(self, m: Measurements, states: Array) -> Array:
        """Return d value / d state, (n, k, 6)."""
        return self._in_rows(m, self._evaluated(m, states)[_STATE])

    def station_columns(self, m: Measurements, states: Array) -> Array:
        """Return d value / d the station's inertial position and velocity, (n, k, 6)."""
        return self._in_rows(m, self._evaluated(m, states)[_STATION])

    def explicit_rate(self, m: Measurements, states: Array) -> Array:
        """Return d value / d t at a fixed state: station and horizon turn, (n, k)."""
        return self._in_rows(m, self._evaluated(m, states)[_RATE:])[:, :, 0]

    def _evaluated(self, m: Measurements, states: Array) -> Array:
        track = m.track
        ends = (states, track.positions, track.velocities, track.north_east_up[:, 2], track.spin)
        rows = np.ascontiguousarray(np.hstack(ends).T)
        values: Array = _compiled(self, m.kind == "range_rate")(rows)
        return values

    @staticmethod
    def _in_rows(m: Measurements, columns: Array) -> Array:
        """Put columns (p, n) into the last component of each measurement, (n, k, p)."""
        out = np.zeros((len(m.times), len(m.components), len(columns)))
        out[:, -1] = columns.T
        return out


@cache
def _compiled(correction: PathCorrection, rate: bool) -> Any:
    names = [f"{stem}{axis}" for stem in ("r", "v", "s", "u", "e", "w") for axis in "xyz"]
    symbols = list(hy.make_vars(*names))
    r, v, s, u, up, w = (symbols[k : k + 3] for k in range(0, 18, 3))
    link = Link((r[0], r[1], r[2]), (s[0], s[1], s[2]), (up[0], up[1], up[2]))
    still = [*s, *u, *up]
    moving = [*u, *_cross(w, u), *_cross(w, up)]

    def along(f: hy.expression, by: list[hy.expression], rates: list[Any]) -> hy.expression:
        return hy.sum([hy.diff(f, x) * dx for x, dx in zip(by, rates, strict=True)])

    value = correction.expression(link)
    if rate:
        value = along(value, r, v) + along(value, still, moving)
    slopes = [hy.diff(value, x) for x in (*r, *v, *s, *u)]
    return hy.cfunc([value, *slopes, along(value, still, moving)], symbols)


def _cross(a: list[hy.expression], b: list[hy.expression]) -> list[Any]:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


class PathEffect(MeasurementEffect):
    """An effect of one parameter that times a `PathCorrection`."""

    #: True if the effect is one station's, not one data set's.
    of_station: ClassVar[bool] = True

    @property
    @abstractmethod
    def correction(self) -> PathCorrection:
        """The correction for a parameter of one."""

    def concerns(self, m: Measurements) -> bool:
        """Whether the measurements were made on the Earth, at this station if one is named."""
        if m.kind not in self.kinds or m.station is None:
            return False
        name = m.station.name if self.of_station else m.label
        return m.station.rotation is None and self.of in ("", name)

    def _applied(self, m: Measurements, values: tuple[float, ...]) -> Measurements:
        return replace(m, corrections=(*m.corrections, (self.correction, values[0])))

    def partials(self, m: Measurements, states: Array, accelerations: Array) -> Array:
        """Return the correction for a parameter of one."""
        return m.correction_value(self.correction, states)[:, :, None]
