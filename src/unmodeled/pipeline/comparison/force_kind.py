"""What does the missing force look like? Families weighed by evidence and by held-out skill."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.force_families import KINDS, Family, families
from unmodeled.pipeline.comparison.known_basis import known_basis
from unmodeled.pipeline.comparison.left_out import left_out_errors, stretches
from unmodeled.pipeline.comparison.marginal import Ridge, compress, ridge
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["Explanation", "explain"]

#: Nothing is the answer until its probability is below this; a kind, from this on.
_NOTHING, _SURE = 0.1, 0.8
#: ln of a Bayes factor that counts: curl or no curl, as good as the best or not.
_CURL = 3.0


@dataclass(frozen=True)
class Explanation:
    """Which family of forces explains the residuals.

    Parameters
    ----------
    table : DataFrame
        A row a family, the likeliest first: name, title, kind, depends_on, log_bayes (against
        nothing missing), skill (share of the held-out sum of squares that it explains), noise
        (what is left with it, in stated sigmas), alternatives.
    probabilities : dict of str to float
        Of "nothing" and of each kind, given that one of them is right and all were as likely.
    kind : str
        "nothing" (its probability is above 0.1), a kind (above 0.8), or "undecided".
    best : str
        Name of the likeliest family.
    possible_skill : float
        What noise allows: the skill of a family that leaves the noise of the best one.
    curl_free : bool or None
        Whether a field fixed in the body needs no curl; None: it cannot be told, or the residuals
        do not ask for a field fixed in the body.
    """

    table: pd.DataFrame
    probabilities: dict[str, float]
    kind: str
    best: str
    possible_skill: float
    curl_free: bool | None


def explain(lin: Linearisation) -> Explanation:
    """Weigh the families of `families` against each other and against nothing.

    Parameters
    ----------
    lin : Linearisation
        At the fit.

    Notes
    -----
    Every family has normal coefficients of one unknown size (`ridge`), so that one with more
    freedom pays for it. A kind's evidence is the mean of its families'; where only one of many
    epochs can be right, the mean over epochs. Skill: contiguous parts of the arcs are left out in
    turn and predicted from the rest, states and free parameters refitted without them, exactly
    for a linear model.
    """
    residual = lin.project(lin.residuals)
    known = known_basis(lin)
    parts = list(stretches(lin))
    none = np.zeros((len(residual), 0))
    nothing = float(left_out_errors(known, none, residual, parts).sum())
    rows: dict[str, dict[str, object]] = {}
    evidence: dict[str, list[float]] = {}
    best_of: dict[str, tuple[float, Family, Ridge, Array]] = {}
    for family in families(lin):
        columns = lin.project(family.columns)
        found = ridge(compress(columns, residual), lin.freedom)
        group = "impulse" if family.kind == "impulsive" else family.name
        evidence.setdefault(f"{family.kind}/{group}", []).append(found.log_bayes)
        now = best_of.get(group)
        if now is None or found.log_bayes > now[0]:
            best_of[group] = (found.log_bayes, family, found, columns)
    for group, (_, family, found, columns) in best_of.items():
        root = columns @ found.posterior_root()
        error = float(left_out_errors(known, root, residual, parts).sum())
        logs = evidence[f"{family.kind}/{group}"]
        rows[group] = {
            "name": family.name,
            "title": family.title,
            "kind": family.kind,
            "depends_on": family.depends_on,
            "log_bayes": float(np.logaddexp.reduce(logs) - np.log(len(logs))),
            "skill": 1.0 - error / nothing,
            "noise": float(np.sqrt(found.variance)),
            "alternatives": family.alternatives,
        }
    table = pd.DataFrame(rows.values()).sort_values("log_bayes", ascending=False, kind="stable")
    table = table.reset_index(drop=True)
    probabilities = _probabilities(table)
    return Explanation(
        table,
        probabilities,
        _verdict(table, probabilities),
        str(table["name"].iloc[0]),
        max(1.0 - len(residual) * float(table["noise"].iloc[0]) ** 2 / nothing, 0.0),
        _curl_free(table),
    )


def _probabilities(table: pd.DataFrame) -> dict[str, float]:
    logs = {"nothing": 0.0}
    for kind in KINDS:
        of = table.loc[table["kind"] == kind, "log_bayes"].to_numpy()
        if len(of):
            logs[kind] = float(np.logaddexp.reduce(of) - np.log(len(of)))
    total = np.logaddexp.reduce(list(logs.values()))
    return {kind: float(np.exp(value - total)) for kind, value in logs.items()}


def _verdict(table: pd.DataFrame, probabilities: dict[str, float]) -> str:
    if probabilities["nothing"] > _NOTHING:
        return "nothing"
    kind = max(probabilities, key=lambda k: probabilities[k])
    if kind == "undecided" or probabilities[kind] < _SURE:
        return "undecided"
    best = table[table["kind"] == kind].iloc[0]
    # What does not predict what was left out is no explanation.
    return kind if best["skill"] > 0 else "undecided"


def _curl_free(table: pd.DataFrame) -> bool | None:
    logs = table.set_index("name")["log_bayes"]
    gradient = max(logs[n] for n in logs.index if str(n).startswith("potential"))
    field = logs["field"]
    asked = max(gradient, field) > max(_CURL, float(logs.max()) - _CURL)
    if not asked or abs(gradient - field) < _CURL:
        return None
    return bool(gradient > field)
