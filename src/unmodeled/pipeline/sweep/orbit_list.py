"""The shared list of collision-free initial conditions: drawn once, stored, the same for all."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from unmodeled.core.errors import DataError
from unmodeled.core.seeds import Streams
from unmodeled.datasets.bodies import load_body
from unmodeled.datasets.elements import ELEMENT_NAMES
from unmodeled.datasets.initial_conditions import collision_free
from unmodeled.datasets.simulation import gravity_of

__all__ = ["OrbitList", "draw_orbits", "read_orbits"]

_INDEX = ["initial_condition", "orbit"]
_COLUMNS = [*_INDEX, *ELEMENT_NAMES]


@dataclass(frozen=True)
class OrbitList:
    """Initial conditions of many runs: a training orbit and its extrapolation orbits each.

    Parameters
    ----------
    elements : DataFrame
        Columns ``initial_condition`` (0, 1, ...), ``orbit`` (0: training, then extrapolation)
        and the elements: semi-major axis in Brillouin radii, angles in degrees.
    facts : dict
        How it was drawn: body, seed, ranges, screening.
    """

    elements: pd.DataFrame
    facts: dict[str, object]

    def __len__(self) -> int:
        return int(self.elements["initial_condition"].max()) + 1

    @property
    def others(self) -> int:
        """Extrapolation orbits of each initial condition."""
        return len(self.elements) // len(self) - 1

    @property
    def hash(self) -> str:
        """SHA-256 of the elements to the last digit."""
        return hashlib.sha256(_text(self.elements).encode()).hexdigest()

    @cached_property
    def orbits(self) -> tuple[tuple[dict[str, float], ...], ...]:
        """Elements by initial condition: the training orbit, then the others."""
        rows = self.elements[list(ELEMENT_NAMES)].to_dict(orient="records")
        each = [{str(k): float(v) for k, v in row.items()} for row in rows]
        width = 1 + self.others
        return tuple(tuple(each[k : k + width]) for k in range(0, len(each), width))

    def first(self, count: int) -> OrbitList:
        """Return the list of the first ``count`` initial conditions."""
        kept = self.elements[self.elements["initial_condition"] < count]
        return OrbitList(kept.reset_index(drop=True), self.facts)

    def write(self, path: Path) -> None:
        """Write it as CSV under one comment line with the facts and the hash."""
        head = json.dumps(self.facts | {"sha256": self.hash}, sort_keys=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
        temporary.write_text(f"# {head}\n{_text(self.elements)}")
        temporary.replace(path)


def draw_orbits(
    body: str,
    count: int,
    *,
    seed: int,
    others: int = 1,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    periods: float,
) -> OrbitList:
    """Draw a list; the list for a smaller ``count`` is the beginning of that for a larger one.

    Parameters
    ----------
    body : str
        Body card; its field decides which orbits collide.
    count : int
        Number of initial conditions.
    seed : int
        Of the list alone.
    others : int
        Extrapolation orbits of each.
    ranges : mapping, optional
        Replaces ranges of [Neamati2022] Table 3.
    periods : float
        How many Kepler periods each orbit stays outside the Brillouin sphere.

    Raises
    ------
    ConfigError, OrbitError
        As `collision_free`.
    """
    card = load_body(body)
    drawn = collision_free(
        gravity_of(card),
        card.brillouin_radius,
        count * (1 + others),
        Streams(seed),
        ranges,
        periods=periods,
    )
    elements = drawn.elements[list(ELEMENT_NAMES)].reset_index(drop=True)
    index = np.arange(len(elements))
    elements.insert(0, "initial_condition", index // (1 + others))
    elements.insert(1, "orbit", index % (1 + others))
    facts = {
        "body": body,
        "seed": seed,
        "ranges": {name: list(pair) for name, pair in (ranges or {}).items()},
        "screened_periods": periods,
        "drawn": drawn.tried,
    }
    return OrbitList(elements, facts)


def read_orbits(path: Path) -> OrbitList:
    """Read a list that `OrbitList.write` wrote, or one by hand (without a hash).

    Raises
    ------
    DataError
        If the file is missing or damaged, or its hash is not that of its content.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path} cannot be read ({error})") from error
    head, _, rest = text.partition("\n")
    try:
        facts = json.loads(head[1:]) if head.startswith("#") else {}
        elements = _parsed(rest if head.startswith("#") else text)
        regular = _is_regular(elements)
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(
            f"{path} is not a list of initial conditions ({str(error).splitlines()[0]})",
            allowed=f"CSV with the columns {', '.join(_COLUMNS)}",
        ) from error
    if not regular:
        raise DataError(
            f"{path}: the initial conditions are not numbered 0, 1, ... with the same number of "
            "orbits 0, 1, ... each, or an element is missing",
            allowed="orbit 0 (training) and at least orbit 1 (extrapolation) of each",
        )
    stated = facts.pop("sha256", None)
    orbits = OrbitList(elements, facts)
    if stated is not None and stated != orbits.hash:
        raise DataError(
            f"{path} was changed: its content has not the hash that it states",
            do="restore it; to use other orbits, give a file of your own without the first line",
        )
    return orbits


def _parsed(text: str) -> pd.DataFrame:
    """Read numbers with Python's ``float``, which gives back what was written to the last digit."""
    rows = list(csv.DictReader(io.StringIO(text)))
    columns = {name: [float(row[name]) for row in rows] for name in _COLUMNS}
    return pd.DataFrame(columns).astype(dict.fromkeys(_INDEX, int))


def _is_regular(elements: pd.DataFrame) -> bool:
    if not np.all(np.isfinite(elements.to_numpy(dtype=float))):
        return False
    count = int(elements["initial_condition"].max()) + 1 if len(elements) else 1
    width, rest = divmod(len(elements), count)
    expected = np.arange(len(elements))
    return (
        rest == 0
        and width >= 2
        and np.array_equal(elements["initial_condition"], expected // width)
        and np.array_equal(elements["orbit"], expected % width)
    )


def _text(elements: pd.DataFrame) -> str:
    """CSV whose numbers read back as the same floats."""
    return elements.to_csv(index=False, lineterminator="\n")
