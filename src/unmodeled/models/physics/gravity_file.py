"""Gravity fields in ICGEM format (.gfc): normalised coefficients of any body."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from unmodeled.core.errors import DataError

__all__ = ["GravityField", "read_gravity_field", "write_gravity_field"]


@dataclass(frozen=True)
class GravityField:
    """A field as its file states it.

    Parameters
    ----------
    gm : float
        m3/s2.
    radius : float
        Reference radius, m.
    coefficients : dict of str to float
        ``C_n_m`` and, for m > 0, ``S_n_m``; fully normalised.
    errors : dict of str to float
        Formal (or calibrated) standard deviations by the same names, where the file has them.
    """

    gm: float
    radius: float
    coefficients: dict[str, float]
    errors: dict[str, float] = field(default_factory=dict)


def read_gravity_field(path: Path) -> GravityField:
    """Read a static field, the format of [Barthelmes2011].

    Parameters
    ----------
    path : Path
        ``.gfc`` file.

    Raises
    ------
    DataError
        If the file is missing or not text, lacks GM, radius or coefficients, is not fully
        normalised, or a line is damaged. Coefficients that depend on time are refused: their
        epoch would be a guess.
    """
    try:
        lines = path.read_text(encoding="utf-8", errors="strict").splitlines()
    except FileNotFoundError as exc:
        raise DataError(f"there is no gravity field {path}", do="check the path") from exc
    except (OSError, UnicodeDecodeError) as exc:
        raise DataError(f"{path.name} cannot be read ({exc})") from exc
    facts: dict[str, str] = {}
    coefficients: dict[str, float] = {}
    errors: dict[str, float] = {}
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words:
            continue
        if words[0] in ("gfct", "trnd", "acos", "asin"):
            raise DataError(
                f"{path.name}, line {number}: coefficients that depend on time",
                allowed="a static field (gfc)",
                do="take the static model, or the field at one epoch",
            )
        if words[0] != "gfc":
            facts.setdefault(words[0], " ".join(words[1:]))
            continue
        try:
            n, m = int(words[1]), int(words[2])
            c, s = (_number(w) for w in words[3:5])
            # Two columns of errors, where the header says so; of four, the formal ones.
            if facts.get("errors", "no") != "no":
                errors[f"C_{n}_{m}"] = _number(words[5])
                if m:
                    errors[f"S_{n}_{m}"] = _number(words[6])
        except (IndexError, ValueError) as exc:
            raise DataError(f"{path.name}, line {number} is not a coefficient: {line}") from exc
        coefficients[f"C_{n}_{m}"] = c
        if m:
            coefficients[f"S_{n}_{m}"] = s
    norm = facts.get("norm", "fully_normalized")
    if norm != "fully_normalized":
        raise DataError(f"{path.name}: norm is {norm}", allowed="fully_normalized")
    # Fields of other bodies write gravity_constant.
    gm = facts.get("earth_gravity_constant", facts.get("gravity_constant"))
    values = {"gravity constant": gm, "radius": facts.get("radius")}
    numbers = {}
    for name, text in values.items():
        try:
            numbers[name] = _number(str(text))
        except ValueError as exc:
            raise DataError(f"{path.name}: {name} is {text}", allowed="a number") from exc
    if not coefficients:
        raise DataError(f"{path.name} has no coefficients", allowed="lines gfc n m C S")
    return GravityField(numbers["gravity constant"], numbers["radius"], coefficients, errors)


def write_gravity_field(field: GravityField, path: Path, name: str = "unmodeled") -> None:
    """Write a static field in the format of [Barthelmes2011], fully normalised.

    Parameters
    ----------
    field : GravityField
        Numbers are written with 17 digits: `read_gravity_field` gives the same ones back.
    path : Path
        ``.gfc`` file.
    name : str
        Model name in the header, one word.
    """
    pairs = sorted({(int(n), int(m)) for _, n, m in (key.split("_") for key in field.coefficients)})
    lines = [
        "product_type gravity_field",
        f"modelname {name}",
        # The format has this one word for the constant of every body.
        f"earth_gravity_constant {field.gm:.16e}",
        f"radius {field.radius:.16e}",
        f"max_degree {max(n for n, _ in pairs)}",
        f"errors {'formal' if field.errors else 'no'}",
        "norm fully_normalized",
        "tide_system unknown",
        "key L M C S" + (" sigma_C sigma_S" if field.errors else ""),
        "end_of_head",
    ]
    for n, m in pairs:
        names = (f"C_{n}_{m}", f"S_{n}_{m}")
        values = [field.coefficients.get(key, 0.0) for key in names]
        if field.errors:
            values += [field.errors.get(key, 0.0) for key in names]
        lines.append(f"gfc {n:4d} {m:4d} " + " ".join(f"{value:23.16e}" for value in values))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _number(text: str) -> float:
    """Return a number that may be written in the manner of Fortran, 1.5D-3."""
    return float(text.lower().replace("d", "e"))
