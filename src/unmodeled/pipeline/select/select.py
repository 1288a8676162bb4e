"""Choose a learner from a sweep: one answer for each regime, in words and numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd

from unmodeled.core.errors import ConfigError, nearest
from unmodeled.pipeline.select.blocks import METRICS, blocks_of
from unmodeled.pipeline.select.paired import compare_pairs, medians
from unmodeled.pipeline.select.pareto import pareto
from unmodeled.pipeline.select.ranks import Ranks, rank
from unmodeled.pipeline.select.regimes import regimes_of
from unmodeled.pipeline.select.use import add_use
from unmodeled.pipeline.use_check import DO_NOT_USE

__all__ = ["Choice", "Selection", "select"]

_LEVEL = 0.05
_QUESTION = {
    "interpolation_median": "on the orbit that it was trained on",
    "extrapolation_median": "on other orbits",
    "train_median": "on its training samples",
}


@dataclass(frozen=True)
class Choice:
    """The answer for one regime.

    Parameters
    ----------
    regime : str
        Which part of the grid.
    winner : str
        Learner with the best mean rank.
    sure : bool
        Whether it is told apart from every other learner (Wilcoxon, Holm, 5 %).
    rivals : tuple of str
        Learners that it is not told apart from.
    medians, pairs : DataFrame
        From `medians` (with ``over_point_mass`` and ``use`` of `add_use`) and `compare_pairs`.
    ranks : Ranks
        Mean ranks and groups.
    sentence : str
        In words.
    """

    regime: str
    winner: str
    sure: bool
    rivals: tuple[str, ...]
    medians: pd.DataFrame
    pairs: pd.DataFrame
    ranks: Ranks
    sentence: str


@dataclass(frozen=True)
class Selection:
    """Choices by regime, and error against cost over all runs.

    Parameters
    ----------
    metric : str
        What was compared.
    choices : tuple of Choice
        One a regime.
    pareto : DataFrame
        See `pareto`.
    """

    metric: str
    choices: tuple[Choice, ...]
    pareto: pd.DataFrame

    def __getitem__(self, regime: str) -> Choice:
        """Return the choice of a regime.

        Raises
        ------
        ConfigError
            With the nearest name.
        """
        for choice in self.choices:
            if choice.regime == regime:
                return choice
        known = [choice.regime for choice in self.choices]
        raise ConfigError(f'unknown regime "{regime}"', do=nearest(regime, known))

    def as_json(self) -> dict[str, Any]:
        """Return plain data for JSON; infinite values as null."""
        import json

        def rows(table: pd.DataFrame) -> Any:
            return json.loads(table.to_json(orient="records"))

        return {
            "metric": self.metric,
            "regimes": [
                {
                    "regime": c.regime,
                    "winner": c.winner,
                    "sure": c.sure,
                    "not_told_apart": list(c.rivals),
                    "sentence": c.sentence,
                    "medians": rows(c.medians),
                    "pairs": rows(c.pairs),
                    "mean_ranks": {str(k): float(v) for k, v in c.ranks.mean.items()},
                    "critical_difference": c.ranks.critical_difference,
                }
                for c in self.choices
            ],
            "pareto": rows(self.pareto),
        }


def select(table: pd.DataFrame, metric: str = "extrapolation_median") -> Selection:
    """Choose a learner for each regime of a sweep.

    Parameters
    ----------
    table : DataFrame
        From `sweep`.
    metric : str
        ``extrapolation_median`` (robustness), ``interpolation_median`` (safety) or
        ``train_median``.

    Raises
    ------
    ConfigError, DataError
        Unknown metric, fewer than two learners, nothing to compare.
    """
    if metric not in METRICS:
        raise ConfigError(
            f'metric "{metric}"', allowed=", ".join(METRICS), do=nearest(metric, METRICS)
        )
    choices = tuple(_choose(name, part, metric) for name, part in regimes_of(table).items())
    return Selection(metric, choices, pareto(table, metric))


def _choose(regime: str, table: pd.DataFrame, metric: str) -> Choice:
    blocks = blocks_of(table, metric)
    ranks = rank(blocks)
    pairs = compare_pairs(blocks)
    winner = str(ranks.mean.index[0])
    against = pairs[(pairs["better"] == winner) | (pairs["worse"] == winner)]
    beaten = against[(against["better"] == winner) & (against["p_holm"] < _LEVEL)]["worse"]
    rivals = tuple(str(n) for n in ranks.mean.index[1:] if n not in set(beaten))
    middles = add_use(medians(blocks), table)
    sentence = _sentence(regime, winner, rivals, middles, pairs, metric)
    return Choice(regime, winner, not rivals, rivals, middles, pairs, ranks, sentence)


def _sentence(
    regime: str,
    winner: str,
    rivals: tuple[str, ...],
    middles: pd.DataFrame,
    pairs: pd.DataFrame,
    metric: str,
) -> str:
    row = middles[middles["learner"] == winner].iloc[0]
    text = (
        f"{regime[0].upper()}{regime[1:]}: {winner}, median error {row['median']:.2g} "
        f"({row['low']:.2g} to {row['high']:.2g}) {_QUESTION[metric]}"
    )
    won = pairs[(pairs["better"] == winner) & ~pairs["worse"].isin(rivals)]
    if len(won):
        next_ = won.sort_values("ratio").iloc[0]
        text += (
            f"; {_few(next_['ratio'])} times below {next_['worse']}, better on "
            f"{round(next_['share'] * next_['problems'])} of {next_['problems']} problems"
        )
    if rivals:
        text += f"; not told apart from {', '.join(rivals)}: take the cheaper one"
    if row["use"] == DO_NOT_USE:
        text += (
            f"; even so {_few(row['over_point_mass'])} times the error of a bare point mass: "
            f"{DO_NOT_USE}"
        )
    unfit = [
        f"{r['learner']} ({_few(r['over_point_mass'])} times)"
        for r in middles.to_dict(orient="records")
        if r["use"] == DO_NOT_USE and r["learner"] != winner
    ]
    if unfit:
        text += f"; {DO_NOT_USE}, against a bare point mass: {', '.join(unfit)}"
    if not row["median"] < 1:
        text += "; an error of 1 is no skill: use none of them here"
    return text + "."


def _few(value: float) -> str:
    """Return two digits, without a power of ten where that is short.

    Examples
    --------
    >>> [_few(v) for v in (2.14, 123.0, 4.2e7)]
    ['2.1', '120', '4.2e+07']
    """
    return f"{float(f'{value:.2g}'):.0f}" if 100 <= value < 1e5 else f"{value:.2g}"
