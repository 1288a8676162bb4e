"""What a run is, in one form: equal meanings give equal bytes, and the bytes give the run's id."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import Any

from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.simulation import gravity_of
from unmodeled.models.physics import Effect
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.extra_effects import extra_effects
from unmodeled.pipeline.prepare import SAMPLES_PER_PERIOD, find_trajectory

__all__ = ["canonical", "cell_id", "digest", "run_id"]

#: Part of every id: raise it when the same configuration starts to give other numbers.
_FORMAT = 1
_LENGTH = 32


def canonical(
    config: CharacterizationConfig, *, flights: bool = False, folders: Sequence[Path] = ()
) -> dict[str, Any]:
    """Return what decides the numbers of a run, as plain data.

    Presets are replaced by what they stand for (``data.volume: low`` by its periods), names of a
    body or a file by a digest of their content; labels, and keys that change nothing in this run
    (the ranges of elements that are given, the unit of noise that is zero), are left out.

    Parameters
    ----------
    config : CharacterizationConfig
        Resolved configuration.
    flights : bool
        Whether orbits are flown with the learned model.
    folders : sequence of Path
        Where trajectory files are looked for.

    Raises
    ------
    InputError
        If the body or the trajectory file cannot be read.
    """
    content = config.as_dict()
    del content["name"], content["training_check"]  # a sweep does not make that check
    content["body"] = _body_digest(config.body)
    for learner in content["learners"]:
        del learner["label"]
    _settle_data(content["data"], config, folders)
    if (found := extra_effects(config, load_body(config.body), folders)) is not None:
        structure = [_structure(effect) for effect in found.effects]
        content["data"]["effects"] = [structure, sorted(found.values.items())]
        content["data"].pop("spacecraft", None)  # its numbers are in the values
    noise = content["noise"]
    if noise["state"] == 0:
        del noise["draws"]  # independent or not: there is no position error
        if noise["acceleration"] == 0 and "velocity" not in noise:
            del noise["unit"]
    if not flights:
        del content["flight"]
    return content | {"format": _FORMAT}


def run_id(content: dict[str, Any]) -> str:
    """Return the id of a run from its `canonical` form: 32 hexadecimal digits."""
    return digest(content)


def cell_id(content: dict[str, Any]) -> str:
    """Return what a run shares with the other initial conditions of its cell."""
    data = {k: v for k, v in content["data"].items() if k not in ("orbit", "other_orbits")}
    learners = [
        spec | {"params": {k: v for k, v in spec["params"].items() if k != "random_state"}}
        for spec in content["learners"]
    ]
    shared = {k: v for k, v in content.items() if k != "seed"}
    return digest(shared | {"data": data, "learners": learners})


def digest(content: Any) -> str:
    """Return 32 hexadecimal digits of plain data.

    Examples
    --------
    >>> digest({"a": 1.0, "b": 2}) == digest({"b": 2, "a": 1.0})
    True
    """
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def _settle_data(data: dict[str, Any], config: CharacterizationConfig, folders: Any) -> None:
    del data["volume"]
    if data["spin"] == "known":  # ids from before these keys stay
        del data["spin"], data["spin_bracket"]
    data["train_periods"], data["extrapolation_periods"] = config.data.periods()
    if not config.data.simulated:
        del data["field"]
        for key in ("trajectory", "extrapolation_trajectory"):
            if data[key] is not None:
                data[key] = _file_digest(find_trajectory(data[key], folders))
        return
    if data["field"] is None:
        del data["field"]  # ids of zonal runs stay what they were
    else:
        _settle_field(data["field"], config, folders)
    if data["samples_per_period"] is None:
        data["samples_per_period"] = SAMPLES_PER_PERIOD
    if data["integrator"] == "heyoka":
        del data["rk4_steps_per_period"]
    if data["other_orbits"] is not None:
        del data["extrapolation_orbits"]
        if config.data.training_orbits == 1:  # nothing is drawn
            del data["ranges"]


def _structure(effect: Effect) -> dict[str, Any]:
    """Return what an effect is beside its numbers; 1 and 1.0 are the same."""
    held = {f.name: getattr(effect, f.name) for f in fields(effect)}  # type: ignore[arg-type]
    return {"effect": effect.name} | {
        k: repr(float(v) if type(v) is int else v) for k, v in held.items()
    }


def _settle_field(field: dict[str, Any], config: CharacterizationConfig, folders: Any) -> None:
    field["spin_rate"] = load_body(config.body).spin_rate
    for key in ("shape", "masses"):  # ids of fields from before these keys stay
        if field[key] is None:
            del field[key]
    if field["file"] is not None:
        field["file"] = _file_digest(find_trajectory(field["file"], folders, "data.field.file"))


@lru_cache(maxsize=32)
def _body_digest(name: str) -> str:
    body = load_body(name)
    field = gravity_of(body)
    return digest([body.brillouin_radius, sorted(field.values.items())])


def _file_digest(path: Path) -> str:
    status = path.stat()
    return _content_digest(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=256)
def _content_digest(path: Path, modified: int, size: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:_LENGTH]
