"""Turn pydantic's findings into one sentence each, with the nearest known name."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from unmodeled.core.errors import ConfigError, nearest

__all__ = ["section_of", "translate"]


def translate(
    error: ValidationError, model: type[BaseModel], source: str, also: tuple[str, ...] = ()
) -> ConfigError:
    """Return a `ConfigError` that names every problem.

    Parameters
    ----------
    error : ValidationError
        What pydantic found.
    model : type
        The model that was validated; its fields give the nearest names.
    source : str
        File name or section, put first.
    also : tuple of str
        Further names that are known at the top of that section.
    """
    problems = error.errors()
    # A list that lost a bad entry is also reported as too short: one finding is enough.
    inside = {tuple(p["loc"][:1]) for p in problems if len(p["loc"]) > 1}
    lines = [
        _sentence(problem, model, also)
        for problem in problems
        if problem["type"] != "too_short" or tuple(problem["loc"]) not in inside
    ]
    return ConfigError(f"{source}: " + "; ".join(lines))


def _sentence(problem: Any, model: type[BaseModel], also: tuple[str, ...]) -> str:
    loc = tuple(problem["loc"])
    path = ".".join(str(part) for part in loc)
    if problem["type"] == "extra_forbidden":
        known = _fields(model, loc[:-1]) + (list(also) if len(loc) == 1 else [])
        return f'unknown key "{path}", {nearest(str(loc[-1]), known)}'
    if problem["type"] == "missing":
        return f'missing key "{path}"'
    message = problem["msg"][0].lower() + problem["msg"][1:]
    shown = repr(problem["input"])
    if len(shown) > 60:
        shown = shown[:57] + "..."
    return f"{path} is {shown}: {message}"


def _fields(model: type[BaseModel], loc: tuple[Any, ...]) -> list[str]:
    """Field names of the section that ``loc`` points to."""
    for part in loc:
        if isinstance(part, str) and part in model.model_fields:
            model = _inside(model.model_fields[part].annotation) or model
    return list(model.model_fields)


def _inside(annotation: Any) -> type[BaseModel] | None:
    """Return the section in a field, or in the list that it holds."""
    found = (_inside(a) for a in get_args(annotation))
    return section_of(annotation) or next((section for section in found if section), None)


def section_of(annotation: Any) -> type[BaseModel] | None:
    """Return the section that a field holds (``X`` or ``X | None``), or None for a value."""
    for a in (annotation, *get_args(annotation)):
        if isinstance(a, type) and issubclass(a, BaseModel):
            return a
    return None
