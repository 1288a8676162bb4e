"""The files of a navigation run."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd

from unmodeled.pipeline.navigation.result import NavigationResult
from unmodeled.pipeline.yaml12 import yaml_text

__all__ = ["save_navigation", "series_table"]

_MOST_ROWS = 2000


def save_navigation(result: NavigationResult, folder: Path) -> None:
    """Write tables, result, scenario and provenance as files.

    ``filters.csv``, ``series.csv``, ``result.json``, ``scenario.yaml``, ``provenance.json``.

    Parameters
    ----------
    result : NavigationResult
    folder : Path
        Existing.
    """
    result.table.to_csv(folder / "filters.csv", index=False, lineterminator="\n")
    series_table(result).to_csv(folder / "series.csv", index=False, lineterminator="\n")
    content = json.dumps(result.as_json(), indent=2)
    (folder / "result.json").write_text(content + "\n", encoding="utf-8")
    scenario = yaml_text(result.config.as_dict())
    (folder / "scenario.yaml").write_text(scenario, encoding="utf-8")
    provenance = json.dumps(result.provenance.as_dict(), indent=2)
    (folder / "provenance.json").write_text(provenance + "\n", encoding="utf-8")


def series_table(result: NavigationResult) -> pd.DataFrame:
    """Return errors in time, one row an epoch and filter: ``t_s``, ``filter``, SI columns.

    Long flights are thinned to 2,000 epochs.
    """
    times = result.flight.times * result.flight.scale.time
    at = np.unique(np.linspace(0, len(times) - 1, min(len(times), _MOST_ROWS)).astype(int))
    parts = []
    for f in result.flown:
        columns = {
            "t_s": times[at],
            "filter": f.name,
            "position_rms_m": f.position_rms[at],
            "velocity_rms_m_s": f.velocity_rms[at],
            "position_sigma_m": f.position_sigma[at],
            "nees": f.nees[at],
        }
        for j, axis in enumerate(result.flight.axes):
            columns[f"error_{axis}_m"] = f.error[at, j]
            columns[f"sigma_{axis}_m"] = f.sigma[at, j]
            if f.disturbance is not None:
                columns[f"disturbance_{axis}_m_s2"] = f.disturbance[at, j]
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
