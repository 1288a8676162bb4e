"""The JSON of `compare`: a model that describes and checks what is printed."""

from __future__ import annotations

from typing import TypeAlias

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["ComparisonJson"]

Row: TypeAlias = dict[str, float | int | str | bool | None]


class Part(BaseModel):
    """A part of the answer: nothing more than what is described; null for what is not known."""

    model_config = ConfigDict(extra="forbid")


class FitJson(Part):
    """The orbit fit of the model as given."""

    states: list[list[float]] = Field(description="initial state of each arc, m and m/s")
    values: dict[str, float] = Field(description="free parameters, SI")
    sigmas: dict[str, float | None]
    cost: float = Field(description="sum of squared normalised residuals and prior terms")
    freedom: int
    reduced_chi_square: float
    reduced_window_95: list[float] = Field(description="where it lies for the stated noise alone")
    residual_rms_sigmas: float
    rms: list[Row] = Field(description="a row a component, SI and sigmas")


class WhitenessPart(Part):
    """Whether the residuals are independent noise."""

    coloured: bool
    tests: list[Row] = Field(description="a row a test: arc, label, component, test, p, verdict")


class MapJson(Part):
    """Mean residuals in bins of one variable."""

    variable: str
    statistic: float | None
    freedom: float | None
    p: float | None
    bins: list[Row]


class RhythmJson(Part):
    """The strongest period in the residuals."""

    period_s: float | None
    share: float | None = Field(description="of the variance")
    p: float | None
    span_s: float | None


class ForceJson(Part):
    """The acceleration that would explain the residuals."""

    log_bayes: float | None = Field(description="against no acceleration")
    prior_sigma: float | None
    tau_s: float | None
    step_s: float | None
    known: float | None = Field(description="share of the nodes' freedom that the data decide")
    nodes: list[Row]


class ExplanationJson(Part):
    """What the acceleration looks like."""

    kind: str
    best: str
    curl_free: bool | None
    possible_skill: float | None
    probabilities: dict[str, float | None]
    families: list[Row]


class ComparisonJson(Part):
    """What `unmodeled compare --json` prints."""

    name: str
    body: str
    epoch: str
    revolution_s: float | None
    spin_period_s: float | None
    only_noise: bool
    fit: FitJson
    whiteness: WhitenessPart
    maps: list[MapJson]
    rhythm: RhythmJson
    force: ForceJson
    explanation: ExplanationJson
    seconds: float
