"""From scores to findings: estimates, classes that cannot be told apart, what speaks against."""

from __future__ import annotations

import numpy as np
import pandas as pd
import scipy.stats

from unmodeled.datasets.slips import explain_rotation, explain_time_offset
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.cases.case import Case
from unmodeled.pipeline.diagnosis.alternatives import ODDS, as_good
from unmodeled.pipeline.diagnosis.place_spread import place_spread
from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.result import Estimate, Finding, Rival
from unmodeled.pipeline.diagnosis.search import drop_p
from unmodeled.pipeline.diagnosis.start import estimates_of, place_of
from unmodeled.pipeline.diagnosis.stretches import strength_by_stretches, stretches
from unmodeled.pipeline.diagnosis.threshold import chi_square_threshold, needed_noncentrality
from unmodeled.pipeline.orbit_fit import OrbitFit

__all__ = ["describe_candidates", "describe_finding"]

_BLOCKS = 12
_PULL = 4.0


def describe_finding(
    case: Case,
    pool: Pool,
    chosen: SetScore,
    member: int,
    limit: float,
    fit: OrbitFit,
    *,
    coloured: bool = False,
) -> Finding:
    """Describe one member of the chosen set; ``coloured``: what remains is not white."""
    m = pool.members[member]
    candidate = m.candidate
    drop, p = drop_p(pool, chosen.members, member)
    rest = [k for k in chosen.members if k != member]
    spread = place_spread(pool, chosen, member, candidate, fit.values)
    estimates = estimates_of(candidate, fit, chosen.noise, spread)
    rivals = _rivals(pool, chosen, member, drop)
    weights = np.exp(-np.log([r.odds for r in rivals]))
    confidence = float(1.0 / (1.0 + weights.sum()))
    confidence = min([confidence, *(r.probability for r in rivals)])
    q, change = _stability(pool, chosen, member)
    return Finding(
        name=candidate.name,
        title=candidate.title,
        family=candidate.family,
        estimates=estimates,
        place=place_of(candidate, fit, chosen.noise, spread),
        drop=drop,
        threshold=chi_square_threshold(limit, m.size) * chosen.noise**2,
        log10_p=p / np.log(10.0),
        evidence=chosen.evidence - pool.score(rest).evidence,
        rivals=rivals,
        confidence=confidence,
        consistency_p=q,
        largest_change=change,
        remarks=(
            *_remarks(case, candidate, estimates),
            *(_doubts(pool, chosen, member) if coloured else ()),
        ),
    )


def describe_candidates(pool: Pool, limit: float) -> pd.DataFrame:
    """Return what each candidate alone would explain, and the least that would have been seen."""
    drops, p = pool.gains(())
    noise = pool.score(()).noise
    best: dict[str, int] = {}
    for k, m in enumerate(pool.members):
        name = m.candidate.name
        if name not in best or drops[k] > drops[best[name]]:
            best[name] = k
    rows = []
    for name, k in best.items():
        m = pool.members[k]
        c = m.candidate
        alone = pool.score((k,))
        single = m.size == 1 and alone.covariance[0, 0] > 0
        sigma = float(np.sqrt(alone.covariance[0, 0])) * c.priors[0] if single else np.nan
        # Without an effect in the data the noise is what the best set leaves; at least one sigma.
        quiet = sigma / alone.noise if single else np.nan
        rows.append(
            {
                "name": name,
                "title": c.title,
                "family": c.family,
                "drop": drops[k],
                "log10_p": p[k] / np.log(10.0),
                "ln_evidence": alone.evidence,
                "parameter": c.estimate[0] if m.size == 1 else ", ".join(c.estimate),
                "estimate": alone.estimate[0] * c.priors[0] if m.size == 1 else np.nan,
                "sigma": sigma,
                "unit": c.parameters[0].unit,
                "expected": c.priors[0],
                "smallest_detectable": quiet * np.sqrt(needed_noncentrality(limit, m.size))
                if single
                else np.nan,
                "threshold": chi_square_threshold(limit, m.size),
                "noise": noise,
            }
        )
    if not rows:
        return pd.DataFrame(columns=["name", "parameter", "smallest_detectable", "unit"])
    return pd.DataFrame(rows).sort_values("log10_p", kind="stable").reset_index(drop=True)


def _rivals(pool: Pool, chosen: SetScore, member: int, drop: float) -> tuple[Rival, ...]:
    rest = [k for k in chosen.members if k != member]
    taken = pool.names(chosen) | pool.excluded(rest)
    noncentrality = max(drop / chosen.noise**2 - pool.members[member].size, 0.0)
    shares = pool.shares(member, chosen.members)
    found: dict[str, Rival] = {}
    for k, m in enumerate(pool.members):
        name = m.candidate.name
        # Far from parallel and far from weak: no need to score it.
        if name in taken or noncentrality * (1.0 - shares[k] ** 2) > 20.0 * ODDS:
            continue
        other = pool.score((*rest, k))
        odds = float(np.clip(chosen.evidence - other.evidence, -700.0, 700.0))
        better = name not in found or np.exp(odds) < found[name].odds
        if better and as_good(other, chosen):
            chance = scipy.stats.norm.cdf(np.sqrt(0.5 * noncentrality * (1.0 - shares[k])))
            found[name] = Rival(
                name, m.candidate.title, float(shares[k]), float(np.exp(odds)), float(chance)
            )
    return tuple(sorted(found.values(), key=lambda r: r.odds))


def _stability(pool: Pool, chosen: SetScore, member: int) -> tuple[float | None, float]:
    """Agreement of the arcs (Q test's p), and the largest change when a part is left out."""
    residual = pool.left(chosen)
    own = pool.members[member].columns
    B = pool.columns[:, own]
    F = B.T @ B
    variance = chosen.noise**2
    arcs = pool.lin.arcs
    q = None
    if len(arcs) > 1:
        total, moved = 0.0, np.zeros(len(own))
        for a in arcs:
            b = B[a.rows].T @ residual[a.rows]
            total += float(b @ np.linalg.pinv(B[a.rows].T @ B[a.rows]) @ b)
            moved = moved + b
        total -= float(moved @ np.linalg.pinv(F) @ moved)
        q = float(scipy.stats.chi2.sf(total / variance, len(own) * (len(arcs) - 1)))
    largest = 0.0
    scale = np.sqrt(variance * np.diag(np.linalg.pinv(F)))
    for rows in stretches(pool, _BLOCKS):
        part = B[rows]
        change = np.linalg.pinv(F - part.T @ part) @ (part.T @ residual[rows])
        largest = max(largest, float(np.max(np.abs(change) / np.maximum(scale, 1e-300))))
    return q, largest


def _doubts(pool: Pool, chosen: SetScore, member: int) -> tuple[str, ...]:
    strength = strength_by_stretches(pool, chosen, member)
    text = f"what remains is not white: counted by stretches of time this is {strength:.1f} sigma"
    return (text,)


def _remarks(case: Case, candidate: Candidate, estimates: tuple[Estimate, ...]) -> tuple[str, ...]:
    """Say what speaks against a label, and the common name of a slip."""
    found = []
    for e in estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        if e.pull is not None and e.accepted is not None:
            if abs(e.pull) > _PULL:
                found.append(
                    f"{e.name} would be {e.value:.6g}{unit}, {abs(e.pull):.1f} sigma from the "
                    f"accepted {e.accepted:.6g}: something else is in it, or it is not this"
                )
            else:
                found.append(
                    f"{e.name} agrees with the accepted {e.accepted:.6g}{unit} "
                    f"({e.pull:+.1f} sigma)"
                )
        elif abs(e.value - candidate.values[e.name]) > _PULL * e.expected:
            change = e.value - candidate.values[e.name]
            found.append(
                f"{e.name} would change by {change:.3g}{unit}, {e.expected:.1g} was expected: "
                "unlikely to be this"
            )
    values = np.array([e.value for e in estimates])
    sigmas = np.array([e.sigma for e in estimates])
    text, name = None, candidate.name
    if name.startswith("time_tag") and len(estimates) == 1:
        text = explain_time_offset(float(values[0]), float(sigmas[0]), case.epoch)
    elif name.startswith("frame_rotation"):
        text = explain_rotation(values, sigmas, case.epoch)
    if text:
        found.append(text)
    return tuple(found)
