"""The JSON of `diagnose`, `add` and `compare`: models that describe and check what is printed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from unmodeled.core.errors import ConfigError, nearest
from unmodeled.pipeline.comparison.schema import ComparisonJson

__all__ = ["AdditionJson", "DiagnosisJson", "as_text", "json_schema"]


class Part(BaseModel):
    """A part of the answer: nothing more than what is described; null for what is not known."""

    model_config = ConfigDict(extra="forbid")


class EstimateJson(Part):
    """One estimated parameter."""

    name: str
    value: float = Field(description="estimate, in the unit")
    sigma: float | None = Field(description="standard deviation with the noise as found")
    unit: str = Field(description="SI unit; 1 if dimensionless")
    expected: float = Field(description="size that was expected before looking")
    accepted: float | None = Field(description="accepted value, null if there is none")
    pull: float | None = Field(description="distance from the accepted value, sigmas of both")


class RivalJson(Part):
    """Another effect that explains the same residuals nearly as well."""

    name: str
    title: str
    correlation: float = Field(description="cosine of both signals after the fit")
    odds: float | None = Field(description="Bayes factor of the finding against it")
    probability: float = Field(description="chance to tell them apart with these data")


class FindingJson(Part):
    """One effect that is missing."""

    effect: str = Field(description="name that `unmodeled add` takes")
    title: str
    family: str
    class_: list[str] = Field(
        alias="class", description="effects these data cannot tell apart, itself first"
    )
    parameters: list[EstimateJson]
    place: list[EstimateJson] = Field(
        description="where or when it acts, if that was searched; expected is the search's step"
    )
    delta_chi_square: float = Field(description="rise of chi-square without it, stated sigmas")
    threshold: float = Field(description="what delta_chi_square had to exceed")
    log10_p: float | None = Field(description="p-value of its F-test, one candidate")
    ln_evidence: float | None = Field(description="ln of the Bayes factor beside the others found")
    confidence: float = Field(description="probability that the label is right within the class")
    rivals: list[RivalJson]
    consistency_p: float | None = Field(description="agreement of the arcs; null for one arc")
    largest_change_in_sigmas: float = Field(
        description="of an estimate when one twelfth of the time is left out"
    )
    remarks: list[str]


class AlternativeJson(Part):
    """Another set of effects that explains as much, in place of all findings together."""

    effects: list[str]
    titles: list[str]
    odds: float | None = Field(description="Bayes factor of the findings against it")
    delta_chi_square: float = Field(description="fall of chi-square with it, stated sigmas")


class DismissedJson(Part):
    """An effect that was taken out again, because what remains is not white."""

    effect: str
    title: str
    delta_chi_square: float = Field(description="rise of chi-square without it, stated sigmas")
    strength_in_sigmas: float = Field(
        description="its significance if only whole stretches of time are independent"
    )


class ForecastJson(Part):
    """What the residual RMS of the held-out arcs should be, stated sigmas."""

    before: float = Field(description="without what was found, if the estimates are right")
    after: float = Field(description="with it, from the noise and the covariance of the estimates")
    log10_p: float | None = Field(
        description="chance of residuals as large as those seen if model and covariance are right"
    )


class StepJson(Part):
    """One bar of the waterfall."""

    added: str = Field(description="effects added in this step, empty for the model as given")
    rms: float = Field(description="residual RMS on the fitted arcs, sigmas")
    held_out_rms: float | None = Field(description="the same on the held-out arcs, if any")


class WhitenessJson(Part):
    """One test of what is left."""

    arc: str
    label: str
    component: str
    test: str
    statistic: float | None
    freedom: float | None
    lags: float | None
    p: float | None
    verdict: str


class DetectableJson(Part):
    """The least that these data would have shown."""

    name: str
    parameter: str
    smallest_detectable: float | None = Field(description="with 90 % power, in the unit")
    unit: str


class FurtherJson(Part):
    """Further data that would tell two effects apart."""

    finding: str
    rival: str
    data: str = Field(description="the arc to be added to the data at hand")
    correlation: float | None = Field(description="of both signals in all data together")
    probability: float | None = Field(description="chance to tell them apart then")


class RemainderJson(Part):
    """What no effect of the catalogue explains: its kind, and a model learned of it."""

    kind: str = Field(description="in words")
    sentence: str
    depends_on: str = Field(description="its inputs in words")
    inputs: list[str]
    axes: Literal["inertial", "body", "sun", "rtn"] = Field(description="of its components")
    alternatives: list[str] = Field(description="other inputs that these data cannot tell from it")
    period_s: float | None = Field(description="s; null if it does not repeat by itself")
    curl_free: bool | None = Field(description="null: no field, or it cannot be told")
    most_like: str | None = Field(description="the known kind that describes it as well, if any")
    learner: str | None
    learned: bool = Field(description="skill is above zero by two standard errors")
    carries: bool = Field(description="so is held_out_skill; false without held-out arcs")
    skill: float | None = Field(description="share of left-out stretches it predicts; 0 is none")
    skill_error: float | None = Field(description="its standard error")
    possible_skill: float = Field(description="what noise allows")
    residual_rms_before: float = Field(description="fitted arcs, without the learned force")
    residual_rms_after: float = Field(description="with it, one linear step")
    held_out_rms_before: float | None
    held_out_rms_after: float | None
    held_out_skill: float | None
    held_out_skill_error: float | None
    file: str | None = Field(description="of the run folder: the learner")


class DiagnosisJson(Part):
    """What `unmodeled diagnose --json` prints. RMS are in stated sigmas."""

    case: str
    verdict: Literal["found", "ambiguous", "outside the catalogue", "nothing missing"]
    sentence: str
    found: list[FindingJson]
    alternatives: list[AlternativeJson] = Field(
        description="sets beyond exchanging a finding by one of its rivals, likeliest first"
    )
    dismissed: list[DismissedJson]
    residual_rms_before: float
    residual_rms_after: float
    held_out_rms_before: float | None
    held_out_rms_after: float | None
    held_out_forecast: ForecastJson | None = Field(description="null without held-out arcs")
    noise: float = Field(description="standard deviation of what is left, stated sigmas")
    remainder_log10_p: float | None = Field(
        description="p-value of a free acceleration in what is left"
    )
    imitation: bool = Field(
        description="so many effects at once rather imitate one force that the catalogue lacks"
    )
    within_stated_noise: bool = Field(
        description="what is left is not white, but the noise as stated covers it"
    )
    waterfall: list[StepJson]
    whiteness: list[WhitenessJson]
    smallest_detectable: list[DetectableJson]
    further_data: list[FurtherJson]
    remainder: RemainderJson | None = Field(
        description="null unless the verdict is outside the catalogue"
    )
    seconds: float


class DataJson(Part):
    """Residual RMS of one data set."""

    label: str
    unit: str
    before: float = Field(description="RMS without the effect, in the unit")
    after: float = Field(description="RMS with it, in the unit")
    before_in_sigmas: float
    after_in_sigmas: float
    count: int = Field(description="components used")


class AdditionJson(Part):
    """What `unmodeled add --json` prints. RMS are in stated sigmas."""

    case: str
    effect: str
    title: str
    family: str
    parameters: list[EstimateJson]
    delta_chi_square: float = Field(description="by how much chi-square fell")
    residual_rms_before: float
    residual_rms_after: float
    held_out_rms_before: float | None
    held_out_rms_after: float | None
    data: list[DataJson]
    next_case: str | None = Field(default=None, description="path of the case file written")


#: The commands and the model of what they print.
_MODELS: Mapping[str, type[BaseModel]] = {
    "compare": ComparisonJson,
    "diagnose": DiagnosisJson,
    "add": AdditionJson,
}


def json_schema(command: str) -> dict[str, Any]:
    """Return the JSON Schema of what a command prints with ``--json``.

    Raises
    ------
    ConfigError
        If the command has none.
    """
    if command not in _MODELS:
        raise ConfigError(
            f'no schema for "{command}"', allowed=", ".join(_MODELS), do=nearest(command, _MODELS)
        )
    return _MODELS[command].model_json_schema(mode="serialization")


def as_text(command: str, content: Mapping[str, Any]) -> str:
    """Return the JSON text of an answer, checked against its schema; NaN and infinity are null."""
    checked = _MODELS[command].model_validate(dict(content))
    return checked.model_dump_json(indent=2, by_alias=True)
