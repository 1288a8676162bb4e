"""Facts of the data and elements of its orbits, as tables."""

from __future__ import annotations

from typing import Any

from unmodeled.pipeline.results import CharacterizationResult
from unmodeled.reports.numbers import number
from unmodeled.reports.tables import Table

__all__ = ["data_table", "element_table"]

_ELEMENTS = {
    "semi_major_axis": "semi-major axis [Brillouin radii]",
    "eccentricity": "eccentricity [–]",
    "inclination": "inclination [deg]",
    "node": "ascending node [deg]",
    "periapsis": "argument of periapsis [deg]",
    "true_anomaly": "true anomaly [deg]",
}

#: Entries of a list that are shown.
_LONGEST = 5


def data_table(result: CharacterizationResult) -> Table:
    """Return the facts that came with the data, and its units, a row each."""
    units = result.data.units
    rows = [
        ("one unit of length (Brillouin radius), m", number(units.length, 4)),
        ("one unit of time (Kepler period there), s", number(units.time, 5)),
        ("one unit of acceleration, m/s²", number(units.acceleration, 4)),
        *(
            (key.replace("m/s2", "m/s²"), _text(value))
            for key, value in result.data.facts.items()
            if key != "elements"
        ),
    ]
    return Table(
        "Facts of the data", ("fact", "value"), tuple(rows), text_columns=(1,), learners=False
    )


def element_table(result: CharacterizationResult) -> Table:
    """Return the initial osculating elements of simulated orbits; no rows for measured ones."""
    elements = result.data.facts.get("elements", ())
    others = result.data.extrapolation_orbits
    rows = tuple(
        (
            f"extrapolation orbit {k}" if k in others else "training orbit",
            *(f"{row[name]:.4g}" for name in _ELEMENTS),
        )
        for k, row in enumerate(elements)
    )
    return Table(
        "Initial osculating elements", ("orbit", *_ELEMENTS.values()), rows, learners=False
    )


def _text(value: Any) -> str:
    """Return a fact in words: nested facts one after the other, long lists cut."""
    if isinstance(value, dict):
        return "; ".join(f"{key.replace('_', ' ')}: {_text(v)}" for key, v in value.items())
    if isinstance(value, list | tuple):
        shown = ", ".join(_text(v) for v in value[:_LONGEST])
        return shown + (f", ... ({len(value)} in all)" if len(value) > _LONGEST else "")
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return str(value) if isinstance(value, int) else number(value, 3)
