"""On what do the residuals depend? Means of the residuals in bins of every variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.core.seeds import Streams
from unmodeled.pipeline.comparison.orbit_geometry import VARIABLES
from unmodeled.pipeline.comparison.residual_table import Index, directions
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["PLACE", "ResidualMap", "residual_maps"]

#: Bins of a variable; of the body's surface by longitude and latitude.
_BINS, _PLACES = 12, (8, 3)
#: Not a variable of its own: as many bins as the radius, with the same edges.
_SAME = ("altitude",)
#: A range below this share of the largest value, or of a turn, is none.
_NARROW = 2e-3
#: Redrawings of the signs of blocks, and blocks in a revolution.
_DRAWS, _BLOCKS = 200, 4
#: The variable with two angles.
PLACE = "place"


@dataclass(frozen=True)
class ResidualMap:
    """Residuals in bins of one variable.

    Parameters
    ----------
    variable : str
        A column of `orbit_geometry`, or "place": longitude and latitude on the body.
    title : str
        In words.
    statistic : float
        By how much the mean of each bin lowers the sum of squares.
    freedom : int
        Of the statistic.
    p : float
        Probability of a larger one by chance, times the number of variables tried (at most 1).
    bins : DataFrame
        A row a bin: low, high (the variable's unit; of the longitude for "place", whose
        latitudes are low_latitude and high_latitude), count (components), rms (in sigmas) and
        z_<component>: mean of the bin in its own standard errors.
    """

    variable: str
    title: str
    statistic: float
    freedom: int
    p: float
    bins: pd.DataFrame


def residual_maps(
    lin: Linearisation, table: pd.DataFrame, period: float, *, coloured: bool
) -> tuple[ResidualMap, ...]:
    """Return a map for each variable that varies, the most telling first.

    Parameters
    ----------
    lin : Linearisation
        At the fit.
    table : DataFrame
        Of `residual_table`.
    period : float
        Of a revolution, s.
    coloured : bool
        The residuals are not white: p-values come from signs drawn anew for whole blocks of a
        quarter of a revolution, which keeps what is correlated together.

    Notes
    -----
    With D the columns that are one in a bin for one component (R, T, N where there are axes) and
    M the projection that leaves residuals, c = D'r has the covariance D'MD for white noise, so
    that c'(D'MD)^+ c is chi-square with the rank of D'MD. The p-value is that of the F-test: a
    noise that was stated wrongly is no dependence.
    """
    used = table[table["used"]].reset_index(drop=True)
    weights = {d.name: d.weights for d in directions(lin)}
    sets = {name: _bins(used, name) for name in (*VARIABLES, PLACE) if name not in _SAME}
    sets = {name: found for name, found in sets.items() if found is not None}
    flips = _flips(lin, used, period) if coloured else None
    maps = []
    for name, found in sets.items():
        assert found is not None
        index, edges = found
        maps.append(_map(lin, name, index, edges, weights, flips, len(sets)))
    return tuple(sorted(maps, key=lambda m: (m.p, -m.statistic / m.freedom)))


def _map(
    lin: Linearisation,
    name: str,
    index: Index,
    edges: pd.DataFrame,
    weights: dict[str, Array],
    flips: Array | None,
    trials: int,
) -> ResidualMap:
    n, k = len(lin.residuals), len(edges)
    inside = np.zeros((n, k))
    inside[np.arange(len(index)), index] = 1.0
    columns = np.concatenate([inside * w[:, None] for w in weights.values()], axis=1)
    left = lin.project(columns)
    gram = left.T @ left
    c = left.T @ lin.residuals
    whole = np.maximum(np.sum(columns**2, axis=0), 1.0)
    size, axes = np.linalg.eigh(gram / np.sqrt(whole[:, None] * whole))
    kept = size > 1e-6
    turn = axes[:, kept].T / np.sqrt(whole) / np.sqrt(size[kept])[:, None]
    drop, rank = float(np.sum((turn @ c) ** 2)), int(kept.sum())
    square = float(lin.residuals @ lin.residuals)
    if flips is None:
        rest = max(lin.freedom - rank, 1)
        p = float(scipy.stats.beta.sf(min(drop / square, 1.0), 0.5 * rank, 0.5 * rest))
    else:
        drawn = np.sum((turn @ (left.T @ flips)) ** 2, axis=0)
        # A chi-square of the mean and variance of the draws: their tail beyond the last of them.
        scale = np.var(drawn) / (2.0 * np.mean(drawn))
        p = float(scipy.stats.chi2.sf(drop / scale, np.mean(drawn) / scale))
    bins = edges.copy()
    spread = np.sqrt(np.diag(gram))
    z = np.where(spread > 1e-3 * np.sqrt(whole), c / np.maximum(spread, 1e-300), 0.0)
    count = inside.sum(axis=0)
    bins["count"] = count.astype(int)
    bins["rms"] = np.sqrt(inside.T @ lin.residuals**2 / np.maximum(count, 1))
    for j, component in enumerate(weights):
        bins[f"z_{component}"] = z[j * k : (j + 1) * k]
    title = "place on the body" if name == PLACE else VARIABLES[name].title
    return ResidualMap(name, title, drop, rank, min(p * trials, 1.0), bins)


def _bins(used: pd.DataFrame, name: str) -> tuple[Index, pd.DataFrame] | None:
    """Bin of each row, and the edges of the bins that hold any; None if all is in one."""
    if name == PLACE:
        columns, rows = _PLACES
        along = np.minimum((used["longitude"] / (2 * np.pi) * columns).astype(int), columns - 1)
        # Belts of equal area.
        up = np.minimum(((np.sin(used["latitude"]) + 1) / 2 * rows).astype(int), rows - 1)
        flat = (along * rows + up).to_numpy()
        full, index = np.unique(flat, return_inverse=True)
        step = 2 * np.pi / columns
        belts = np.arcsin(np.linspace(-1, 1, rows + 1))
        edges = pd.DataFrame(
            {
                "low": (full // rows) * step,
                "high": (full // rows + 1) * step,
                "low_latitude": belts[full % rows],
                "high_latitude": belts[full % rows + 1],
            }
        )
        return None if len(full) < 2 else (index, edges)
    values = used[name].to_numpy()
    variable = VARIABLES[name]
    size = 2 * np.pi if variable.unit == "rad" else float(np.max(np.abs(values)))
    if not np.all(np.isfinite(values)) or np.ptp(values) < _NARROW * size:
        return None
    if name != "time" and _is_clock(used["time"].to_numpy(), values):
        return None
    if variable.circle:
        borders = np.linspace(0.0, 2 * np.pi, _BINS + 1)
    else:
        borders = np.unique(np.quantile(values, np.linspace(0, 1, _BINS + 1)))
        if len(borders) < 3:  # nearly always the same: the rest against it
            borders = np.array([values.min(), np.mean([values.min(), values.max()]), values.max()])
    raw = np.clip(np.searchsorted(borders, values, side="right") - 1, 0, len(borders) - 2)
    full, index = np.unique(raw, return_inverse=True)
    if len(full) < 2:
        return None
    return index, pd.DataFrame({"low": borders[full], "high": borders[full + 1]})


def _is_clock(times: Array, values: Array) -> bool:
    """Whether a variable only runs with time: its map would be that of time."""
    rank = scipy.stats.spearmanr(times, values).statistic
    return bool(abs(float(rank)) > 0.999)


def _flips(lin: Linearisation, used: pd.DataFrame, period: float) -> Array:
    """Residuals with the signs of blocks drawn anew, (n, draws)."""
    quarter = np.floor(used["t_s"].to_numpy() * _BLOCKS / period).astype(int)
    arcs = pd.factorize(used["arc"])[0]
    blocks = np.unique(np.stack([arcs, quarter], axis=1), axis=0, return_inverse=True)[1].ravel()
    generator = Streams(lin.case.seed).generator("compare maps")
    signs = generator.choice([-1.0, 1.0], size=(int(blocks.max()) + 1, _DRAWS))
    out = np.zeros((len(lin.residuals), _DRAWS))
    out[: len(blocks)] = lin.residuals[: len(blocks), None] * signs[blocks]
    return out
