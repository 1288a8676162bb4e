"""The axes of a grid: which keys vary, and over which values."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import BaseModel

from unmodeled.core.errors import ConfigError, nearest
from unmodeled.datasets.elements import ELEMENT_NAMES
from unmodeled.pipeline.config import CharacterizationConfig
from unmodeled.pipeline.config_errors import section_of

__all__ = ["combinations", "known_keys", "parse_axes", "put", "spaced"]

# A point such as 0.1 * 3 is 0.30000000000000004: rounded, it is the 0.3 that a list would say.
_DIGITS = 12
_SPACINGS = ("linspace", "logspace")
_HOW = "a list of values, {linspace: [first, last, count]} or {logspace: [first, last, count]}"


def parse_axes(content: Any, source: str) -> dict[str, tuple[Any, ...]]:
    """Return the values of each axis of one grid, in the order of the file.

    Parameters
    ----------
    content : mapping
        Keys of the configuration with dots (``noise.state``), ``learner``, or ``learner.NAME``
        for a hyperparameter; each with a list, ``{linspace: [first, last, count]}`` or
        ``{logspace: [first, last, count]}``.
    source : str
        File name, for errors.

    Raises
    ------
    ConfigError
        Unknown key (with the nearest one), no values, a value given twice.
    """
    if not isinstance(content, Mapping):
        raise ConfigError(f"{source}: axes is {content!r}", allowed="a mapping of keys to values")
    axes = {}
    for key, values in content.items():
        _check_key(str(key), source)
        axes[str(key)] = _values(str(key), values, source)
    return axes


def combinations(axes: Mapping[str, Sequence[Any]]) -> Iterator[dict[str, Any]]:
    """Yield one mapping of keys to values for each point of the grid, the last axis fastest."""
    for point in itertools.product(*axes.values()):
        yield dict(zip(axes, point, strict=True))


def spaced(kind: str, first: float, last: float, count: int) -> tuple[float, ...]:
    """Return evenly (``linspace``) or by equal factors (``logspace``) spaced values.

    Both ends are values and are included; twelve significant digits are kept.

    Examples
    --------
    >>> spaced("linspace", 0, 1, 5)
    (0.0, 0.25, 0.5, 0.75, 1.0)
    >>> spaced("logspace", 1e-3, 1, 4)
    (0.001, 0.01, 0.1, 1.0)
    """
    space = np.linspace if kind == "linspace" else np.geomspace
    return tuple(float(f"{v:.{_DIGITS}g}") for v in space(first, last, count))


def known_keys() -> list[str]:
    """Return every key that can be an axis."""
    return [
        "learner",
        *_paths(CharacterizationConfig, ""),
        *(f"data.ranges.{name}" for name in ELEMENT_NAMES),
    ]


def put(content: dict[str, Any], key: str, value: Any) -> None:
    """Set a key with dots in nested mappings."""
    *sections, last = key.split(".")
    for section in sections:
        content = content.setdefault(section, {})
    content[last] = value


def _paths(model: type[BaseModel], prefix: str) -> Iterator[str]:
    for name, field in model.model_fields.items():
        if (prefix + name) in ("name", "learners", "data.ranges", "data.other_orbits"):
            continue
        inner = section_of(field.annotation)
        if inner is None:
            yield prefix + name
        else:
            yield from _paths(inner, f"{prefix}{name}.")


def _check_key(key: str, source: str) -> None:
    known = known_keys()
    if key in known or (key.startswith("learner.") and key.count(".") == 1):
        return
    raise ConfigError(
        f'{source}: unknown axis "{key}"',
        do=nearest("learner" if key == "learners" else key, [*known, "learner.HYPERPARAMETER"]),
    )


def _values(key: str, given: Any, source: str) -> tuple[Any, ...]:
    if isinstance(given, Mapping) and len(given) == 1 and next(iter(given)) in _SPACINGS:
        values: tuple[Any, ...] = _spacing(key, *next(iter(given.items())), source)
    elif isinstance(given, list | tuple):
        values = tuple(given)
    else:
        raise ConfigError(f"{source}: axis {key} is {given!r}", allowed=_HOW)
    if not values:
        raise ConfigError(
            f"{source}: axis {key} has no values: the grid is empty",
            do="give it values, or leave the axis out",
        )
    seen = set()
    for value in values:
        text = json.dumps(float(value) if _is_number(value) else value, sort_keys=True, default=str)
        if text in seen:
            raise ConfigError(f"{source}: axis {key} has the value {value!r} twice")
        seen.add(text)
    return values


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _spacing(key: str, kind: str, given: Any, source: str) -> tuple[float | int, ...]:
    where = f"{source}: axis {key}, {kind}: {given!r}"
    if not (
        isinstance(given, list | tuple)
        and len(given) == 3
        and all(_is_number(v) and math.isfinite(v) for v in given)
        and isinstance(given[2], int)
    ):
        raise ConfigError(where, allowed="[first, last, count]")
    first, last, count = given
    if count < 2:
        raise ConfigError(f"{where}: {count} values", allowed="2 or more")
    if kind == "logspace" and not (first > 0 and last > 0):
        raise ConfigError(
            where,
            allowed="first and last above 0",
            do="give the ends as values, not as exponents: [1e-3, 1, 4]",
        )
    values = spaced(kind, first, last, count)
    if isinstance(first, int) and isinstance(last, int) and all(v.is_integer() for v in values):
        return tuple(int(v) for v in values)
    return values
