"""The nested sections of a body card, in the units that their keys name."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from unmodeled.core.errors import ConfigError, UnmodeledError, nearest
from unmodeled.core.kepler_orbit import HeliocentricOrbit
from unmodeled.core.pole import Pole
from unmodeled.datasets.atmosphere import Atmosphere, Layer

__all__ = ["read_sections"]

_Part = TypeVar("_Part")


def read_sections(card: Mapping[str, Any], path: str) -> dict[str, Any]:
    """Turn the sections ``pole``, ``heliocentric_orbit`` and ``atmosphere`` into their objects.

    Keys of ``pole``: right_ascension_deg, declination_deg, prime_meridian_deg (0 if left out).
    Keys of ``heliocentric_orbit``: epoch, semi_major_axis_au, eccentricity, inclination_deg,
    node_deg, perihelion_deg, mean_anomaly_deg. ``atmosphere`` is a list of rows
    [altitude in m, density in kg/m3, scale height in m].

    Parameters
    ----------
    card : mapping
        The whole card.
    path : str
        For messages.

    Returns
    -------
    dict
        A copy with the sections replaced; the other keys as they are.

    Raises
    ------
    ConfigError
        If a section is no table, a key is unknown or missing, or a value is refused.
    """
    out = dict(card)
    readers: dict[str, Callable[[Any, str], Any]] = {
        "pole": lambda v, where: _fill(Pole.from_degrees, v, where),
        "heliocentric_orbit": lambda v, where: _fill(HeliocentricOrbit.from_degrees, v, where),
        "atmosphere": _atmosphere,
    }
    for key, reader in readers.items():
        if out.get(key) is not None:
            out[key] = reader(out[key], f"card {path}, {key}")
    return out


def _fill(make: Callable[..., _Part], section: Any, where: str) -> _Part:
    wanted = inspect.signature(make).parameters
    if not isinstance(section, Mapping):
        raise ConfigError(f"{where} is {section!r}", allowed="a table of " + ", ".join(wanted))
    for key in section:
        if key not in wanted:
            raise ConfigError(
                f'{where} has an unknown key "{key}"', do=nearest(str(key), list(wanted))
            )
    for key, parameter in wanted.items():
        if key not in section and parameter.default is inspect.Parameter.empty:
            raise ConfigError(f'{where} lacks the key "{key}"', do="add it")
    values = {
        k: str(v) if k == "epoch" else _number(v, f"{where}: {k}") for k, v in section.items()
    }
    try:
        return make(**values)
    except UnmodeledError as exc:
        # The part knows what is wrong, the card where.
        raise ConfigError(f"{where}: {exc}") from exc


def _atmosphere(rows: Any, where: str) -> Atmosphere:
    if not isinstance(rows, list) or not all(isinstance(r, list) and len(r) == 3 for r in rows):
        raise ConfigError(
            f"{where} is not a list of rows of three",
            allowed="[[altitude in m, density in kg/m3, scale height in m], ...]",
        )
    try:
        return Atmosphere(tuple(Layer(*(_number(v, where) for v in row)) for row in rows))
    except UnmodeledError as exc:
        raise ConfigError(f"{where}: {exc}") from exc


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ConfigError(f"{where} is {value!r}", allowed="a finite number")
    return float(value)
