"""The configuration of one characterisation: what a YAML file may say."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from unmodeled.core.errors import ConfigError, nearest
from unmodeled.core.units import NormalisedUnits
from unmodeled.datasets.initial_conditions import checked_ranges
from unmodeled.datasets.noise import Noise
from unmodeled.models.physics.built_in_shapes import SHAPE_NAMES
from unmodeled.pipeline.cases.case_config import SpacecraftConfig, checked_epoch
from unmodeled.pipeline.cases.known_effects import build_effect
from unmodeled.pipeline.config_errors import translate
from unmodeled.pipeline.config_types import Finite, NonNegative, Positive, Section
from unmodeled.pipeline.learner_config import LearnerConfig
from unmodeled.pipeline.yaml12 import read_yaml

__all__ = [
    "VOLUMES",
    "CharacterizationConfig",
    "DataConfig",
    "FieldConfig",
    "FlightConfig",
    "LearnerConfig",
    "NoiseConfig",
    "load_config",
]

#: Periods of the training orbit and of each extrapolation orbit, [Neamati2022] section IV.B.
VOLUMES = {"low": (10.0, 3.0), "moderate": (100.0, 10.0)}


class OrbitConfig(Section):
    """Initial osculating elements: semi-major axis in Brillouin radii, angles in degrees."""

    semi_major_axis: Positive
    eccentricity: Annotated[float, Field(ge=0, lt=1)]
    inclination: Finite
    node: Finite = 0.0
    periapsis: Finite = 0.0
    true_anomaly: Finite = 0.0


class MassConfig(Section):
    """A point mass in the body: its share of GM, its place in Brillouin radii."""

    share: Finite
    place: tuple[Finite, Finite, Finite]


class FieldConfig(Section):
    """The true field of simulated orbits, where it is not the card's zonal field.

    ``tesseral`` reads a .gfc file, or takes the card's zonals and the tesserals of a built-in
    ``shape``; ``polyhedron`` reads a shape file, or takes a built-in ``shape``; ``mascons`` is a
    list of ``masses``, by default two; ``hidden_masses`` is +-0.1 GM at +-R/2. All turn with the
    card's spin rate; samples are in ``body_fixed`` axes unless ``frame`` is ``inertial``, which
    shows what is lost.
    """

    kind: Literal["tesseral", "polyhedron", "mascons", "hidden_masses"]
    file: str | None = None
    shape: str | None = None
    masses: Annotated[tuple[MassConfig, ...], Field(min_length=1)] | None = None
    scale: Positive | None = None
    degree: Annotated[int, Field(ge=2, le=24)] | None = None
    frame: Literal["body_fixed", "inertial"] = "body_fixed"

    @model_validator(mode="after")
    def _belongs_together(self) -> FieldConfig:
        sources = [name for name in ("file", "shape") if getattr(self, name) is not None]
        if len(sources) != (1 if self.kind in ("tesseral", "polyhedron") else 0):
            given = " and ".join(f"{k} {getattr(self, k)}" for k in sources) or "no file or shape"
            raise ConfigError(
                f"data.field of kind {self.kind} with {given}",
                allowed="a .gfc file for tesseral, a shape file for polyhedron, or for either a "
                f"built-in shape ({', '.join(SHAPE_NAMES)}); none otherwise",
            )
        if self.shape is not None and self.shape not in SHAPE_NAMES:
            raise ConfigError(
                f'data.field.shape is "{self.shape}"',
                allowed=", ".join(SHAPE_NAMES),
                do=nearest(self.shape, SHAPE_NAMES),
            )
        used = {
            "tesseral": ["degree"],
            "polyhedron": ["degree"] if self.shape else ["scale", "degree"],
            "mascons": ["masses"],
            "hidden_masses": [],
        }[self.kind]
        for name in ("scale", "degree", "masses"):
            if getattr(self, name) is not None and name not in used:
                what = f"kind {self.kind}" + (" and a built-in shape" if self.shape else "")
                raise ConfigError(f"data.field.{name} with {what}", do=f"leave {name} out")
        return self


class DataConfig(Section):
    """Where the trajectories come from and how they are cut.

    ``trajectory: simulated`` propagates orbits about the body; a file name (CSV, Parquet, SP3)
    takes its place with that one line. For a file, ``train_periods`` and
    ``extrapolation_periods`` default to 70 % and 30 % of it.

    ``training_orbits`` beyond the first are drawn after all others: those stay what they are.

    ``effects`` act on simulated orbits beside the field: entries as in the list ``known`` of a
    case, pushing ``spacecraft`` from ``epoch``, time zero of all orbits, on. The inertial axes are
    those of the body's equator (of the Earth: ICRF).
    """

    trajectory: str = "simulated"
    field: FieldConfig | None = None
    effects: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)] | None = None
    epoch: str | None = None
    spacecraft: SpacecraftConfig | None = None
    spin: Literal["known", "estimate"] = "known"
    spin_bracket: tuple[Finite, Finite] | None = None
    extrapolation_trajectory: str | None = None
    satellite: str | None = None
    volume: Literal["low", "moderate"] | None = None
    train_periods: Positive | None = None
    extrapolation_periods: Positive | None = None
    samples_per_period: Annotated[int, Field(ge=4)] | None = None
    interpolation_share: Annotated[float, Field(gt=0, le=0.5)] = 0.05
    training_orbits: Annotated[int, Field(ge=1)] = 1
    extrapolation_orbits: Annotated[int, Field(ge=1)] = 1
    orbit: OrbitConfig | None = None
    other_orbits: Annotated[tuple[OrbitConfig, ...], Field(min_length=1)] | None = None
    ranges: dict[str, tuple[Finite, Finite]] = Field(default_factory=dict)
    integrator: Literal["heyoka", "rk4"] = "heyoka"
    rk4_steps_per_period: Annotated[int, Field(ge=1)] = 200

    @field_validator("epoch", mode="before")
    @classmethod
    def _has_scale(cls, given: Any) -> Any:
        return given if given is None else checked_epoch(given, "data.epoch")

    @model_validator(mode="after")
    def _effects_are_known(self) -> DataConfig:
        given = [k for k in ("effects", "epoch", "spacecraft") if getattr(self, k) is not None]
        if self.training_orbits > 1 and (not self.simulated or self.spin == "estimate"):
            raise ConfigError(
                f"data.training_orbits is {self.training_orbits} with "
                + ("spin: estimate" if self.simulated else f"trajectory {self.trajectory}"),
                allowed="1",
                do="leave data.training_orbits out",
            )
        if given and not self.simulated:
            raise ConfigError(
                f"data.{given[0]} with trajectory {self.trajectory}",
                allowed="simulated orbits",
                do=f"leave data.{given[0]} out: measured orbits have their own forces and epoch",
            )
        if self.effects is None:
            return self
        if self.integrator != "heyoka":
            raise ConfigError(
                f"data.effects with integrator {self.integrator}", allowed="integrator heyoka"
            )
        for number, entry in enumerate(self.effects):
            build_effect(entry, f"data.effects.{number}", Path())
        return self

    @model_validator(mode="after")
    def _makes_sense(self) -> DataConfig:
        checked_ranges(self.ranges)
        if self.field is not None and (not self.simulated or self.integrator != "heyoka"):
            raise ConfigError(
                f"data.field with trajectory {self.trajectory} and integrator {self.integrator}",
                allowed="simulated orbits by heyoka",
            )
        if self.spin == "estimate" and (self.field is None or self.field.frame == "inertial"):
            raise ConfigError(
                "data.spin is estimate without a field that turns under body-fixed samples",
                do="give data.field with frame: body_fixed, or leave data.spin out",
            )
        if self.spin_bracket is not None and self.spin != "estimate":
            raise ConfigError(
                "data.spin_bracket with a known spin", do="write data.spin: estimate too"
            )
        if self.simulated and self.extrapolation_trajectory is not None:
            raise ConfigError(
                f"data.extrapolation_trajectory is {self.extrapolation_trajectory} and "
                "data.trajectory is simulated",
                do="give the file of the training orbit as data.trajectory too",
            )
        if self.other_orbits is not None:
            self._check_other_orbits(len(self.other_orbits))
        return self

    def _check_other_orbits(self, count: int) -> None:
        if not self.simulated or self.orbit is None:
            raise ConfigError(
                "data.other_orbits without data.orbit of a simulated trajectory",
                do="give the elements of the training orbit as data.orbit too",
            )
        if self.extrapolation_orbits not in (1, count):
            raise ConfigError(
                f"data.extrapolation_orbits is {self.extrapolation_orbits} and data.other_orbits "
                f"lists {count}",
                do="leave data.extrapolation_orbits out",
            )

    @property
    def simulated(self) -> bool:
        """True if orbits are propagated, False if they are read."""
        return self.trajectory == "simulated"

    def periods(self) -> tuple[float | None, float | None]:
        """Periods for training and for extrapolation; None: as long as the file is."""
        preset: tuple[float | None, float | None] = (None, None)
        if self.volume is not None or self.simulated:
            preset = VOLUMES[self.volume or "low"]
        return self.train_periods or preset[0], self.extrapolation_periods or preset[1]


class NoiseConfig(Section):
    """Standard deviations of the noise of [Neamati2022] Eq. 4, on each axis.

    ``unit: normalised`` counts in Brillouin radii and Kepler periods there, ``unit: si`` in m,
    m/s and m/s2. Only learners with the input ``velocity`` see that of ``velocity``.
    """

    state: NonNegative = 0.0
    acceleration: NonNegative = 0.0
    velocity: NonNegative = 0.0
    unit: Literal["normalised", "si"] = "normalised"
    draws: Literal["independent", "consistent"] = "independent"

    def resolve(self, units: NormalisedUnits) -> Noise:
        """Return the noise in normalised units."""
        si = self.unit == "si"
        return Noise(
            self.state / (units.length if si else 1.0),
            self.acceleration / (units.acceleration if si else 1.0),
            self.draws,
            self.velocity / (units.velocity if si else 1.0),
        )


class FlightConfig(Section):
    """Test point B: the training orbit and up to ``orbits`` others, flown with each model."""

    periods: Annotated[tuple[Positive, ...], Field(min_length=1)] = (1.0, 3.0)
    orbits: Annotated[int, Field(ge=1)] = 3


class CharacterizationConfig(Section):
    """Everything that decides the numbers of one characterisation.

    ``training_check`` trains each learner again without a part of its training data and compares
    it with a bare point mass there; a sweep leaves it out.

    ``training: trajectory_consistent`` trains on an orbit fitted to the noisy positions
    (`trajectory_consistent_fit`) instead of on the samples; that check is left out then.

    Raises
    ------
    ConfigError
        When built by `load_config` or `resolve`: unknown keys (with the nearest name), values out
        of range.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9._-]+$")] = "characterization"
    seed: Annotated[int, Field(ge=0, lt=2**63, strict=True)] = 1
    body: str = "bennu"
    data: DataConfig = DataConfig()
    noise: NoiseConfig = NoiseConfig()
    learners: Annotated[tuple[LearnerConfig, ...], Field(min_length=1)]
    flight: FlightConfig = FlightConfig()
    training_check: bool = True
    training: Literal["samples", "trajectory_consistent"] = "samples"

    @model_validator(mode="after")
    def _labels_differ(self) -> CharacterizationConfig:
        labels = [learner.label for learner in self.learners]
        for label in labels:
            if labels.count(label) > 1:
                raise ConfigError(
                    f'two learners are called "{label}"', do="give each its own label"
                )
        return self

    @model_validator(mode="after")
    def _orbit_fit_knows_one_orbit(self) -> CharacterizationConfig:
        if self.training != "samples" and self.data.training_orbits > 1:
            raise ConfigError(
                f"training is {self.training} and data.training_orbits is "
                f"{self.data.training_orbits}",
                allowed="one training orbit",
            )
        if self.training != "samples" and self.noise.draws != "independent":
            raise ConfigError(
                f"training is {self.training} and noise.draws is {self.noise.draws}",
                allowed="independent: the accelerations are read as a second look at each place",
                do="write training: samples; consistent pairs lie on the true field",
            )
        for learner in self.learners:
            if self.training != "samples" and learner.beyond_position:
                raise ConfigError(
                    f'training is {self.training} and "{learner.label}" has the inputs '
                    + ", ".join(learner.inputs),
                    allowed="the position alone: the orbit is fitted with a field",
                    do="write training: samples",
                )
        return self

    @classmethod
    def resolve(
        cls, content: dict[str, Any], source: str = "configuration"
    ) -> CharacterizationConfig:
        """Validate plain data; every default is filled in."""
        try:
            return cls.model_validate(content)
        except ValidationError as exc:
            raise translate(exc, cls, source) from exc
        except ConfigError as exc:
            raise ConfigError(f"{source}: {exc.found}", allowed=exc.allowed, do=exc.do) from exc

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for YAML and JSON; `resolve` gives the same configuration back."""
        content: dict[str, Any] = json.loads(self.model_dump_json())
        # Keys that were added later are left out at their defaults: older hashes stay the same.
        if self.training == "samples":
            del content["training"]
        if self.data.training_orbits == 1:
            del content["data"]["training_orbits"]
        for key in ("effects", "epoch", "spacecraft"):
            if content["data"][key] is None:
                del content["data"][key]
        if self.noise.velocity == 0:
            del content["noise"]["velocity"]
        content["learners"] = [learner.without_defaults() for learner in self.learners]
        return content

    @property
    def hash(self) -> str:
        """SHA-256 of the resolved configuration: the same meaning gives the same hash."""
        text = json.dumps(self.as_dict(), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


def load_config(path: Path | str, **changes: Any) -> CharacterizationConfig:
    """Read a configuration file.

    Parameters
    ----------
    path : path
        YAML file.
    **changes
        Top-level keys that replace those of the file.
    """
    return CharacterizationConfig.resolve(read_yaml(path) | changes, str(path))
