"""What flying filters gives: tables and a few series, plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.core.provenance import Provenance
from unmodeled.pipeline.navigation.flight import Flight
from unmodeled.pipeline.navigation.scenario_config import ScenarioConfig

__all__ = ["Flown", "NavigationResult"]


@dataclass(frozen=True)
class Flown:
    """One filter, all runs, in SI.

    Parameters
    ----------
    name, title, role : str
        As in the catalogue.
    position_rms, velocity_rms : ndarray (k,)
        Root mean square over runs of the length of the error, m and m/s.
    position_sigma : ndarray (k,)
        Root of the trace of the stated covariance, root mean square over runs, m.
    error, sigma : ndarray (k, 6)
        Of the first run, m and m/s.
    disturbance : ndarray (k, 3) or None
        Estimated in the first run, m/s2.
    nees : ndarray (k,)
        Mean over runs.
    nees_bounds : (float, float)
        Of that mean, 95 %.
    verdict : str
        NEES and NIS in a sentence.
    """

    name: str
    title: str
    role: str
    position_rms: Array
    velocity_rms: Array
    position_sigma: Array
    error: Array
    sigma: Array
    disturbance: Array | None
    nees: Array
    nees_bounds: tuple[float, float]
    verdict: str


@dataclass(frozen=True)
class NavigationResult:
    """Filters on one flight.

    Parameters
    ----------
    config : ScenarioConfig
    flight : Flight
    flown : tuple of Flown
        In the order asked for.
    table : DataFrame
        One row a filter: ``filter``, ``title``, ``role``, ``position_rmse_m``,
        ``velocity_rmse_m_s``, ``mean_position_error_m``, ``mean_position_sigma_m``,
        ``max_in_PHASE_m`` and ``sigma_in_PHASE_m`` for each phase, ``nees``, ``nees_inside``,
        ``nis``, ``disturbance_rmse_m_s2``, ``us_per_step``, ``failure``.
    floor : ndarray (k, 6)
        Riccati floor, standard deviations, SI.
    floor_position_m, floor_velocity_m_s : float
        Its root mean square over the epochs that count.
    provenance : Provenance
    notes : tuple of str
        Sentences on how parts of it were made, e.g. what a learner was fitted to.
    """

    config: ScenarioConfig
    flight: Flight
    flown: tuple[Flown, ...]
    table: pd.DataFrame
    floor: Array
    floor_position_m: float
    floor_velocity_m_s: float
    provenance: Provenance
    notes: tuple[str, ...] = ()
    extra: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Flown:
        return {f.name: f for f in self.flown}[name]

    def as_json(self) -> dict[str, Any]:
        """Return plain data."""
        rows = self.table.astype(object).where(self.table.notna(), None)
        return {
            "name": self.config.name,
            "runs": self.config.runs,
            "filters": rows.to_dict(orient="records"),
            "floor_position_m": self.floor_position_m,
            "floor_velocity_m_s": self.floor_velocity_m_s,
            "verdicts": {f.name: f.verdict for f in self.flown},
            "notes": list(self.notes),
            "provenance": self.provenance.as_dict(),
        }
