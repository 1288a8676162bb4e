"""The result of `compare`, as plain data."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.comparison.dependence import ResidualMap
from unmodeled.pipeline.comparison.force_kind import Explanation
from unmodeled.pipeline.comparison.free_force import FreeForce
from unmodeled.pipeline.comparison.rhythm import Rhythm

__all__ = ["Comparison", "SeriesCorrelation"]


@dataclass(frozen=True)
class SeriesCorrelation:
    """Autocorrelation of one series of residuals.

    Parameters
    ----------
    arc, label, component : str
        Which.
    lags : ndarray (h,)
        s.
    values : ndarray (h,)
        Correlation at each.
    band : ndarray (h,)
        1.96 / sqrt(pairs): white noise stays inside at 95 % of the lags.
    """

    arc: str
    label: str
    component: str
    lags: Array = field(repr=False)
    values: Array = field(repr=False)
    band: Array = field(repr=False)


@dataclass(frozen=True)
class Comparison:
    """A model beside the data it was fitted to.

    Parameters
    ----------
    case : Case
        As given.
    period : float
        Mean time of a revolution, s.
    spin_period : float
        Of the body, s; infinite if it does not turn.
    states : ndarray (a, 6)
        Fitted initial states, m and m/s.
    values, sigmas : dict of str to float
        Fitted parameters and their standard deviations, SI.
    cost : float
        Sum of squares in sigmas, priors included.
    freedom : int
        Of the cost.
    reduced_window : (float, float)
        95 % of the values of ``reduced`` for noise of the stated size.
    rms : DataFrame
        A row a data set and component: label, component, unit, rms, rms_in_sigmas, count, edited.
    residuals : DataFrame
        Of `residual_table`.
    rtn : DataFrame
        Of `rtn_table`.
    whiteness : DataFrame
        Of `whiteness`.
    correlations : tuple of SeriesCorrelation
        Behind Ljung and Box's test.
    coloured : bool
        A series is not white.
    maps : tuple of ResidualMap
        On what the residuals depend, the most telling variable first.
    rhythm : Rhythm
        The strongest period.
    force : FreeForce
        Reconstructed acceleration.
    explanation : Explanation
        What it looks like.
    seconds : float
        Wall time.
    """

    case: Case = field(repr=False)
    period: float
    spin_period: float
    states: Array
    values: dict[str, float]
    sigmas: dict[str, float]
    cost: float
    freedom: int
    reduced_window: tuple[float, float]
    rms: pd.DataFrame = field(repr=False)
    residuals: pd.DataFrame = field(repr=False)
    rtn: pd.DataFrame = field(repr=False)
    whiteness: pd.DataFrame = field(repr=False)
    correlations: tuple[SeriesCorrelation, ...] = field(repr=False)
    coloured: bool
    maps: tuple[ResidualMap, ...] = field(repr=False)
    rhythm: Rhythm
    force: FreeForce = field(repr=False)
    explanation: Explanation = field(repr=False)
    seconds: float

    @property
    def reduced(self) -> float:
        """Reduced chi-square: cost over freedom."""
        return self.cost / self.freedom

    @property
    def sigmas_left(self) -> float:
        """How many times the stated noise the residuals are."""
        return float(np.sqrt(self.reduced))

    @property
    def only_noise(self) -> bool:
        """True if nothing speaks against noise of the stated size."""
        low, high = self.reduced_window
        # A factor beyond the 95 % window, so that one fit in twenty is not suspected.
        wide = 1.5 * (low - 1.0) + 1.0, 1.5 * (high - 1.0) + 1.0
        return self.structureless and wide[0] <= self.reduced <= wide[1]

    @property
    def structureless(self) -> bool:
        """True if the residuals are as without order as noise, whatever their size."""
        return self.explanation.kind == "nothing" and not self.coloured

    def as_json(self) -> dict[str, Any]:
        """Return everything but the table of residuals for ``json.dumps``; NaN becomes None."""
        e, f = self.explanation, self.force
        plain = {
            "name": self.case.name,
            "body": self.case.body.name,
            "epoch": self.case.epoch,
            "revolution_s": self.period,
            "spin_period_s": self.spin_period,
            "only_noise": self.only_noise,
            "fit": {
                "states": self.states.tolist(),
                "values": self.values,
                "sigmas": self.sigmas,
                "cost": self.cost,
                "freedom": self.freedom,
                "reduced_chi_square": self.reduced,
                "reduced_window_95": list(self.reduced_window),
                "residual_rms_sigmas": self.sigmas_left,
                "rms": _records(self.rms),
            },
            "whiteness": {"coloured": self.coloured, "tests": _records(self.whiteness)},
            "maps": [
                {
                    "variable": m.variable,
                    "statistic": m.statistic,
                    "freedom": m.freedom,
                    "p": m.p,
                    "bins": _records(m.bins),
                }
                for m in self.maps
            ],
            "rhythm": {
                "period_s": self.rhythm.period,
                "share": self.rhythm.share,
                "p": self.rhythm.p,
                "span_s": self.rhythm.span,
            },
            "force": {
                "log_bayes": f.log_bayes,
                "prior_sigma": f.prior_sigma,
                "tau_s": f.tau,
                "step_s": f.step,
                "known": f.known,
                "nodes": _records(f.table),
            },
            "explanation": {
                "kind": e.kind,
                "best": e.best,
                "curl_free": e.curl_free,
                "possible_skill": e.possible_skill,
                "probabilities": e.probabilities,
                "families": _records(e.table),
            },
            "seconds": self.seconds,
        }
        cleaned: dict[str, Any] = _clean(plain)
        return cleaned


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    records: list[dict[str, Any]] = json.loads(table.to_json(orient="records", double_precision=15))
    return records


def _clean(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _clean(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_clean(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
