"""The user's model as a case file names it: entries to effects with values, and back."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

from unmodeled.core.errors import ConfigError, nearest
from unmodeled.core.parameters import Parameter
from unmodeled.datasets.measurement_effect import MeasurementEffect
from unmodeled.datasets.measurement_effects import MEASUREMENT_EFFECTS
from unmodeled.models import physics
from unmodeled.models.physics import Effect, Mesh
from unmodeled.models.physics.gravity_file import read_gravity_field
from unmodeled.models.physics.system import PRIME_MERIDIAN, SPIN_RATE
from unmodeled.pipeline.cases.accepted_values import Surveyed
from unmodeled.pipeline.cases.quantities import parse_quantity, write_quantity
from unmodeled.pipeline.cases.shape_entries import SHAPE_KEYS, mesh_keys, mesh_of, shape_values

__all__ = [
    "AnyEffect",
    "Known",
    "build_effect",
    "effect_names",
    "entry_of",
    "parameter_names",
    "read_known",
]

AnyEffect: TypeAlias = Effect | MeasurementEffect

#: Shorter names of the field for some effects.
ALIASES = {
    "srp": "solar_radiation_pressure",
    "drag": "exponential_drag",
    "relativity": "schwarzschild",
}
#: An entry that holds the parameters of the body's rotation, which belong to no effect.
ROTATION = "rotation"
#: Parameters whose default is a place-holder: they must come from the file, the card or the craft.
_MUST_BE_GIVEN = re.compile(
    r"GM|GM_.*|R_ref|J\d+|[CS]_\d+_\d+|drag_(B|rho0|r0|H)|.*_t0|thrust_t_(on|off)|mascon\d+_[xyz]"
    r"|srp_CrA_m|shadow_radius|sun_radius|tide_k2|power_law_r0|lense_thirring_J"
    r"|occulter_radius|friction_v0|recoil_tau|tide_own_GM"
    r"|tide_day|pole_tide_(m1|m2|x|y)"
    r"|ellipsoid_[abc]|perturber\d+_(GM|a|longitude)"
)


#: A key that stands for several values, by effect: a gravity field, a layer of the atmosphere.
_TABLES = {
    "spherical_harmonics": "file",
    "exponential_drag": "altitude",
    "aerodynamic_lift": "altitude",
}


@dataclass(frozen=True)
class Known:
    """The known model of a case.

    Parameters
    ----------
    effects : tuple of Effect
        Forces.
    values : mapping of str to float
        Their parameters, and those of the rotation if given, SI.
    estimate : mapping of str to float or None
        Free parameters of forces and instruments, with the sigma of their priors.
    instruments : tuple of MeasurementEffect
        Effects of the measurements.
    instrument_values : mapping of str to float
        Their parameters, SI.
    """

    effects: tuple[Effect, ...]
    values: Mapping[str, float]
    estimate: Mapping[str, float | None]
    instruments: tuple[MeasurementEffect, ...] = ()
    instrument_values: Mapping[str, float] | None = None


def effect_names() -> tuple[str, ...]:
    """Names that ``effect:`` takes, sorted; aliases included."""
    names = {*_classes(), ROTATION} | {k for k, v in ALIASES.items() if v in _classes()}
    return tuple(sorted(names))


def read_known(
    entries: Sequence[Mapping[str, Any]], surveyed: Surveyed, folder: Path = Path()
) -> Known:
    """Turn the ``known`` list into effects and values in SI.

    Parameters
    ----------
    entries : sequence of mapping
        Each with ``effect``, the fields of its structure, its parameters (directly or under
        ``values``) and ``free``.
    surveyed : Surveyed
        Where values come from that an entry does not give.
    folder : Path
        Where relative names of gravity fields start.

    Raises
    ------
    ConfigError
        Unknown effect, key or parameter (the nearest is suggested), an effect twice, a value that
        nobody gives, a wrong unit.
    """
    effects: list[Effect] = []
    instruments: list[MeasurementEffect] = []
    values: dict[str, float] = {}
    instrument_values: dict[str, float] = {}
    estimate: dict[str, float | None] = {}
    given: dict[str, float] = {}
    for number, entry in enumerate(entries):
        effect = build_effect(entry, f"known.{number}", folder)
        stated, free = _numbers(entry, effect, f"known.{number}")
        stated = _tabulated(entry, effect, surveyed, folder) | stated
        stated = shape_values(entry, effect, stated) | stated
        for name, value in stated.items():
            if given.setdefault(name, value) != value:
                raise ConfigError(
                    f"known.{number} gives {name} = {value}, an entry before it {given[name]}",
                    do="give it once",
                )
        estimate |= free
        if isinstance(effect, MeasurementEffect):
            if effect in instruments:
                raise ConfigError(
                    f'the instrument effect "{effect.name}" is known twice', do="drop one"
                )
            instruments.append(effect)
            instrument_values |= {p.name: p.value for p in effect.parameters} | stated
        elif effect is not None:
            effects.append(effect)
    for effect in effects:
        for parameter in effect.parameters:
            values[parameter.name] = _value(parameter, effect, given, surveyed, estimate)
    values |= {n: v for n, v in given.items() if n not in values and n not in instrument_values}
    return Known(tuple(effects), values, estimate, tuple(instruments), instrument_values)


def build_effect(
    entry: Mapping[str, Any], where: str = "known", folder: Path | None = None
) -> AnyEffect | None:
    """Return the effect of one entry without numbers; None for the rotation of the body.

    Parameters
    ----------
    entry : mapping
        Of the ``known`` list.
    where : str
        For error texts.
    folder : Path, optional
        Where the files of shapes are; without it a shape is some shape: good for the names of
        its parameters only.

    Raises
    ------
    ConfigError
        If the effect is missing or unknown, or a field is wrong.
    """
    name = entry.get("effect")
    if not isinstance(name, str):
        raise ConfigError(
            f"{where} does not say which effect", do='write e.g. "- {effect: point_mass}"'
        )
    name = ALIASES.get(name, name)
    if name == ROTATION:
        return None
    if name not in _classes():
        raise ConfigError(
            f'{where}: unknown effect "{name}"',
            allowed=", ".join(effect_names()),
            do=nearest(name, effect_names()),
        )
    cls = _classes()[name]
    structure = {f.name for f in fields(cls)}
    chosen = {k: tuple(v) if isinstance(v, list) else v for k, v in entry.items() if k in structure}
    if "mesh" in structure:
        chosen["mesh"] = mesh_of(entry, where, folder)
    missing = [f.name for f in fields(cls) if f.default is MISSING and f.name not in chosen]
    if missing:
        raise ConfigError(f"{where} ({name}) lacks {missing[0]}", do="add it")
    try:
        effect: AnyEffect = cls(**chosen)
    except TypeError as exc:
        raise ConfigError(f"{where} ({name}): {exc}", do="check the types of its keys") from exc
    return effect


def entry_of(
    effect: AnyEffect | None, values: Mapping[str, float], free: Mapping[str, float | None]
) -> dict[str, Any]:
    """Return the entry that `read_known` turns into the same effect, values and freedom.

    Parameters
    ----------
    effect : Effect, MeasurementEffect or None
        None for the rotation of the body.
    values : mapping of str to float
        Parameters to be written, SI.
    free : mapping of str to float or None
        Free ones with the sigma of their priors.
    """
    units = {p.name: p.unit for p in _parameters(effect)}
    entry: dict[str, Any] = {"effect": ROTATION if effect is None else effect.name}
    for f in _structure(effect):
        value = getattr(effect, f.name)
        if isinstance(value, Mesh):
            entry |= mesh_keys(value)
        elif f.default is MISSING or value != f.default:
            entry[f.name] = list(value) if isinstance(value, tuple) else value
    if values:
        entry["values"] = {n: write_quantity(v, units[n]) for n, v in values.items()}
    if free:
        entry["free"] = {
            n: None if sigma is None else write_quantity(sigma, units[n])
            for n, sigma in free.items()
        }
    return entry


def parameter_names(effect: AnyEffect | None) -> tuple[str, ...]:
    """Return the names of an effect's parameters; of the rotation for None."""
    return tuple(p.name for p in _parameters(effect))


@cache
def _classes() -> dict[str, Any]:
    forces = {
        c.name: c
        for c in vars(physics).values()
        if isinstance(c, type) and issubclass(c, Effect) and c is not Effect
    }
    return forces | dict(_instruments())


def _instruments() -> dict[str, Any]:
    return {c.name: c for c in MEASUREMENT_EFFECTS}


def _structure(effect: AnyEffect | None) -> tuple[Field[Any], ...]:
    return () if effect is None else fields(type(effect))  # type: ignore[arg-type]


def _parameters(effect: AnyEffect | None) -> tuple[Parameter, ...]:
    if effect is not None:
        return effect.parameters
    return physics.system.POLE_X, physics.system.POLE_Y, SPIN_RATE, PRIME_MERIDIAN


def _numbers(
    entry: Mapping[str, Any], effect: AnyEffect | None, where: str
) -> tuple[dict[str, float], dict[str, float | None]]:
    """Values that the entry states, and its free parameters."""
    units = {p.name: p.unit for p in _parameters(effect)}
    structure = {f.name for f in _structure(effect)} - {"mesh"}
    own = ROTATION if effect is None else effect.name
    tables = {*SHAPE_KEYS.get(own, ()), *([_TABLES[own]] if own in _TABLES else [])}
    rest = {
        k: v for k, v in entry.items() if k not in {"effect", "values", "free", *tables, *structure}
    }
    inner = entry.get("values", {})
    free = entry.get("free", {})
    if isinstance(free, list | tuple):
        free = dict.fromkeys(free)
    if not isinstance(inner, Mapping) or not isinstance(free, Mapping):
        raise ConfigError(
            f"{where}: values and free are tables",
            do='write e.g. "values: {J2: 0.0193}, free: {J2: 0.001}" or "free: [J2]"',
        )
    known = {*units, *structure, *tables, "values", "free"}
    for name in (*rest, *inner, *free):
        if name not in units:
            raise ConfigError(
                f'{where} ({entry["effect"]}): unknown key "{name}"', do=nearest(str(name), known)
            )
    for name in rest:
        if name in inner:
            raise ConfigError(f"{where} gives {name} twice", do="give it once")
    stated = {n: parse_quantity(v, units[n], f"{where}: {n}") for n, v in {**rest, **inner}.items()}
    sigmas = {
        n: None if v is None else parse_quantity(v, units[n], f"{where}: prior of {n}")
        for n, v in free.items()
    }
    return stated, sigmas


def _tabulated(
    entry: Mapping[str, Any], effect: AnyEffect | None, surveyed: Surveyed, folder: Path
) -> dict[str, float]:
    """Values that a file of the field, or an altitude, stands for."""
    key = None if effect is None else _TABLES.get(effect.name)
    if effect is None or key is None or key not in entry:
        return {}
    if key == "altitude":
        altitude = parse_quantity(entry[key], "m", f"altitude of {effect.name}")
        return surveyed.air(altitude)
    field = read_gravity_field(folder / str(entry[key]))
    values = {"GM": field.gm, "R_ref": field.radius, **field.coefficients}
    names = parameter_names(effect)
    missing = [n for n in names if n not in values]
    if missing:
        raise ConfigError(
            f"{entry[key]} has no {missing[0]}", do="lower degree and order, or take another field"
        )
    return {n: values[n] for n in names}


def _value(
    parameter: Parameter,
    effect: Effect,
    given: Mapping[str, float],
    surveyed: Surveyed,
    estimate: Mapping[str, float | None],
) -> float:
    name = parameter.name
    if name in given:
        return given[name]
    found = surveyed.value(name, effect)
    if found is not None:
        return found
    if _MUST_BE_GIVEN.fullmatch(name) and name not in estimate:
        raise ConfigError(
            f"{effect.name} needs {name} ({parameter.description or parameter.unit}), which "
            f"neither the case nor the card of {surveyed.body.name} gives",
            do=f'write "values: {{{name}: ...{"" if parameter.unit == "1" else " "}'
            f'{"" if parameter.unit == "1" else parameter.unit}}}" at that effect',
        )
    return parameter.value
