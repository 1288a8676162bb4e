"""Which set of candidates explains the residuals: a search that can change its mind."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from unmodeled.pipeline.diagnosis.pool import Pool, SetScore, log_p

__all__ = ["MARGIN", "best_set", "drop_p", "passes", "pruned"]

#: Sets that are followed side by side, and how many ways of growing each are tried.
_BEAM = 5
#: A set must beat another by this much evidence to replace it: 3 to 1.
MARGIN = float(np.log(3.0))


def best_set(
    pool: Pool,
    start: Sequence[int],
    limit: float,
    growth: int,
    banned: frozenset[str] = frozenset(),
    most: int | None = None,
) -> SetScore:
    """Return the set with the most evidence whose members all pass the threshold.

    From ``start``, sets are grown by up to ``growth`` members and members are exchanged, several
    sets side by side: a blend of two effects that looks like a third is undone when both are in.

    Parameters
    ----------
    pool : Pool
        The candidates.
    start : sequence of int
        Members that are in the model now.
    limit : float
        ln p that every member must reach when it alone is dropped from the set.
    growth : int
        How many members may be added.
    banned : frozenset of str
        Candidates that are not added: their exact fit failed.
    most : int, optional
        Largest set; one more than ``growth`` allows if not given, for a blend that is split.
    """
    known: dict[frozenset[int], SetScore] = {}

    def score(chosen: Sequence[int]) -> SetScore:
        key = frozenset(chosen)
        if key not in known:
            known[key] = pool.score(sorted(chosen))
        return known[key]

    best = pruned(pool, score(tuple(start)), limit)
    beam = [best]
    for step in range(growth):
        grown: dict[frozenset[int], SetScore] = {}
        for current in beam:
            drops, p = pool.gains(current.members)
            free = _free(pool, current.members, banned)
            order = [k for k in np.argsort(p) if k in free and drops[k] > 0][: 2 * _BEAM]
            for k in order:
                candidate = score((*current.members, int(k)))
                grown[frozenset(candidate.members)] = candidate
        ranked = sorted(grown.values(), key=lambda s: -s.evidence)
        beam = ranked[:_BEAM]
        # Whether anything is missing is for the threshold to say; which, for the evidence.
        if step == 0:
            passed = [s for s in ranked if passes(pool, s, limit)]
            best = passed[0] if passed else best
        for candidate in beam:
            # Exchanged first, pruned then: the right set may need that a wrong member leaves.
            settled = pruned(pool, _exchanged(pool, candidate, score, banned), limit)
            if settled.members and settled.evidence > best.evidence + MARGIN:
                best = settled
    best = _exchanged(pool, best, score, banned, limit)
    room = growth and len(best.members) < (len(start) + growth + 1 if most is None else most)
    return _split(pool, best, score, banned, limit) if room else best


def drop_p(pool: Pool, chosen: Sequence[int], member: int) -> tuple[float, float]:
    """Return by how much chi-square rises without one member of a set, and its ln p."""
    whole = pool.score(chosen)
    rest = pool.score([m for m in chosen if m != member])
    size = pool.members[member].size
    drop = max(whole.drop - rest.drop, 0.0)
    taken = sum(pool.members[m].size for m in rest.members)
    p = log_p(np.array([drop]), np.array([size]), pool.square - rest.drop, pool.freedom - taken)
    return drop, float(p[0])


def passes(pool: Pool, s: SetScore, limit: float) -> bool:
    """Say whether each member of a set is needed: ln p of dropping it alone reaches ``limit``."""
    return all(drop_p(pool, s.members, m)[1] <= limit for m in s.members)


def pruned(pool: Pool, s: SetScore, limit: float) -> SetScore:
    """Drop the weakest member of a set until each passes the threshold, ln p ``limit``."""
    while s.members:
        p = {m: drop_p(pool, s.members, m)[1] for m in s.members}
        weakest = max(p, key=lambda m: p[m])
        if p[weakest] <= limit:
            return s
        s = pool.score([m for m in s.members if m != weakest])
    return s


def _exchanged(
    pool: Pool,
    s: SetScore,
    score: Callable[[Sequence[int]], SetScore],
    banned: frozenset[str],
    limit: float | None = None,
) -> SetScore:
    """Exchange one member, or put one in the place of two, while the evidence grows."""
    for _ in range(4 * max(len(s.members), 1)):
        best = s
        sizes = (1, 2) if len(s.members) > 1 else (1,)
        for out in (o for size in sizes for o in itertools.combinations(s.members, size)):
            rest = [m for m in s.members if m not in out]
            drops, p = pool.gains(rest)
            free = _free(pool, rest, banned)
            order = [int(k) for k in np.argsort(p) if k in free and drops[k] > 0]
            for trial in ([*rest, k] for k in order[: 2 * _BEAM]):
                candidate = score(trial)
                if candidate.evidence <= best.evidence + MARGIN:
                    continue
                if limit is not None:
                    candidate = pruned(pool, candidate, limit)
                if candidate.evidence > best.evidence + MARGIN:
                    best = candidate
        if best is s:
            return s
        s = best
    return s


def _split(
    pool: Pool,
    s: SetScore,
    score: Callable[[Sequence[int]], SetScore],
    banned: frozenset[str],
    limit: float,
) -> SetScore:
    """Put two members in the place of one if that has more evidence: the one was a blend."""
    best = s
    for out in s.members:
        rest = [m for m in s.members if m != out]
        for first in _foremost(pool, rest, banned):
            for second in _foremost(pool, [*rest, first], banned):
                candidate = score([*rest, first, second])
                if candidate.evidence > best.evidence + MARGIN:
                    candidate = pruned(pool, candidate, limit)
                    if candidate.evidence > best.evidence + MARGIN:
                        best = candidate
    return best


def _foremost(pool: Pool, chosen: Sequence[int], banned: frozenset[str]) -> list[int]:
    """Return the members with the smallest p-values beside a set, one a candidate."""
    drops, p = pool.gains(chosen)
    free, names, found = _free(pool, chosen, banned), set[str](), list[int]()
    for k in np.argsort(p):
        name = pool.members[k].candidate.name
        if k in free and drops[k] > 0 and name not in names:
            names.add(name)
            found.append(int(k))
        if len(found) == 2 * _BEAM:
            break
    return found


def _free(pool: Pool, chosen: Sequence[int], banned: frozenset[str]) -> set[int]:
    """Members of candidates that the set does not have yet and can have."""
    taken = pool.excluded(chosen) | banned
    return {k for k, m in enumerate(pool.members) if m.candidate.name not in taken}
