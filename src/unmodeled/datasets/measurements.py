"""Measurements of an orbit: what was measured, when, from where, and how well."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import erfa
import numpy as np
import numpy.typing as npt

from unmodeled.core.arrays import Array, as_array, check_increasing
from unmodeled.core.constants import ASTRONOMICAL_UNIT, DAY
from unmodeled.core.errors import DataError, nearest
from unmodeled.core.time import terrestrial_time
from unmodeled.datasets import measurement_prediction as engine
from unmodeled.datasets.measurement_geometry import wrapped
from unmodeled.datasets.station import Station, StationTrack, earth_rotation

if TYPE_CHECKING:
    from unmodeled.datasets.path_correction import PathCorrection

__all__ = ["Kind", "Measurements"]

Kind = Literal[
    "position",
    "position_velocity",
    "range",
    "range_rate",
    "right_ascension_declination",
    "azimuth_elevation",
]
_NEED_STATION = ("range", "range_rate", "azimuth_elevation")
_SIGMA = {
    "position": "a number for positions",
    "position_velocity": "a pair (m, m/s) for states",
    "range": "a number, m",
    "range_rate": "a number, m/s",
    "right_ascension_declination": "a number or a pair, rad",
    "azimuth_elevation": "a number or a pair, rad",
}


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measurements of one kind along one arc.

    What each kind means:

    position, position_velocity
        Relative to the body's centre of mass, along inertial axes (ICRF), m and m/s.
    range, range_rate
        Distance of station and spacecraft, m, and its rate, m/s, positive when it grows; for two
        ways half of the round trip. Geometric but for ``corrections``; no ionosphere.
    right_ascension_declination
        Direction from the station (or the body's centre) along ICRF axes, rad. Geometric; with
        ``astrometric`` as compared with catalogue stars.
    azimuth_elevation
        Azimuth from north through east, elevation above the local horizon, rad; refraction is one
        of the ``corrections``.
        Elevations below zero are allowed (`below_horizon` counts them).

    Angles are compared along the great circle: the first component is right ascension (azimuth)
    *times the cosine of the measured declination (elevation)*. ``sigma``, ``bias``, residuals and
    partials refer to that; ``values`` are the angles themselves. Differences are brought to
    (-pi, pi].

    Parameters
    ----------
    kind : str
        One of the above.
    times : ndarray (n,)
        Seconds since the epoch, strictly increasing, of reception where a signal is received.
    values : ndarray (n, k)
        SI. One column may be given as (n,).
    sigma : array_like
        Standard deviation of each component: a number (positions, range, range rate, angles), a
        pair (m, m/s) for positions and velocities, a pair for angles, or an array of the shape of
        ``values``. Never assumed.
    label : str
        Name in tables, e.g. the file.
    station : Station, optional
        Where it was measured; needed by all but positions and right ascensions.
    epoch : str
        Date of time zero with its scale; needed wherever the Earth's orientation is.
    light_time : bool or float
        Whether the time that light takes is part of the values; a number is a share of that
        correction (see :mod:`unmodeled.datasets.measurement_geometry`).
    gm : float
        Of the central body, m3/s2: the orbit's curvature within the light time; 0 neglects it.
    ways : {1, 2}
        Ranges and range rates of one leg, or the mean of both.
    astrometric : bool
        Right ascensions about the Earth: True if they were reduced against catalogue (ICRS)
        places of stars, which leaves the aberration by the Earth's motion about the Sun, up to
        1e-4 rad (20 arc seconds), in them.
    axes : {"inertial", "earth_fixed"}
        Axes in which positions were *given*. They are inertial here in any case; but if ``times``
        differ from ``tags``, Earth-fixed data were turned with the Earth of the wrong moment.
    tags : ndarray (n,), optional
        Times as the file tags them; ``times`` by default. A time-tag effect moves ``times`` only.
    bias, bias_rate : array_like (k,), optional
        Added to the prediction: bias + bias_rate (tag - bias_epoch), SI, per second.
    bias_epoch : float, optional
        Seconds; the first tag by default.
    rotation : array_like (3,)
        Positions and right ascensions: rotation vector (rad) from the inertial axes to the
        data's; to first order the data read r - rotation x r.
    scale : float
        Positions, ranges and range rates: factor on the prediction.
    antenna : array_like (3,)
        Where the measured point lies from the centre of mass, m, along radial, transverse and
        normal axes; see :mod:`unmodeled.datasets.antenna_offset`.
    corrections : tuple of (PathCorrection, float)
        What the path of the signal adds to ranges, range rates or elevations, and how many times;
        see :mod:`unmodeled.datasets.path_correction`. Not multiplied by ``scale``.

    Raises
    ------
    DataError
        On an unknown kind, wrong shapes, values that are not finite, unsorted or repeated times,
        a sigma that is missing or not positive, a station or epoch that is missing, or a setting
        that the kind does not have.
    """

    kind: Kind
    times: Array
    values: Array
    sigma: npt.ArrayLike
    label: str = "measurements"
    station: Station | None = None
    epoch: str = ""
    light_time: bool | float = False
    gm: float = 0.0
    ways: int = 1
    astrometric: bool = False
    axes: Literal["inertial", "earth_fixed"] = "inertial"
    tags: Array | None = None
    bias: Array | None = None
    bias_rate: Array | None = None
    bias_epoch: float | None = None
    rotation: npt.ArrayLike = (0.0, 0.0, 0.0)
    scale: float = 1.0
    antenna: npt.ArrayLike = (0.0, 0.0, 0.0)
    corrections: tuple[tuple[PathCorrection, float], ...] = ()

    def __post_init__(self) -> None:
        self._check_kind()
        put, where = object.__setattr__, self.label
        put(self, "times", as_array(self.times, ("n",), f"{where}: times"))
        if len(self.times) == 0:
            raise DataError(f"{where} has no measurements", allowed="at least one")
        check_increasing(self.times, f"{where}: time")
        n, k = len(self.times), len(self.components)
        values = self.values
        if k == 1 and np.ndim(values) == 1:
            values = np.reshape(values, (-1, 1))
        put(self, "values", as_array(values, (n, k), f"{where}: values"))
        put(self, "sigma", self._full_sigma((n, k)))
        tags = self.times if self.tags is None else self.tags
        put(self, "tags", as_array(tags, (n,), f"{where}: tags"))
        for name in ("bias", "bias_rate"):
            given = getattr(self, name)
            given = np.zeros(k) if given is None else np.atleast_1d(given)
            put(self, name, as_array(given, (k,), f"{where}: {name}"))
        if self.bias_epoch is None:
            put(self, "bias_epoch", float(np.asarray(self.tags)[0]))
        put(self, "rotation", as_array(self.rotation, (3,), f"{where}: rotation"))
        put(self, "antenna", as_array(self.antenna, (3,), f"{where}: antenna"))
        self._check_settings()

    def _check_kind(self) -> None:
        where, kinds = self.label, engine.COMPONENTS
        if self.kind not in kinds:
            raise DataError(
                f'{where}: kind is "{self.kind}"',
                allowed=", ".join(kinds),
                do=nearest(str(self.kind), kinds),
            )
        if self.kind in _NEED_STATION and self.station is None:
            raise DataError(
                f'{where}: kind is "{self.kind}" without a station: {self.kind} needs a station',
                do="give station=Station.from_geodetic(...) or Station.from_xyz(...)",
            )
        if self.kind in engine.POSITIONS and self.station is not None:
            raise DataError(
                f"{where}: {self.kind} with a station", allowed="positions from the body's centre"
            )
        if self.axes not in ("inertial", "earth_fixed"):
            raise DataError(f'{where}: axes is "{self.axes}"', allowed="inertial, earth_fixed")

    def _check_settings(self) -> None:
        positions, where = self.kind in engine.POSITIONS, self.label
        radec = self.kind == "right_ascension_declination"
        ranging = self.kind in ("range", "range_rate")
        wrong = {
            "light_time": bool(self.light_time) and positions,
            "ways": self.ways != 1 and not (self.ways == 2 and ranging),
            "astrometric": self.astrometric and not radec,
            'axes="earth_fixed"': self.axes == "earth_fixed" and not positions,
            "rotation": bool(np.any(self.rotation)) and not (positions or radec),
            "scale": self.scale != 1 and not (positions or ranging),
            "corrections": bool(self.corrections) and (positions or radec),
        }
        for name, is_wrong in wrong.items():
            if is_wrong:
                raise DataError(f"{where}: {self.kind} has no setting {name}")
        if not (np.isfinite(self.scale) and self.scale > 0 and self.gm >= 0):
            raise DataError(
                f"{where}: scale {self.scale}, gm {self.gm}", allowed="scale > 0, gm >= 0"
            )
        if self.kind in engine.ANGLES and np.any(np.abs(self.values[:, 1]) > np.pi / 2):
            raise DataError(
                f"{where}: {self.components[1]} of {np.abs(self.values[:, 1]).max():.6g} rad",
                allowed="-pi/2 .. pi/2 rad",
                do="degrees must be turned into radians",
            )
        on_earth = self.station is not None and self.station.rotation is None
        if (on_earth or self.astrometric or self.axes == "earth_fixed") and not self.epoch:
            raise DataError(
                f"{where}: the Earth's orientation needs the date of time zero",
                do='give epoch="2016-03-13T00:00:00 UTC" or the like',
            )

    def _full_sigma(self, shape: tuple[int, int]) -> Array:
        if self.sigma is None:
            raise DataError(
                f"{self.label}: sigma is not stated",
                allowed=_SIGMA[self.kind],
                do="state the noise: the fit weighs data by it",
            )
        sigma = np.asarray(self.sigma, dtype=np.float64)
        fits = sigma.shape == shape or (sigma.shape == () and self.kind != "position_velocity")
        if sigma.shape == (2,) and self.kind == "position_velocity":
            sigma, fits = np.repeat(sigma, 3), True
        elif sigma.shape == (2,) and self.kind in engine.ANGLES:
            fits = True
        elif sigma.shape == shape[:1] and shape[1] == 1:
            sigma, fits = sigma[:, None], True
        if not fits:
            raise DataError(
                f"{self.label}: sigma has shape {sigma.shape}",
                allowed=f"{_SIGMA[self.kind]}, or shape {shape}",
            )
        full = np.broadcast_to(sigma, shape).copy()
        bad = ~(np.isfinite(full) & (full > 0))
        if bad.any():
            raise DataError(
                f"{self.label}: sigma is {float(full[bad][0])}", allowed="standard deviations > 0"
            )
        return full

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the columns of ``values``."""
        return engine.COMPONENTS[self.kind]

    @property
    def sigmas(self) -> Array:
        """Standard deviations, the shape of ``values``."""
        return np.asarray(self.sigma, dtype=np.float64)

    @property
    def below_horizon(self) -> int:
        """Number of measured elevations below zero: noted, not refused."""
        return int(np.sum(self.values[:, 1] < 0)) if self.kind == "azimuth_elevation" else 0

    @property
    def since(self) -> Array:
        """Seconds from ``bias_epoch`` to the tags, (n,)."""
        return np.asarray(self.tags) - float(self.bias_epoch or 0.0)

    @property
    def earth_fixed(self) -> bool:
        """True if positions were given along Earth-fixed axes."""
        return self.axes == "earth_fixed"

    @cached_property
    def track(self) -> StationTrack:
        """The station at ``times``; the body's centre where there is no station."""
        if self.station is not None:
            return self.station.track(self.epoch, self.times)
        centre = StationTrack.centre(len(self.times))
        if not self.earth_fixed:
            return centre
        turn, spin = earth_rotation(self.epoch, self.times)
        return replace(centre, inertial_from_body=turn, spin=spin)

    @cached_property
    def turn(self) -> Array:
        """Matrices (n, 3, 3) from the true inertial axes to those along which positions read."""
        matrix = engine.turned(np.asarray(self.rotation))
        if not self.earth_fixed or np.array_equal(np.asarray(self.tags), self.times):
            return np.broadcast_to(matrix, (len(self.times), 3, 3))
        tagged = earth_rotation(self.epoch, np.asarray(self.tags))[0]
        slip: Array = tagged @ np.swapaxes(self.track.inertial_from_body, 1, 2) @ matrix
        return slip

    @cached_property
    def barycentric_velocity(self) -> Array:
        """Velocity of the Earth about the barycentre of the solar system, m/s, (n, 3)."""
        tt = terrestrial_time(self.epoch, self.times)
        earth = erfa.epv00(tt.jd1, tt.jd2)[1]["v"]  # TT for TDB: 2 ms, 1e-8 of the direction
        return np.asarray(earth) * (ASTRONOMICAL_UNIT.value / DAY.value)

    def observed(self, states: Array) -> Array:
        """Return the values (n, k) that noiseless instruments would read at states (n, 6).

        For simulation: angles are whole, 0 <= right ascension (azimuth) < 2 pi.
        """
        out = engine.readings(self, states)
        bias = self._bias()
        if self.kind in engine.ANGLES:
            bias[:, 0] /= np.cos(out[:, 1])
            out = out + bias
            out[:, 0] = np.mod(out[:, 0], 2 * np.pi)
            return out
        return out + bias

    def residuals(self, states: Array) -> Array:
        """Return measured minus predicted, (n, k), at states (n, 6) at ``times``."""
        difference = self.values - engine.readings(self, states)
        if self.kind in engine.ANGLES:
            difference[:, 0] = wrapped(difference[:, 0]) * np.cos(self.values[:, 1])
        return difference - self._bias()

    def predicted(self, states: Array) -> Array:
        """Return what would be measured at states (n, 6), so that values - predicted = residuals.

        For angles that is the value on the branch of the measurement, its difference shortened
        by the cosine of the declination; `observed` gives the angles themselves.
        """
        if self.kind in engine.ANGLES:
            return self.values - self.residuals(states)
        return engine.readings(self, states) + self._bias()

    def partials(self, states: Array) -> Array:
        """Return d predicted / d state, (n, k, 6)."""
        return self._shortened(engine.state_columns(self, states))

    def station_partials(self, states: Array) -> Array:
        """Return d predicted / d station's inertial position and velocity, (n, k, 6)."""
        return self._shortened(engine.station_columns(self, states))

    def rotation_partials(self, states: Array) -> Array:
        """Return d predicted / d ``rotation``, (n, k, 3)."""
        return self._shortened(engine.rotation_columns(self, states))

    def antenna_partials(self, states: Array) -> Array:
        """Return d predicted / d ``antenna``, (n, k, 3)."""
        return self._shortened(engine.offset_columns(self, states))

    def correction_value(self, correction: PathCorrection, states: Array) -> Array:
        """Return what one unit of a correction adds to the prediction, (n, k)."""
        return correction.value(self, engine.measured_states(self, states))

    def time_derivative(self, states: Array, accelerations: Array) -> Array:
        """Return d predicted / d ``times`` with ``tags`` kept, (n, k).

        Parameters
        ----------
        states : ndarray (n, 6)
            At ``times``.
        accelerations : ndarray (n, 3)
            Inertial acceleration at the same times, m/s2.
        """
        rates = np.concatenate([states[:, 3:], accelerations], axis=1)
        moved: Array = np.einsum("nkj,nj->nk", self.partials(states), rates)
        explicit = self._shortened(engine.explicit_rate(self, states)[:, :, None])
        total: Array = moved + explicit[:, :, 0]
        return total

    def shifted(self, dt: float | Array) -> Measurements:
        """Return a copy at ``times + dt`` with the same tags; the station is taken at the new."""
        return replace(self, times=self.times + dt)

    def subset(self, mask: npt.NDArray[np.bool_]) -> Measurements:
        """Return the measurements chosen by a mask (n,); ``bias_epoch`` stays."""
        keep = np.asarray(mask, dtype=bool)
        if keep.shape != self.times.shape:
            raise DataError(
                f"{self.label}: mask has shape {keep.shape}", allowed=f"shape {self.times.shape}"
            )
        tags = np.asarray(self.tags)[keep]
        values, sigma = self.values[keep], self.sigmas[keep]
        return replace(self, times=self.times[keep], values=values, sigma=sigma, tags=tags)

    def _bias(self) -> Array:
        grown: Array = np.asarray(self.bias) + self.since[:, None] * np.asarray(self.bias_rate)
        return grown

    def _shortened(self, columns: Array) -> Array:
        """Multiply the first angle's row by the cosine of the measured second angle."""
        if self.kind in engine.ANGLES:
            columns[:, 0] *= np.cos(self.values[:, 1])[:, None]
        return columns
