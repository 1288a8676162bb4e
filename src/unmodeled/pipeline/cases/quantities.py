"""Numbers with their unit, as a case file writes them: ``0.5 m``, ``12 m2``, ``1 d``."""

from __future__ import annotations

import math
import re
from typing import Any

from astropy import units

from unmodeled.core.errors import ConfigError

__all__ = ["parse_quantity", "write_quantity"]

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*\Z")

#: What a unit measures and an example, for error texts.
_KINDS = {
    "m": ("a length", "0.5 m"),
    "s": ("a time", "1 d"),
    "rad": ("an angle", "35.4 deg"),
    "m s-1": ("a velocity", "0.3 mm/s"),
    "m s-2": ("an acceleration", "1e-9 m/s2"),
    "rad s-1": ("a rate of turn", "15 deg/h"),
    "kg": ("a mass", "1500 kg"),
    "m2": ("an area", "12 m2"),
    "m2 kg-1": ("an area for each mass", "0.01 m2/kg"),
    "m3 s-2": ("a gravitational parameter", "4.89 m3/s2"),
    "kg m-3": ("a density", "5e-13 kg/m3"),
}


def parse_quantity(given: Any, unit: str, name: str) -> float:
    """Return a value in SI.

    Parameters
    ----------
    given : object
        What the file says: text such as ``"0.5 km"``, or a bare number where ``unit`` is ``"1"``.
    unit : str
        SI unit wanted, e.g. ``"m"``, ``"m3 s-2"``; ``"1"`` if dimensionless.
    name : str
        For error texts.

    Raises
    ------
    ConfigError
        If the unit is missing, unknown, or measures something else; if the number is not finite.

    Examples
    --------
    >>> parse_quantity("0.5 km", "m", "sigma")
    500.0
    >>> parse_quantity(0.0193, "1", "J2")
    0.0193
    """
    kind, example = _KINDS.get(unit, (f"a quantity in {unit}", f"1 {unit}"))
    if unit == "1":
        kind, example = "a number without unit", "0.0193"
    allowed = f"{kind}, e.g. {example}"
    if isinstance(given, bool) or not isinstance(given, int | float | str):
        raise ConfigError(f"{name} is {given!r}", allowed=allowed)
    if isinstance(given, str):
        match = _NUMBER.match(given)
        if match is None:
            raise ConfigError(f"{name} is {given!r}", allowed=allowed)
        value, written = float(match[1]), match[2]
    else:
        value, written = float(given), ""
    if not math.isfinite(value):
        raise ConfigError(f"{name} is {given}", allowed=allowed)
    if not written:
        if unit == "1":
            return value
        raise ConfigError(f"{name} is {given} without a unit", allowed=allowed, do="write the unit")
    try:
        found = units.Unit(written)
    except (ValueError, TypeError) as exc:
        raise ConfigError(
            f'{name} is "{given}": unknown unit "{written}"', allowed=allowed
        ) from exc
    try:
        # The factor, not the value, is converted: a value in SI stays to the last digit.
        factor = float(found.to(units.Unit(unit)))
    except units.UnitConversionError as exc:
        raise ConfigError(f"{name} is {given}", allowed=allowed) from exc
    return value * factor


def write_quantity(value: float, unit: str) -> str | float:
    """Return what `parse_quantity` reads back to the last digit.

    Examples
    --------
    >>> write_quantity(4.89, "m3 s-2"), write_quantity(0.0193, "1")
    ('4.89 m3 s-2', 0.0193)
    """
    return float(value) if unit == "1" else f"{float(value)!r} {unit}"
