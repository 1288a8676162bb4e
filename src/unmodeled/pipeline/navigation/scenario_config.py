"""What a file of ``scenarios/`` may say about a flight that filters are tried on."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, ValidationError, model_validator

from unmodeled.core.errors import ConfigError, nearest
from unmodeled.pipeline.config_errors import translate
from unmodeled.pipeline.config_types import Finite, NonNegative, Positive, Section
from unmodeled.pipeline.yaml12 import read_yaml

__all__ = [
    "KINDS",
    "CislunarConfig",
    "CraftConfig",
    "FormationConfig",
    "ScenarioConfig",
    "SmallBodyConfig",
    "load_scenario",
    "resolve_scenario",
]

Triple = tuple[Finite, Finite, Finite]


class ElementsConfig(Section):
    """Osculating elements at the epoch."""

    semi_major_axis_km: Positive
    eccentricity: Annotated[float, Field(ge=0, lt=1)]
    inclination_deg: Finite
    node_deg: Finite = 0.0
    periapsis_deg: Finite = 0.0
    true_anomaly_deg: Finite = 0.0


class CraftConfig(Section):
    """What sunlight and air see of a spacecraft."""

    mass_kg: Positive = 100.0
    area_m2: NonNegative
    drag_coefficient: NonNegative = 3.0
    reflectivity: NonNegative = 1.2


class MeasuredConfig(Section):
    """What is measured: one sigma on each axis; velocity sigma 0 means positions only."""

    step_s: Positive
    position_m: Positive
    velocity_m_s: NonNegative = 0.0


class ReferenceConfig(Section):
    """How a formation's filter knows the target's orbit; the last two for ``measured``.

    ``position_m``: sigma on each inertial axis. ``order``: of the backward difference that gives
    velocities; 1 is that of [Marchese2023].
    """

    source: Literal["known", "integrated", "measured"] = "known"
    position_m: NonNegative = 0.1
    order: Literal[1, 2] = 2


class StartConfig(Section):
    """Standard deviations of the first guess, and those that the filter believes."""

    position_m: Positive
    velocity_m_s: Positive
    believed_factor: Positive = 1.0


class Common(Section):
    """Keys of every scenario."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9._-]+$")]
    seed: Annotated[int, Field(ge=0, lt=2**63, strict=True)] = 1
    runs: Annotated[int, Field(ge=1)] = 20
    filters: Annotated[tuple[str, ...], Field(min_length=1)]
    tuning: dict[str, dict[str, float]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _filters_differ(self) -> Common:
        for name in self.filters:
            if self.filters.count(name) > 1:
                raise ConfigError(f'filter "{name}" is listed twice', allowed="each filter once")
        return self

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for YAML and JSON."""
        content: dict[str, Any] = json.loads(self.model_dump_json())
        return content

    @property
    def hash(self) -> str:
        """SHA-256 of the resolved scenario."""
        text = json.dumps(self.as_dict(), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


class FormationConfig(Common):
    """Two spacecraft in low Earth orbit, each propagated by itself.

    ``settle_s``: errors count from there. ``gap_orbits``: first and last orbit without
    measurements. ``reference``: how the target's orbit, about which the nonlinear model and the
    PINN's physics are written, is known: exactly, integrated under J2 from its start, or from
    its measured positions.
    """

    kind: Literal["formation"]
    epoch: str = "2000-01-01T12:00:00 TDB"
    orbit: ElementsConfig
    chaser_true_anomaly_deg: Finite
    target: CraftConfig
    chaser: CraftConfig
    truth: Literal["full", "j2"] = "full"
    degree: Annotated[int, Field(ge=2, le=20)] = 5
    duration_s: Positive
    measured: MeasuredConfig
    start: StartConfig
    reference: ReferenceConfig = Field(default_factory=lambda: ReferenceConfig())
    settle_s: NonNegative
    gap_orbits: tuple[NonNegative, NonNegative] | None = None


class CislunarConfig(Common):
    """A spacecraft near the Moon, range and range rate from the barycentre.

    Everything in units of the Earth-Moon distance and 1 / its mean motion, as [Fereoli2024].
    """

    kind: Literal["cislunar"]
    position: Triple
    velocity: Triple
    mass_share: Annotated[float, Field(gt=0, le=0.5)] = 0.012150584269542
    push: NonNegative = 3.33e-7
    steps: Annotated[int, Field(ge=10)]
    step: Positive
    range_sigma: Positive = 1e-8
    rate_sigma: Positive = 1e-5
    start_sigma: tuple[NonNegative, NonNegative] = (1e-6, 1e-4)
    disturbance_sigma: Positive = 0.1
    time_constant: Positive = 1.0
    settle: Annotated[float, Field(ge=0, lt=1)] = 0.1


class TransferConfig(Section):
    """A known impulse along the track to another semi-major axis, then ``coast_s`` without data."""

    at_s: Positive
    semi_major_axis_km: Positive
    coast_s: Positive


class SmallBodyConfig(Common):
    """A spacecraft about a small body of which only the mass is known.

    Positions are measured; a gap follows, then a transfer to a lower orbit and a second gap. What
    a filter has learned before must carry it through both.
    """

    kind: Literal["small_body"]
    body: str
    tesserals: dict[str, Finite] = Field(default_factory=dict)
    spins: bool = False
    mass_error: Finite = 0.0
    orbit: ElementsConfig
    duration_s: Positive
    measured: MeasuredConfig
    start: StartConfig
    settle_s: NonNegative
    gap_s: tuple[NonNegative, NonNegative]
    transfer: TransferConfig


ScenarioConfig: TypeAlias = FormationConfig | CislunarConfig | SmallBodyConfig
KINDS: dict[str, type[Common]] = {
    "formation": FormationConfig,
    "cislunar": CislunarConfig,
    "small_body": SmallBodyConfig,
}


def resolve_scenario(content: dict[str, Any], source: str = "scenario") -> ScenarioConfig:
    """Validate plain data; every default is filled in.

    Raises
    ------
    ConfigError
        Unknown keys (with the nearest name), missing keys, values out of range.
    """
    kind = content.get("kind")
    if kind is None:
        do = "name the kind of scenario: kind: " + ", ".join(KINDS)
        if "learners" in content or "body" in content:
            do += "; a characterisation is run with: unmodeled characterize"
        raise ConfigError(f"{source}: no kind", do=do)
    if kind not in KINDS:
        raise ConfigError(f'{source}: kind "{kind}"', do=nearest(str(kind), KINDS))
    model = KINDS[str(kind)]
    try:
        found = model.model_validate(content)
    except ValidationError as exc:
        raise translate(exc, model, source) from exc
    except ConfigError as exc:
        raise ConfigError(f"{source}: {exc.found}", allowed=exc.allowed, do=exc.do) from exc
    assert isinstance(found, FormationConfig | CislunarConfig | SmallBodyConfig)
    return found


def load_scenario(path: Path | str, **changes: Any) -> ScenarioConfig:
    """Read a scenario file; keyword arguments replace its top-level keys."""
    return resolve_scenario(read_yaml(path) | changes, str(path))
