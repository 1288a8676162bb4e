"""What a case file may say. Quantities stay as written; `load_case` turns them to SI."""

from __future__ import annotations

import datetime
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from unmodeled.core.errors import ConfigError
from unmodeled.pipeline.cases.quantities import parse_quantity
from unmodeled.pipeline.cases.spacecraft import Spacecraft
from unmodeled.pipeline.config_errors import translate
from unmodeled.pipeline.config_types import Section

__all__ = [
    "KINDS",
    "ArcConfig",
    "CaseConfig",
    "MeasurementConfig",
    "SpacecraftConfig",
    "StateConfig",
    "checked_epoch",
    "parse_vector",
]

#: Units of the sigmas of each measurement kind: one, or one for each half of the components.
KINDS: dict[str, tuple[str, ...]] = {
    "position": ("m",),
    "position_velocity": ("m", "m s-1"),
    "range": ("m",),
    "range_rate": ("m s-1",),
    "right_ascension_declination": ("rad",),
    "azimuth_elevation": ("rad",),
}


class SpacecraftConfig(Section):
    """Mass and area with units; coefficients without."""

    mass: Any
    area: Any
    reflectivity: Any = 1.3
    drag_coefficient: Any = 2.2

    def made(self) -> Spacecraft:
        """Return the spacecraft in SI.

        Raises
        ------
        ConfigError
            If a unit is wrong or a number is not positive.
        """
        return Spacecraft(
            mass=parse_quantity(self.mass, "kg", "spacecraft.mass"),
            area=parse_quantity(self.area, "m2", "spacecraft.area"),
            reflectivity=parse_quantity(self.reflectivity, "1", "spacecraft.reflectivity"),
            drag_coefficient=parse_quantity(
                self.drag_coefficient, "1", "spacecraft.drag_coefficient"
            ),
        )


class StationConfig(Section):
    """A place on the body: latitude, longitude and height, or ``xyz``."""

    latitude: Any = None
    longitude: Any = None
    height: Any = None
    xyz: Any = None

    @model_validator(mode="after")
    def _one_way(self) -> StationConfig:
        angles = (self.latitude, self.longitude, self.height)
        if (self.xyz is None) == (None in angles) and (
            self.xyz is None or any(a is not None for a in angles)
        ):
            raise ConfigError(
                "a station needs its place",
                allowed="latitude, longitude and height, or xyz",
                do="write e.g. {latitude: 35.4 deg, longitude: -116.9 deg, height: 1000 m}",
            )
        return self


class MeasurementConfig(Section):
    """One file of measurements."""

    file: str
    kind: Literal[
        "position",
        "position_velocity",
        "range",
        "range_rate",
        "right_ascension_declination",
        "azimuth_elevation",
    ]
    sigma: Any = None
    frame: str | None = None
    time_scale: str | None = None
    station: str | None = None
    satellite: str | None = None
    target: int | None = None
    center: int | None = None
    step: Any = None
    every: Annotated[int, Field(ge=1)] = 1
    start: Any = None
    end: Any = None
    light_time: bool = False
    astrometric: bool = False
    round_trip: bool | None = None
    label: str | None = None

    @model_validator(mode="after")
    def _sigma_is_stated(self) -> MeasurementConfig:
        if self.sigma is None:
            unit = KINDS[self.kind][0].replace(" s-1", "/s")
            raise ConfigError(
                f"sigma of {self.file} is not stated",
                do=f'write the standard deviation of its noise, e.g. "sigma: 0.5 {unit}", or '
                '"sigma: file" if its columns state it',
            )
        return self

    @model_validator(mode="after")
    def _kernels_are_sampled(self) -> MeasurementConfig:
        wanted = {k: getattr(self, k) for k in ("target", "center", "step", "start", "end")}
        if self.is_kernel:
            lacking = [k for k, v in wanted.items() if v is None]
            if lacking:
                raise ConfigError(
                    f"{self.file} is a kernel, and {lacking[0]} is not stated",
                    do="write e.g. {target: 1, center: 10, start: 0 d, end: 3650 d, step: 5 d}: "
                    "NAIF numbers of what moves and of the body, and when it is sampled",
                )
            wrong = [k for k in ("frame", "time_scale", "station", "satellite") if getattr(self, k)]
            if wrong or self.every != 1:
                raise ConfigError(
                    f"{self.file} is a kernel, which has no {wrong[0] if wrong else 'every'}",
                    do="drop the key" if wrong else "give a longer step",
                )
        else:
            given = [k for k in ("target", "center", "step") if wanted[k] is not None]
            if given:
                raise ConfigError(
                    f"{self.file} is no kernel, and {given[0]} is stated",
                    allowed="target, center and step with a .bsp file",
                    do="drop the key, or take each n-th measurement with every",
                )
        return self

    @property
    def is_kernel(self) -> bool:
        """True for an SPK kernel, which has no times of its own."""
        return self.file.lower().endswith(".bsp")

    @property
    def sigma_in_file(self) -> bool:
        """True if the file's own columns state it: ``sigma: file``."""
        return bool(self.sigma == "file")

    def sigmas(self) -> float | tuple[float, float]:
        """Return the standard deviation in SI; a pair (position, velocity) for states."""
        wanted = KINDS[self.kind]
        given = self.sigma if isinstance(self.sigma, list | tuple) else [self.sigma]
        if len(given) != len(wanted):
            raise ConfigError(
                f"sigma of {self.file} has {len(given)} values",
                allowed="one value" if len(wanted) == 1 else "two: [0.5 m, 0.1 mm/s]",
            )
        values = [
            parse_quantity(s, unit, f"sigma of {self.file}")
            for s, unit in zip(given, wanted, strict=True)
        ]
        if not all(v > 0 for v in values):
            raise ConfigError(f"sigma of {self.file} is {self.sigma}", allowed="a number > 0")
        return values[0] if len(values) == 1 else (values[0], values[1])


class StateConfig(Section):
    """Position and velocity along the axes of the case's frame, at the start of an arc."""

    position: Any
    velocity: Any

    def state(self) -> list[float]:
        """Return six numbers, SI."""
        position = parse_vector(self.position, "m", "initial_state.position")
        return position + parse_vector(self.velocity, "m s-1", "initial_state.velocity")


class ArcConfig(Section):
    """One arc: from and to are seconds since the epoch with a unit, or dates with a scale."""

    start: Any
    end: Any
    role: Literal["fit", "held_out"] = "fit"
    name: str | None = None
    initial_state: StateConfig | None = None


class ArcsConfig(Section):
    """How the data are cut: equal lengths, or ``each`` (a list in the file)."""

    length: Any = None
    held_out: Literal["last"] | tuple[int, ...] = ()
    each: tuple[ArcConfig, ...] = ()


class ExcludeConfig(Section):
    """All default candidates but these."""

    exclude: tuple[str, ...]


class CaseConfig(Section):
    """A case file, checked but not yet computed with.

    Raises
    ------
    ConfigError
        When built by `resolve`: unknown keys (with the nearest name), values out of range.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9._-]+$")]
    body: str | dict[str, Any]
    epoch: str
    frame: Literal["icrf", "body_equator"] = "icrf"
    ephemeris: str = "analytic"
    spacecraft: SpacecraftConfig | None = None
    stations: dict[str, StationConfig] = Field(default_factory=dict)
    known: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]
    measurements: Annotated[tuple[MeasurementConfig, ...], Field(min_length=1)]
    arcs: ArcsConfig = ArcsConfig()
    initial_state: StateConfig | None = None
    candidates: Literal["default"] | tuple[str | dict[str, Any], ...] | ExcludeConfig = "default"
    false_alarm: Annotated[float, Field(gt=0, lt=0.5)] = 0.01
    seed: Annotated[int, Field(ge=0, lt=2**63, strict=True)] = 1

    @field_validator("epoch", mode="before")
    @classmethod
    def _has_scale(cls, given: Any) -> Any:
        return checked_epoch(given, "epoch")

    @model_validator(mode="before")
    @classmethod
    def _list_of_arcs(cls, given: Any) -> Any:
        if isinstance(given, dict) and isinstance(given.get("arcs"), list | tuple):
            return {**given, "arcs": {"each": given["arcs"]}}
        return given

    @model_validator(mode="after")
    def _makes_sense(self) -> CaseConfig:
        if self.arcs.each and self.arcs.length is not None:
            raise ConfigError("arcs has both a length and a list", allowed="one of them")
        labels = [m.label or m.file for m in self.measurements]
        for label in labels:
            if labels.count(label) > 1:
                raise ConfigError(
                    f'two sets of measurements are called "{label}"',
                    do="give each its own label",
                )
        for m in self.measurements:
            if m.station is not None and m.station not in self.stations:
                raise ConfigError(
                    f'the station "{m.station}" of {m.file} is not described',
                    allowed=", ".join(self.stations) or "no station is described",
                    do="add it under stations",
                )
        return self

    @classmethod
    def resolve(cls, content: dict[str, Any], source: str = "case") -> CaseConfig:
        """Validate plain data; every default is filled in."""
        try:
            return cls.model_validate(content)
        except ValidationError as exc:
            said = translate(exc, cls, source)
            # a list of arcs is held under a key that no file has
            found = said.found.replace("arcs.each.", "arcs.")
            raise ConfigError(found, allowed=said.allowed, do=said.do) from exc
        except ConfigError as exc:
            raise ConfigError(f"{source}: {exc.found}", allowed=exc.allowed, do=exc.do) from exc


def checked_epoch(given: Any, name: str) -> Any:
    """Return an epoch as it is written.

    Raises
    ------
    ConfigError
        If it has no time scale.
    """
    if isinstance(given, datetime.date):  # what YAML makes of a date without a scale
        raise ConfigError(
            f'{name} "{given.isoformat()}" has no time scale',
            allowed="a date with UTC, TAI, TT, TDB or GPS behind it",
            do='write it like "2016-03-13T00:00:00 UTC"',
        )
    return given


def parse_vector(given: Any, unit: str, name: str) -> list[float]:
    """Return three values in SI from ``"1, 2, 3 km"`` or ``[1 km, 2 km, 3 km]``.

    Raises
    ------
    ConfigError
        If there are not three, or a unit is wrong.

    Examples
    --------
    >>> parse_vector("1, 2, 3 km", "m", "position")
    [1000.0, 2000.0, 3000.0]
    """
    parts = given
    if isinstance(given, str):
        parts = [p.strip() for p in given.split(",")]
        written = parts[-1].split(maxsplit=1)
        if len(written) == 2:
            parts = [p if " " in p else f"{p} {written[1]}" for p in parts]
    if not isinstance(parts, list | tuple) or len(parts) != 3:
        raise ConfigError(f"{name} is {given!r}", allowed='three values, e.g. "1, 2, 3 km"')
    return [parse_quantity(v, unit, name) for v in parts]
