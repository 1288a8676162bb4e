"""Which learners the table has: all that are registered, a few of them in two versions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import skill.oracle
import unmodeled.models.learned  # noqa: F401  registers the learners
from skill.fields import Field
from unmodeled.core.units import NORMALISED_GM
from unmodeled.models.learned import learner_class, learner_names

__all__ = ["ORACLE", "REFERENCES", "Row", "learner_rows"]

ORACLE = "oracle that knows the family"
#: Kinds that are no candidates; they are first in every table.
REFERENCES = ("point_mass", "fitted_point_mass")
#: The wrapper is chosen by the baseline; the oracles are one row, a kind for each field.
_NOT_ROWS = {"residual", "zonal_oracle", skill.oracle.NAME}
#: Settings that differ from the defaults: the fastest way to the same optimum, and for the
#: network a third of the epochs in single precision (5e-3 instead of 4e-3 on its own orbit).
_SETTINGS: dict[str, list[dict[str, Any]]] = {
    "exact_gp": [{"optimizer": "newton"}],
    "spectral_mlp": [{"precision": "single", "epochs": 1000}],
    "harmonic_gp": [
        {},
        {"degree": 16, "label": "harmonic gp, to degree 16"},
        {"gm_sigma": 1e-3 * NORMALISED_GM, "label": "harmonic gp, mass known"},
    ],
    "potential_mlp": [{}, {"mass_error": 0.0, "label": "potential mlp, mass known"}],
}
#: Labels of rows that cost many times what the cost table says of their kind: fewest pairs, and
#: no flights (0.3 to 1 ms a point: up to 12 s a flight).
_HEAVY = ("harmonic gp, to degree 16", "harmonic kernel gp")
#: Learners of the paper, which has no baseline: raw too.
_ALSO_RAW = ("exact_gp", "spectral_mlp")


@dataclass(frozen=True)
class Row:
    """A learner of the table.

    Parameters
    ----------
    spec : dict
        As in a configuration.
    heavy : bool
        True for fewest pairs and no flights.
    """

    spec: dict[str, Any]
    heavy: bool = False

    @property
    def always(self) -> bool:
        """True for what every table needs: the bare point mass and the oracle."""
        return self.spec.get("label") == ORACLE or self.spec["kind"] == "point_mass"


def learner_rows(field: Field) -> list[Row]:
    """Return the learners for a field, references first.

    Every registered learner joins by itself, on a point mass unless it contains the mass.
    """
    skill.oracle.register()
    names = [n for n in learner_names() if n not in _NOT_ROWS]
    rows: list[Row] = []
    for name in [*REFERENCES, *(n for n in names if n not in REFERENCES)]:
        for settings in _SETTINGS.get(name, [{}]):
            heavy = settings.get("label", name.replace("_", " ")) in _HEAVY
            rows.append(Row({"kind": name} | settings, heavy))
            if name in _ALSO_RAW and not learner_class(name).stands_alone:
                rows.append(Row({"kind": name, "baseline": "none"} | settings))
        if name == REFERENCES[-1]:
            rows.append(Row(field.oracle | {"label": ORACLE}))
    return rows
