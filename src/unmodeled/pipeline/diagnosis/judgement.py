"""What a settled search means: doubt, other sets, confidence, verdict."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.remainder import Remainder
from unmodeled.pipeline.diagnosis.result import Alternative, Dismissed, Finding, Verdict
from unmodeled.pipeline.diagnosis.stretches import DOUBTFUL, strength_by_stretches

__all__ = [
    "alternatives_of",
    "drop_without",
    "is_imitation",
    "verdict_of",
    "weakest",
    "weighed",
]

#: From so many effects on that no other source knows, one unknown force is the likelier cause.
_MANY = 4


def drop_without(pool: Pool, chosen: SetScore, member: int) -> float:
    """Return by how much chi-square rises without a member of a set, stated sigmas."""
    return chosen.drop - pool.score([m for m in chosen.members if m != member]).drop


def weakest(pool: Pool, chosen: SetScore) -> tuple[int, Dismissed] | None:
    """Return the member that stands least by stretches of time, if it is doubtful."""
    strength = {m: strength_by_stretches(pool, chosen, m) for m in chosen.members}
    least = min(strength, key=lambda m: strength[m], default=None)
    if least is None or strength[least] >= DOUBTFUL:
        return None
    c = pool.members[least].candidate
    drop = drop_without(pool, chosen, least)
    return least, Dismissed(c.name, c.title, drop, strength[least])


def alternatives_of(
    pool: Pool, chosen: SetScore, findings: tuple[Finding, ...], sets: tuple[SetScore, ...]
) -> tuple[Alternative, ...]:
    """Return the sets that are more than an exchange of findings by their rivals."""
    found = []
    for s in sets:
        candidates = [pool.members[m].candidate for m in s.members]
        names = tuple(c.name for c in candidates)
        if len(names) == len(findings) and any(
            all(n in f.class_names for n, f in zip(order, findings, strict=True))
            for order in itertools.permutations(names)
        ):
            continue
        odds = float(np.exp(np.clip(chosen.evidence - s.evidence, -700.0, 700.0)))
        found.append(Alternative(names, tuple(c.title for c in candidates), odds, s.drop))
    return tuple(found)


def weighed(finding: Finding, others: Sequence[Alternative]) -> Finding:
    """Return a finding whose confidence also counts the sets that do without it."""
    against = sum(1.0 / a.odds for a in others if finding.name not in a.effects)
    return replace(finding, confidence=1.0 / (1.0 / finding.confidence + against))


def is_imitation(findings: Sequence[Finding]) -> bool:
    """Say whether the findings rather imitate together one force that the catalogue lacks.

    Few things are forgotten at once; a sum of many effects can follow almost any force over an
    arc. Effects that come out at their accepted values (the Moon, a tide) do not count.
    """
    return sum(not f.is_as_accepted for f in findings) >= _MANY


def verdict_of(
    findings: Sequence[Finding], others: Sequence[Alternative], remainder: Remainder
) -> Verdict:
    """Return the verdict; "outside the catalogue" goes before what else was found."""
    if remainder.is_force or is_imitation(findings):
        return "outside the catalogue"
    if not findings:
        return "nothing missing"
    return "ambiguous" if others or any(f.rivals for f in findings) else "found"
