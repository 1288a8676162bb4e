"""Other sets of effects that explain the residuals as well: what parsimony alone decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unmodeled.pipeline.diagnosis.pool import Pool, SetScore
from unmodeled.pipeline.diagnosis.search import passes

__all__ = ["ODDS", "as_good", "other_sets"]

#: What has odds of less than 100 to 1 against it is not excluded.
ODDS = float(np.log(100.0))
#: Estimates beyond this many expected sizes are not what their label says.
_IMPLAUSIBLE = 100.0
#: Sets of one size that are grown further, by likelihood and by evidence each.
_BEAM = 12
#: Ways of growing or changing each.
_WAYS = 10
#: Sets near the best whose neighbours are looked at.
_NEIGHBOURS = 40


def other_sets(
    pool: Pool, chosen: SetScore, limit: float, banned: frozenset[str] = frozenset()
) -> tuple[SetScore, ...]:
    """Return the sets that these data cannot tell from the chosen one, best evidence first.

    A set is as good (`as_good`) by its likelihood or by its evidence, every member of it is needed
    (it passes the threshold if it alone is dropped), and it does not contain the chosen one.
    Exchanges of single members are among them; so are two effects whose sum looks like a third.

    Parameters
    ----------
    pool : Pool
        About the final fit.
    chosen : SetScore
        The answer.
    limit : float
        ln p that a member must reach.
    banned : frozenset of str
        Candidates whose exact fit failed.

    Notes
    -----
    Found by growing sets from none, a beam of the best of each size by likelihood and by evidence,
    and by exchanging members of those that turn out as good. A set that neither way meets is
    missed: the list is what was found, not a proof that there is no other.
    """
    if not chosen.members:
        return ()
    known: dict[frozenset[int], SetScore] = {}

    def add(members: Sequence[int]) -> SetScore:
        key = frozenset(members)
        if key not in known:
            known[key] = pool.score(sorted(members))
        return known[key]

    beam = [pool.score(())]
    for _ in range(len(chosen.members) + 1):
        grown = {
            frozenset(s.members): s
            for current in beam
            for s in (add((*current.members, k)) for k in _ways(pool, current.members, banned))
        }
        fit = sorted(grown.values(), key=lambda s: -replace(s, noise=chosen.noise).worth)[:_BEAM]
        odds = sorted(grown.values(), key=lambda s: -s.evidence)[:_BEAM]
        beam = list({s.members: s for s in (*fit, *odds)}.values())
    queue = {chosen.members: chosen}
    queue |= {s.members: s for s in known.values() if as_good(s, chosen)}
    looked: set[tuple[int, ...]] = set()
    while queue and len(looked) < _NEIGHBOURS:
        current = queue.pop(max(queue, key=lambda k: queue[k].evidence))
        looked.add(current.members)
        for out in current.members:
            rest = [m for m in current.members if m != out]
            for s in [add([*rest, k]) for k in _ways(pool, rest, banned)]:
                if s.members not in looked and as_good(s, chosen):
                    queue[s.members] = s
    own = pool.names(chosen)
    best: dict[frozenset[str], SetScore] = {}
    for s in known.values():
        names = pool.names(s)
        # A candidate that is searched over places counts once, at its best place.
        if names >= own or not as_good(s, chosen) or not passes(pool, s, limit):
            continue
        if names not in best or s.evidence > best[names].evidence:
            best[names] = s
    return tuple(sorted(best.values(), key=lambda s: -s.evidence))


def as_good(s: SetScore, chosen: SetScore) -> bool:
    """Say whether the odds against a set are below 100 to 1, by evidence or by the fit alone.

    The priors of an effect are a guess; where only they speak against it, the data do not. The fit
    counts as `SetScore.worth`, with the noise that the chosen set leaves. No guess is wrong by more
    than a factor of 100: an effect that would have to be larger is excluded by what it is.
    """
    if s.evidence > chosen.evidence - ODDS:
        return True
    if s.reach > max(_IMPLAUSIBLE, chosen.reach):
        return False
    return replace(s, noise=chosen.noise).worth > chosen.worth - 2.0 * ODDS


def _ways(pool: Pool, members: Sequence[int], banned: frozenset[str]) -> list[int]:
    """Return the members that explain most beside a set, one a candidate."""
    drops, p = pool.gains(members)
    names = set(pool.excluded(members) | banned)
    found = []
    for k in np.argsort(p, kind="stable"):
        name = pool.members[k].candidate.name
        if name in names or drops[k] <= 0:
            continue
        names.add(name)
        found.append(int(k))
        if len(found) == _WAYS:
            break
    return found
