"""Which further data would tell effects apart: computed before any exist."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import scipy.stats
from scipy.spatial.transform import Rotation

from unmodeled.core.arrays import Array
from unmodeled.core.errors import UnmodeledError
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.result import Finding
from unmodeled.pipeline.fit_problem import Arc
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["further_data"]

_COLUMNS = ["finding", "rival", "data", "correlation", "probability"]
_MORE = 4.0


def further_data(
    case: Case, findings: Sequence[Finding], candidates: Sequence[Candidate]
) -> pd.DataFrame:
    """Return how well each finding could be told from its rivals with one more arc.

    The arc is flown with the fitted model, measured like the first arc, and added to the data at
    hand; the correlation is that of the two signals in both together, with the states of both
    arcs projected out.

    Parameters
    ----------
    case : Case
        The final case: all findings in its model.
    findings : sequence of Finding
        Those with rivals are looked at.
    candidates : sequence of Candidate
        Of the case as given.

    Returns
    -------
    DataFrame
        finding, rival, data (words), correlation, probability that the label would be right:
        Phi(sqrt(lambda (1 - rho) / 2)).
    """
    pairs = [(f, r.name) for f in findings for r in f.rivals[:4]]
    if not pairs:
        return pd.DataFrame(columns=_COLUMNS)
    known = {c.name: c for c in candidates}
    wanted = {n for f, r in pairs for n in (f.name, r)} & set(known)
    now = _signals(case, case.arcs, [known[n] for n in sorted(wanted)])
    rows = []
    for words, change in _designs(case):
        if change is None:
            extra = {k: (_MORE - 1.0) * v for k, v in now.items()}
        else:
            try:
                extra = _signals(case, (change(case.arcs[0]),), [known[n] for n in sorted(wanted)])
            except UnmodeledError:  # that orbit does not exist here: it hits the body
                continue
        for finding, rival in pairs:
            if not {finding.name, rival} <= wanted:
                continue
            rho, strength = _together(finding, known[finding.name], rival, now, extra)
            chance = float(scipy.stats.norm.cdf(np.sqrt(0.5 * strength * (1.0 - rho))))
            rows.append((finding.name, rival, words, rho, chance))
    table = pd.DataFrame(rows, columns=_COLUMNS)
    return table.sort_values(
        ["finding", "rival", "probability"], ascending=[True, True, False], kind="stable"
    ).reset_index(drop=True)


def _designs(case: Case) -> list[tuple[str, Callable[[Arc], Arc] | None]]:
    def turned(arc: Arc) -> Arc:
        # About the line to the spacecraft: the plane tilts, the orbit's shape stays.
        axis = arc.state[:3] / np.linalg.norm(arc.state[:3])
        velocity = Rotation.from_rotvec(np.radians(50.0) * axis).apply(arc.state[3:])
        return _flown(case, arc, np.concatenate([arc.state[:3], velocity]))

    def eccentric(arc: Arc) -> Arc:
        return _flown(case, arc, np.concatenate([arc.state[:3], np.sqrt(1.3) * arc.state[3:]]))

    def scaled(factor: float) -> Callable[[Arc], Arc]:
        def change(arc: Arc) -> Arc:
            position, velocity = arc.state[:3] * factor, arc.state[3:] / np.sqrt(factor)
            return _flown(case, arc, np.concatenate([position, velocity]))

        return change

    return [
        ("an arc whose plane is tilted by 50 degrees", turned),
        ("an arc with periapsis here and eccentricity 0.3 more", eccentric),
        ("an arc at 1.5 times the distance", scaled(1.5)),
        ("an arc at 0.8 of the distance", scaled(0.8)),
        ("four times as many such data", None),
    ]


def _flown(case: Case, arc: Arc, state: Array) -> Arc:
    """Return an arc with perfect measurements of another orbit at the same times."""
    sets = []
    for m in arc.measurements:
        grid = np.unique(np.concatenate([[arc.epoch], m.times]))
        states = case.dynamics.propagate(state, grid)[np.searchsorted(grid, m.times)]
        if np.linalg.norm(states[:, :3], axis=1).min() < case.body.brillouin_radius:
            raise _ImpactError(f"{arc.name}: the orbit hits the body")
        sets.append(replace(m, values=m.observed(states)))
    return replace(arc, state=state, measurements=tuple(sets))


class _ImpactError(UnmodeledError):
    """The orbit that was tried hits the body."""


def _signals(case: Case, arcs: Sequence[Arc], candidates: Sequence[Candidate]) -> dict[str, Array]:
    """Return Gram blocks of the projected columns of each pair of candidates."""
    plain = replace(case, arcs=tuple(arcs), held_out=(), estimate={})
    lin = Linearisation(plain, plain.fit(settled=1e-3))
    model, instruments = case.dynamics.values, dict(case.instrument_values)
    columns = {}
    for c in candidates:
        values = {
            **c.values,
            **{k: v for k, v in {**model, **instruments}.items() if k in c.values},
        }
        at = values if c.is_force else c.values
        columns[c.name] = lin.project(lin.columns(c.effect, at, c.estimate))
    return {f"{a}|{b}": columns[a].T @ columns[b] for a in columns for b in columns}


def _together(
    finding: Finding, own: Candidate, rival: str, now: dict[str, Array], extra: dict[str, Array]
) -> tuple[float, float]:
    """Return correlation with the finding's signal, and non-centrality, in all data together."""
    theta = np.array([e.value for e in finding.estimates])
    theta = theta - np.array([own.values[n] for n in own.estimate])
    f = finding.name

    def block(a: str, b: str) -> Array:
        return now[f"{a}|{b}"] + extra[f"{a}|{b}"]

    strength = float(theta @ block(f, f) @ theta)
    cross = block(rival, f) @ theta
    explained = float(cross @ np.linalg.pinv(block(rival, rival), rcond=1e-10) @ cross)
    rho = float(np.sqrt(np.clip(explained / max(strength, 1e-300), 0.0, 1.0)))
    return rho, strength
