"""Are the residuals what independent noise of the stated size would leave?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy.fft
import scipy.stats

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.known_basis import known_basis
from unmodeled.pipeline.comparison.orbit_geometry import revolution
from unmodeled.pipeline.comparison.residual_table import series_of
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["Autocorrelation", "autocorrelation", "is_coloured", "whiteness"]

#: A single test speaks when its p-value is below this, divided by the number of tests.
_LEVEL = 0.01
#: Fewer samples than this are not tested.
_FEWEST = 12
#: Steps within this share of the usual one belong to one pass.
_UNEVEN = 0.02
#: Shapiro and Wilk's table ends here; above it moments do as well.
_SHAPIRO = 5000
#: Lags with fewer pairs say nothing.
_PAIRS = 4
#: Draws of white noise.
_DRAWS = 200


@dataclass(frozen=True)
class Autocorrelation:
    """Correlation of a series with itself.

    Parameters
    ----------
    values : ndarray (h,) or (h, s)
        At lags 1 ... h, of each series.
    pairs : ndarray (h,)
        How many pairs stand behind each; pairs across gaps do not count.
    step : float
        Of a lag, s.
    """

    values: Array
    pairs: Array
    step: float


def whiteness(lin: Linearisation) -> pd.DataFrame:
    """Test each series of residuals: one component of one data set on one arc.

    Parameters
    ----------
    lin : Linearisation
        At the fit; edited components are left out.

    Returns
    -------
    DataFrame
        A row a test: arc, label, component, test, statistic, freedom, lags, p, verdict.

        ljung-box
            Autocorrelation at all lags up to one revolution (at most half of the longest pass),
            [LjungBox1978] Eq. 3, with the pairs that gaps leave.
        runs
            Changes of sign, [WaldWolfowitz1940]; the statistic is in sigmas, negative if the
            residuals keep their sign too long.
        chi-square
            Sum of squares against the stated sigmas and what the fit absorbs; two-sided.
        normality
            [ShapiroWilk1965]; above 5000 samples skewness and kurtosis, [JarqueBera1987].

        The verdict is that of the single test at 1 %, shared among all tests of its kind: "white",
        "coloured", "as stated", "larger than stated", "smaller than stated", "normal",
        "not normal", or "too few" (p is then NaN).

    Notes
    -----
    With as many lags as a revolution has samples Ljung and Box's statistic is wider than
    chi-square, and the fit has taken part of the slowest changes. So the same statistic is taken
    of white noise that went through the same fit: p is that of a chi-square with the mean and
    variance of these draws.
    """
    rows = lin.rows()
    series = series_of(rows)
    absorbed = np.sum(known_basis(lin) ** 2, axis=1)
    noise = lin.project(np.random.default_rng(0).normal(size=(len(lin.residuals), _DRAWS)))
    turns = {a.arc.name: revolution(a.partials.node_states, a.partials.nodes) for a in lin.arcs}
    level = _LEVEL / max(len(series), 1)
    times = rows["t_s"].to_numpy()
    found = []
    for arc, label, component, index in series:
        r, t = lin.residuals[index], times[index]
        tests = (
            _ljung_box(t, r, noise[index], turns[arc], level),
            _runs(r, level),
            _chi_square(r, float(np.sum(absorbed[index])), level),
            _normality(r, level),
        )
        for test in tests:
            found.append({"arc": arc, "label": label, "component": component, **test})
    return pd.DataFrame(found)


def is_coloured(table: pd.DataFrame) -> bool:
    """Return True if any series of a table of `whiteness` is not white."""
    return bool((table["verdict"] == "coloured").any())


def autocorrelation(times: Array, series: Array, span: float) -> Autocorrelation:
    """Return the autocorrelation about zero up to a time span, within passes.

    Parameters
    ----------
    times : ndarray (n,)
        s, increasing. Where the step differs from the usual one a new pass begins.
    series : ndarray (n,) or (n, s)
        Values of one series or several; their means should be zero.
    span : float
        Largest lag, s; at most half of the longest pass.
    """
    step = float(np.median(np.diff(times)))
    breaks = np.flatnonzero(np.abs(np.diff(times) / step - 1.0) > _UNEVEN) + 1
    passes = np.split(series, breaks, axis=0)
    longest = max(len(p) for p in passes)
    lags = int(np.clip(np.ceil(span / step), 1, max(longest // 2, 1)))
    sums, pairs = np.zeros((lags, *series.shape[1:])), np.zeros(lags)
    for part in passes:
        n = len(part)
        size = scipy.fft.next_fast_len(n + lags, real=True)
        power = np.abs(scipy.fft.rfft(part, size, axis=0)) ** 2
        sums += scipy.fft.irfft(power, size, axis=0)[1 : lags + 1]
        pairs += np.maximum(n - np.arange(1, lags + 1), 0)
    # The mean product of a pair, over the mean square.
    means = (sums.T / np.maximum(pairs, 1)).T
    return Autocorrelation(means / np.mean(series**2, axis=0), pairs, step)


def _ljung_box(
    times: Array, r: Array, noise: Array, turn: float, level: float
) -> dict[str, object]:
    if len(r) < _FEWEST:
        return _too_few("ljung-box", r)
    q, lags = _portmanteau(autocorrelation(times, r[:, None], turn), len(r))
    drawn, _ = _portmanteau(autocorrelation(times, noise, turn), len(r))
    if not lags:
        return _too_few("ljung-box", r)
    scale = np.var(drawn) / (2.0 * np.mean(drawn))
    freedom = float(np.mean(drawn) / scale)
    p = float(scipy.stats.chi2.sf(q[0] / scale, freedom))
    return _row("ljung-box", float(q[0]), freedom, lags, p, "coloured" if p < level else "white")


def _portmanteau(a: Autocorrelation, n: int) -> tuple[Array, int]:
    """Ljung and Box's sum for each column, and its number of lags."""
    some = a.pairs >= _PAIRS
    # With all pairs there, mean times pairs / n is r_k: n (n + 2) r_k^2 / (n - k).
    share = a.values[some] * a.pairs[some, None] / n
    q: Array = n * (n + 2) * np.sum(share**2 / a.pairs[some, None], axis=0)
    return q, int(some.sum())


def _runs(r: Array, level: float) -> dict[str, object]:
    up = r > 0
    n1, n2 = int(up.sum()), int((~up).sum())
    n = n1 + n2
    if min(n1, n2) < _FEWEST // 2:
        return _too_few("runs", r)
    runs = 1 + int(np.sum(up[1:] != up[:-1]))
    mean = 2.0 * n1 * n2 / n + 1.0
    variance = (mean - 1.0) * (mean - 2.0) / (n - 1.0)
    z = (runs - mean) / np.sqrt(variance)
    p = float(2.0 * scipy.stats.norm.sf(abs(z)))
    return _row("runs", float(z), n, 0, p, "coloured" if p < level else "white")


def _chi_square(r: Array, absorbed: float, level: float) -> dict[str, object]:
    square, freedom = float(r @ r), len(r) - absorbed
    if freedom < 1:
        return _too_few("chi-square", r)
    above = float(scipy.stats.chi2.sf(square, freedom))
    below = float(scipy.stats.chi2.cdf(square, freedom))
    p = min(2.0 * min(above, below), 1.0)
    side = "larger than stated" if above < below else "smaller than stated"
    return _row("chi-square", square, freedom, 0, p, side if p < level else "as stated")


def _normality(r: Array, level: float) -> dict[str, object]:
    if len(r) < _FEWEST:
        return _too_few("normality", r)
    test = scipy.stats.shapiro(r) if len(r) <= _SHAPIRO else scipy.stats.jarque_bera(r)
    p = float(test.pvalue)
    verdict = "not normal" if p < level else "normal"
    return _row("normality", float(test.statistic), len(r), 0, p, verdict)


def _too_few(test: str, r: Array) -> dict[str, object]:
    return _row(test, np.nan, len(r), 0, np.nan, "too few")


def _row(
    test: str, statistic: float, freedom: float, lags: int, p: float, verdict: str
) -> dict[str, object]:
    return {
        "test": test,
        "statistic": statistic,
        "freedom": freedom,
        "lags": lags,
        "p": p,
        "verdict": verdict,
    }
