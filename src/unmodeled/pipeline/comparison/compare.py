"""Fit a model and say where it fails."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pandas as pd
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.comparison.dependence import residual_maps
from unmodeled.pipeline.comparison.force_kind import explain
from unmodeled.pipeline.comparison.free_force import free_force
from unmodeled.pipeline.comparison.orbit_geometry import revolution
from unmodeled.pipeline.comparison.residual_table import residual_table, rtn_table, series_of
from unmodeled.pipeline.comparison.result import Comparison, SeriesCorrelation
from unmodeled.pipeline.comparison.rhythm import rhythm
from unmodeled.pipeline.comparison.whiteness import autocorrelation, is_coloured, whiteness
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["compare"]

_UNITS = {"range": "m", "range_rate": "m/s", "x": "m", "y": "m", "z": "m"}
#: Series too short for a correlation.
_FEWEST = 12

Progress = Callable[[str, float], None]


def compare(case: Case, progress: Progress | None = None) -> Comparison:
    """Fit a case's model as it is and say where, how and by how much it fails.

    Nothing is added to the model: `diagnose` looks for what to add.

    Parameters
    ----------
    case : Case
        Model and measurements; its candidates are not looked at.
    progress : callable, optional
        Called with a text and the share done.

    Raises
    ------
    DataError
        Fewer measurements than unknowns, or a free parameter that does not act on them.
    NumericalError
        If the model as given cannot be fitted.
    OrbitError
        If the first guess cannot be propagated.
    """
    begin = time.perf_counter()
    say = progress or (lambda text, share: None)
    say("fitting the model as given", 0.0)
    fit = case.fit()
    lin = Linearisation(case, fit)
    say("residuals and whiteness", 0.4)
    turns = [revolution(a.partials.node_states, a.partials.nodes) for a in lin.arcs]
    period = float(np.median(turns))
    table = residual_table(lin)
    white = whiteness(lin)
    coloured = is_coloured(white)
    maps = residual_maps(lin, table, period, coloured=coloured)
    say("reconstructing the missing acceleration", 0.6)
    force = free_force(lin, period)
    say("weighing what it looks like", 0.8)
    explanation = explain(lin)
    low, high = (float(scipy.stats.chi2.ppf(q, fit.freedom)) for q in (0.025, 0.975))
    spin = abs(lin.model.values.get("spin_rate", 0.0))
    return Comparison(
        case=case,
        period=period,
        spin_period=2 * np.pi / spin if spin else np.inf,
        states=fit.states,
        values=fit.values,
        sigmas=fit.sigmas,
        cost=fit.cost,
        freedom=fit.freedom,
        reduced_window=(low / fit.freedom, high / fit.freedom),
        rms=_rms(table),
        residuals=table,
        rtn=rtn_table(lin),
        whiteness=white,
        correlations=_correlations(lin, period),
        coloured=coloured,
        maps=maps,
        rhythm=rhythm(lin),
        force=force,
        explanation=explanation,
        seconds=time.perf_counter() - begin,
    )


def _rms(table: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for (label, component), part in table.groupby(["label", "component"], sort=False):
        used = part[part["used"]]
        unit = _UNITS.get(str(component), "m/s" if str(component).startswith("v") else "rad")
        rows.append(
            {
                "label": label,
                "component": component,
                "unit": unit,
                "rms": float(np.sqrt(np.mean(used["residual"] ** 2))) if len(used) else np.nan,
                "rms_in_sigmas": float(np.sqrt(np.mean(used["normalised"] ** 2)))
                if len(used)
                else np.nan,
                "count": len(used),
                "edited": len(part) - len(used),
            }
        )
    return pd.DataFrame(rows)


def _correlations(lin: Linearisation, period: float) -> tuple[SeriesCorrelation, ...]:
    rows = lin.rows()
    times = rows["t_s"].to_numpy()
    found = []
    for arc, label, component, index in series_of(rows):
        if len(index) < _FEWEST:
            continue
        a = autocorrelation(times[index], lin.residuals[index], period)
        lags: Array = a.step * np.arange(1, len(a.values) + 1, dtype=np.float64)
        band: Array = 1.96 / np.sqrt(np.maximum(a.pairs, 1))
        found.append(SeriesCorrelation(arc, label, component, lags, a.values, band))
    return tuple(found)
