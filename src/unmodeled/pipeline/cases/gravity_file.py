"""Gravity fields in ICGEM format (.gfc): normalised coefficients of any body."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from unmodeled.core.errors import DataError

__all__ = ["GravityField", "read_gravity_field"]


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
    """

    gm: float
    radius: float
    coefficients: dict[str, float]


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
            c, s = (float(w.lower().replace("d", "e")) for w in words[3:5])
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
            numbers[name] = float(str(text).lower().replace("d", "e"))
        except ValueError as exc:
            raise DataError(f"{path.name}: {name} is {text}", allowed="a number") from exc
    if not coefficients:
        raise DataError(f"{path.name} has no coefficients", allowed="lines gfc n m C S")
    return GravityField(numbers["gravity constant"], numbers["radius"], coefficients)
