"""One learner of a configuration: kind, baseline, inputs and hyperparameters."""

from __future__ import annotations

from functools import cache
from typing import Any, Literal, get_type_hints

from pydantic import BaseModel, ConfigDict, ValidationError, create_model, model_validator

from unmodeled.core.errors import ConfigError
from unmodeled.core.units import NormalisedUnits
from unmodeled.core.words import listed
from unmodeled.models.learned import (
    InputFeatures,
    Learner,
    Residual,
    learner_class,
    learner_names,
)
from unmodeled.pipeline.config_errors import translate
from unmodeled.pipeline.config_types import Positive, Section

__all__ = ["LearnerConfig"]

_KEYS = ("kind", "baseline", "label")
_DECLARING = ("inputs", "phase_period")
_ALONE = ("position",)


class LearnerConfig(Section):
    """One learner: its kind, its baseline, and the hyperparameters of that kind.

    ``baseline: point_mass`` learns what a known point mass leaves; ``none`` learns the raw
    acceleration, as [Neamati2022] does. Learners that contain the mass themselves take none.
    ``inputs`` are those of `InputFeatures`; ``phase_period``, s, is that of the input ``phase``.
    """

    kind: str
    baseline: Literal["point_mass", "none"]
    label: str
    params: dict[str, Any]
    inputs: tuple[str, ...] = _ALONE
    phase_period: Positive | None = None

    @model_validator(mode="before")
    @classmethod
    def _gather(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            raise ConfigError(
                f"a learner is given as {given!r}", allowed="a mapping, e.g. {kind: exact_gp}"
            )
        if "kind" not in given:
            raise ConfigError("a learner without kind", do="add e.g. kind: exact_gp")
        if "params" in given:  # already resolved, as `model_dump` writes it
            if not isinstance(given["params"], dict):
                raise ConfigError(
                    f"params of a learner is {given['params']!r}",
                    allowed="a mapping, e.g. {epochs: 200}",
                )
            given = {k: v for k, v in given.items() if k != "params"} | dict(given["params"])
        cls_ = learner_class(str(given["kind"]))
        if cls_ is Residual:
            raise ConfigError(
                'learner "residual" is chosen by its baseline',
                do="write the kind of what learns the residual, with baseline: point_mass",
            )
        alone = cls_.stands_alone
        baseline = given.get("baseline", "none" if alone else "point_mass")
        if alone and baseline != "none":
            raise ConfigError(
                f'learner "{given["kind"]}" with baseline "{baseline}"',
                allowed="none; it contains the mass itself",
            )
        declared = _declared(given, cls_)
        rest = {k: v for k, v in given.items() if k not in _KEYS and k not in declared}
        try:
            params = _params_model(str(given["kind"])).model_validate(rest).model_dump()
        except ValidationError as exc:
            raise translate(
                exc,
                _params_model(str(given["kind"])),
                f"learner {given['kind']}",
                also=(*_KEYS, *_DECLARING),
            ) from exc
        label = given.get("label") or _title(
            given["kind"], baseline, declared.get("inputs", _ALONE)
        )
        own = {"kind": given["kind"], "baseline": baseline, "label": label, "params": params}
        return own | declared

    @property
    def beyond_position(self) -> tuple[str, ...]:
        """Inputs that are declared beside the position."""
        return self.inputs[1:]

    def features(self, units: NormalisedUnits) -> InputFeatures:
        """Return the inputs, a period of the phase in normalised units."""
        period = None if self.phase_period is None else self.phase_period / units.time
        return InputFeatures(self.inputs, period)

    def without_defaults(self) -> dict[str, Any]:
        """Return plain data; inputs only where they are declared: older hashes stay the same."""
        left_out = {"inputs", "phase_period"} if self.inputs == _ALONE else set()
        if self.phase_period is None:
            left_out.add("phase_period")
        content: dict[str, Any] = self.model_dump(mode="json", exclude=left_out)
        return content

    def build(self) -> Learner:
        """Return the unfitted learner."""
        learner = learner_class(self.kind)(**self.params)
        return Residual(learner) if self.baseline == "point_mass" else learner


def _declared(given: dict[str, Any], cls: type[Learner]) -> dict[str, Any]:
    """Return the checked inputs, where they are declared and are no hyperparameter."""
    own = cls.default_params()
    declared = {k: given[k] for k in _DECLARING if k in given and k not in own}
    if not declared:
        return {}
    where = f'learner "{given["kind"]}"'
    inputs = declared.setdefault("inputs", _ALONE)
    if not isinstance(inputs, list | tuple) or not all(isinstance(name, str) for name in inputs):
        raise ConfigError(
            f"inputs of {where} is {inputs!r}", allowed="a list, e.g. [position, velocity]"
        )
    declared["inputs"] = tuple(inputs)
    try:
        InputFeatures(declared["inputs"], declared.get("phase_period"))
    except TypeError as exc:
        raise ConfigError(
            f"phase_period of {where} is {declared['phase_period']!r}", allowed="seconds, above 0"
        ) from exc
    except ConfigError as exc:
        raise ConfigError(f"{where}: {exc.found}", allowed=exc.allowed, do=exc.do) from exc
    if declared["inputs"] != _ALONE and not cls.takes_features:
        takers = [name for name in learner_names() if learner_class(name).takes_features]
        raise ConfigError(
            f"{where} with inputs {', '.join(inputs)}",
            allowed="position: it learns from that alone",
            do=f"use one of {', '.join(takers)}",
        )
    return declared


def _title(kind: Any, baseline: str, inputs: tuple[str, ...]) -> str:
    """Return the label of a learner that was given none."""
    title = str(kind).replace("_", " ")
    if others := [name.replace("_", " ") for name in inputs[1:]]:
        title += f" with {listed(others)}"  # before the baseline: figures cut labels at their end
    return title + (" on point mass" if baseline == "point_mass" else "")


@cache
def _params_model(kind: str) -> type[BaseModel]:
    """Hyperparameters of a learner as a strict model, made from its ``__init__``."""
    cls = learner_class(kind)
    hints = get_type_hints(cls.__init__)
    fields: dict[str, Any] = {
        name: (hints[name], default) for name, default in cls.default_params().items()
    }
    return create_model(
        f"{cls.__name__}Params",
        __config__=ConfigDict(extra="forbid", allow_inf_nan=False),
        **fields,
    )
